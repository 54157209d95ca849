"""A page takes in the pictures that lie beside it, and nothing else."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from autograder.gradebook.safe_html import pictures
from autograder.gradebook.safe_html.pictures import with_pictures

EMBEDDED = "data:image/png;base64,UE5H"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "autograded" / "ada"
    (folder / "my plots").mkdir(parents=True)
    for path in (folder / "p.png", folder / "my plots" / "ü & o.png", tmp_path / "bobs.png"):
        path.write_bytes(b"PNG")
    (folder / "notes.txt").write_text("mine")
    (folder / "folder.png").mkdir()
    (folder / "link.png").symlink_to(tmp_path / "bobs.png")
    return folder


@pytest.mark.parametrize(
    "link",
    [
        '<img src="p.png">',
        "<img alt='x' src='./p.png' width=3/>",
        '<IMG\nSRC = "p.png?1">',
        '<img src="my%20plots/%C3%BC%20&amp;%20o.png" alt="">',
    ],
)
def test_a_picture_beside_the_notebook_is_taken_in(folder: Path, link: str) -> None:
    page = with_pictures(f"<p>{link}</p>", folder)
    assert page.count(f'"{EMBEDDED}"') == 1


@pytest.mark.parametrize(
    "source",
    [
        "../../bobs.png", "/etc/hostname.png", "link.png", "notes.txt", "folder.png", "", ".",
        "https://example.org/p.png", "//example.org/p.png", "data:image/png;base64,AAAA", "[p.png",
        "http://[p.png", "p%00.png", "x" * 5000 + ".png", "absent.png",
    ],
)  # fmt: skip
def test_everything_else_stays_the_link_that_it_was(folder: Path, source: str) -> None:
    page = f'<img src="{source}">'
    assert with_pictures(page, folder) == page


def test_code_that_is_shown_is_no_picture(folder: Path) -> None:
    page = '<pre>&lt;img src="p.png"&gt;</pre>'
    assert with_pictures(page, folder) == page


def test_a_page_takes_in_no_more_than_it_may(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "MAX_PICTURES_BYTES", 5)
    (folder / "q.png").write_bytes(b"QQQ")
    page = with_pictures('<img src="p.png"><img src="q.png"><img src="p.png">', folder)
    assert page.count(EMBEDDED) == 2
    assert '<img src="q.png">' in page


def test_a_page_is_gone_through_once_whatever_stands_in_it(folder: Path) -> None:
    page = "<img " * 200_000 + "<img" + " src" * 200_000 + '="' * 100_000
    started = time.process_time()
    with_pictures(page, folder)
    assert time.process_time() - started < 5
