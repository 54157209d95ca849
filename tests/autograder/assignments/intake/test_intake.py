"""Notebooks and attempts under other names: taken and said, claimed, or asked about."""

from __future__ import annotations

import io
import json
import os
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_notebook

from autograder.assignments import submission
from autograder.assignments.intake import claim_records
from autograder.assignments.intake.claim_records import Claim, ClaimError
from autograder.assignments.intake.handed_files import archives, file_names
from autograder.assignments.intake.handed_files.archives import ArchiveError
from autograder.assignments.intake.handed_files.handed_in import look_through
from autograder.assignments.intake.notebook_search import (
    Found,
    Intake,
    NotHandedInError,
    UnclearError,
    of_student,
)
from autograder.assignments.submission import SubmissionError
from tests.autograder.assignments.intake.test_intake_cells import (
    WORK,
    released,
    stripped,
    worked_on,
)
from tests.autograder.gradebook.test_quiz_marks import take

NAME, OTHER = "qos-design", "patterns"


def other() -> NotebookNode:
    """Return another notebook of the assignment."""
    notebook = released()
    for cell in notebook.cells:
        name = f"other-{submission.grade_id(cell)}"
        cell.id = cell.metadata["nbgrader"]["grade_id"] = name
        cell.source = f"# Another exercise\n{cell.source}"
    return notebook


def text(notebook: NotebookNode | None = None) -> str:
    return nbformat.writes(notebook if notebook is not None else worked_on())


def zipped(*members: tuple[str | zipfile.ZipInfo, str]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members:
            archive.writestr(name, content)
    return buffer.getvalue()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "submitted" / "ana" / "ch05"
    folder.mkdir(parents=True)
    return folder


def put(folder: Path, place: str, content: str | bytes) -> None:
    (folder / place).parent.mkdir(parents=True, exist_ok=True)
    (folder / place).write_bytes(content.encode() if isinstance(content, str) else content)


def intake(folder: Path, claims: dict[str, Claim] | None = None) -> Intake:
    notebooks = {NAME: released(), OTHER: other()}
    return Intake(folder, notebooks, claims or {}, whose="ch05 ana")


def found(folder: Path, claims: dict[str, Claim] | None = None) -> Found:
    return intake(folder, claims).find_notebook(NAME)


def work(notebook: NotebookNode) -> bool:
    return any(cell.source == WORK for cell in notebook.cells)


PLACES = [
    "qos-design (1).ipynb", "qos-design-1.ipynb", "Qos-Design.ipynb", "ana_qos-design.ipynb",
    "qos-design - Kopie.ipynb", "ch05/ch05/qos-design.ipynb", "qos-design.ipynb.txt",
    "qos-design.json", "qos-design.ipynb (1)", "Exercise.ipynb", "a\nb\x1b[31m.ipynb",
]  # fmt: skip


@pytest.mark.parametrize("lost", [False, True])
@pytest.mark.parametrize("place", PLACES)
def test_the_one_notebook_of_another_name_is_taken_and_said(
    folder: Path, place: str, lost: bool
) -> None:
    put(folder, place, text(stripped(worked_on()) if lost else None))
    taken = found(folder)
    assert work(taken.notebook)
    for said in (*taken.notes, *taken.remarks):
        assert file_names.printable_name(place) in said
        assert said.isprintable()
    assert len(taken.notes) == len(taken.remarks) == 1


@pytest.mark.parametrize("place", ["hand-in.zip", "deep/er/hand-in.ZIP"])
@pytest.mark.parametrize("member", ["qos-design.ipynb", "Übung 5/qos-design (2).ipynb"])
def test_a_notebook_in_a_zip_file_is_taken_with_what_lies_beside_it(
    folder: Path, place: str, member: str
) -> None:
    beside = f"{Path(member).parent}/helper.py".removeprefix("./")
    junk = (f"__MACOSX/{member}", "junk")
    put(folder, place, zipped((member, text()), (beside, "depth = 5"), junk))
    taken = found(folder)
    assert work(taken.notebook)
    assert f"'{place}/{member}'" in taken.notes[0]
    assert intake(folder).find_attachments(taken).files["helper.py"] == b"depth = 5"


def test_a_notebook_in_a_folder_finds_what_lies_beside_it(folder: Path) -> None:
    put(folder, "ch05/qos-design.ipynb", text())
    put(folder, "ch05/data/größe.csv", "1")
    taken = found(folder)
    assert intake(folder).find_attachments(taken).files["data/größe.csv"] == b"1"


@pytest.mark.parametrize("flag", [True, False])
def test_names_in_zip_files_are_read_as_they_were_meant(folder: Path, flag: bool) -> None:
    content = zipped(("Übung.ipynb", text()))
    if not flag:  # as older programs write it: UTF-8, and not a word of it
        content = content.replace((0x800).to_bytes(2, "little") + b"\x08", b"\x00\x00\x08")
        assert zipfile.ZipFile(io.BytesIO(content)).namelist() != ["Übung.ipynb"]
    put(folder, "hand-in.zip", content)
    assert "hand-in.zip/Übung.ipynb" in found(folder).notes[0]


def asked(folder: Path, claims: dict[str, Claim] | None = None) -> UnclearError:
    with pytest.raises(UnclearError) as caught:
        found(folder, claims)
    assert str(caught.value).isprintable()
    assert caught.value.suggestion.isprintable()
    assert "autograder claim ch05 ana qos-design" in caught.value.suggestion
    assert "--nothing" in caught.value.suggestion
    return caught.value


def test_two_notebooks_that_both_match_are_asked_about(folder: Path) -> None:
    put(folder, "qos-design (1).ipynb", text())
    put(folder, "qos-design (2).ipynb", text(worked_on(solution="depth = 7")))
    said = str(asked(folder))
    assert "'qos-design (1).ipynb' and 'qos-design (2).ipynb'" in said


def test_a_copy_is_no_second_notebook_and_a_stub_none_beside_work(folder: Path) -> None:
    put(folder, "qos-design (1).ipynb", text())
    put(folder, "copy/qos-design.ipynb", text())
    put(folder, "hand-in.zip", zipped(("qos-design.ipynb", text())))
    put(folder, "release/qos-design.ipynb", text(released()))
    assert work(found(folder).notebook)


@pytest.mark.parametrize(
    ("place", "content"),
    [
        ("qos-design (1).ipynb", "{"),
        ("my work.ipynb", text(new_notebook(cells=[new_code_cell(WORK)]))),
        ("qos-design.pdf", "%PDF"),
        ("report.docx", "PK"),
        ("hand-in.zip", "no zip file"),
        ("hand-in.zip", zipped(("inner.zip", "PK"))),
        ("hand-in.tar.gz", "x"),
        ("x\n\x1b[2J.ipynb", "{"),
    ],
    # Not by content: a zip file has the time in it, and pytest's workers must agree on names.
    ids=lambda value: value if isinstance(value, str) and len(value) < 30 else "content",
)
def test_what_may_be_the_notebook_is_asked_about(
    folder: Path, place: str, content: str | bytes
) -> None:
    put(folder, place, content)
    assert f"'{file_names.printable_name(place)}" in str(asked(folder))


UNCLAIMED: dict[str, str | bytes] = {
    "rest.tar.gz": "x", "rest.rar": "x", "rest.7z": "x", "exercise1.pdf": "%PDF", "my_part.py": "",
    "deep/er/photo.jpg": "x", "hand-in.zip": zipped(), "hand-in.zip/inner.zip": "PK",
    "hand-in.zip/qos-design.pdf": "%PDF", "hand-in.zip/../up.pdf": "%PDF",
}  # fmt: skip


def put_unclaimed(folder: Path, place: str, content: str | bytes) -> None:
    archive, _, member = place.partition(".zip/")
    if member:
        put(folder, f"{archive}.zip", zipped((member, str(content)), ("patterns.ipynb", "{}")))
    else:
        put(folder, place, content)


@pytest.mark.parametrize("place", UNCLAIMED)
def test_whatever_else_lies_beside_another_notebook_is_asked_about(
    folder: Path, place: str
) -> None:
    put(folder, f"{OTHER}.ipynb", text(other()))
    put_unclaimed(folder, place, UNCLAIMED[place])
    assert f"'{place}'" in str(asked(folder))


def test_an_encrypted_file_in_a_zip_file_is_asked_about(folder: Path) -> None:
    put(folder, f"{OTHER}.ipynb", text(other()))
    content = bytearray(zipped(("work", text())))
    content[content.index(b"PK\x01\x02") + 8] |= 1
    put(folder, "hand-in.zip", bytes(content))
    assert "'hand-in.zip/work'" in str(asked(folder))
    with pytest.raises(ArchiveError, match="encrypted"):
        archives.look_into(folder / "hand-in.zip").read("work", 1)


def test_a_zip_file_with_ten_thousand_members_is_not_read(folder: Path) -> None:
    put(folder, "hand-in.zip", zipped(*((f"{n}.ipynb", "{}") for n in range(10_000))))
    assert "'hand-in.zip' (it has more than 1000 members)" in str(asked(folder))
    assert len(look_through(folder).items) == 1


def test_a_zip_file_that_lies_about_its_table_is_not_read(folder: Path) -> None:
    content = bytearray(zipped(*((f"{n}", "") for n in range(archives.MAX_MEMBERS + 1))))
    end = content.rfind(b"PK\x05\x06")
    content[end + 10 : end + 12] = b"\x01\x00"
    put(folder, "hand-in.zip", bytes(content))
    with pytest.raises(ArchiveError):
        archives.look_into(folder / "hand-in.zip")


def test_what_grows_without_end_is_not_unpacked(folder: Path) -> None:
    put(
        folder,
        "hand-in.zip",
        zipped(("qos-design.ipynb", "[" * (submission.MAX_NOTEBOOK_BYTES + 1))),
    )
    assert "hand-in.zip/qos-design.ipynb" in str(asked(folder))


def test_links_folders_and_odd_paths_in_zip_files_lead_nowhere(folder: Path) -> None:
    link = zipfile.ZipInfo("link.ipynb")
    link.external_attr = 0o120777 << 16
    put(
        folder, "hand-in.zip",
        zipped((link, "/etc/passwd"), ("folder.ipynb/", ""), ("q.ipynb", text()), ("../up.py", "x"),
               ("/abs.py", "x"), ("ok/mine.py", "x")),
    )  # fmt: skip
    places = [item.place for item in look_through(folder).items]
    assert "hand-in.zip/link.ipynb" not in places
    assert "hand-in.zip/folder.ipynb/" not in places
    taken = found(folder)
    assert set(intake(folder).find_attachments(taken).files) == {"hand-in.zip", "ok/mine.py"}


def test_what_is_another_notebooks_is_not_asked_about(folder: Path) -> None:
    put(folder, f"{OTHER}.ipynb", text(other()))
    put(folder, f"{OTHER} (1).ipynb", text(other()))
    put(folder, "again.zip", zipped((f"ch05/{OTHER}.ipynb", text(other())), ("ch05/lab.py", "")))
    put(folder, "data/lab.py", "x = 1")
    take(folder, "ana", 1)
    for place in ("timestamp.txt", "ch05/submission_secret.txt", ".hidden", "Thumbs.db"):
        put(folder, place, "x")
    released_with = Intake(
        folder, {NAME: released(), OTHER: other()}, {}, whose="ch05 ana",
        given=frozenset({"lab.py"}),
    )  # fmt: skip
    with pytest.raises(SubmissionError, match=r"There is no qos-design.ipynb in the submission\.$"):
        released_with.find_notebook(NAME)
    assert released_with.has_others


def test_what_a_person_has_said_of_another_notebook_is_not_asked_about(folder: Path) -> None:
    put(folder, "mine.ipynb", text(new_notebook(cells=[new_code_cell(WORK)])))
    said = {OTHER: claimed(folder, "mine.ipynb")[NAME]}
    with pytest.raises(SubmissionError, match=r"There is no qos-design.ipynb in the submission\.$"):
        found(folder, said)


def test_what_lies_beside_the_folder_is_asked_about(folder: Path) -> None:
    put(folder, f"{OTHER}.ipynb", text(other()))
    put(folder.with_name("ch05 (1)"), f"{NAME}.ipynb", text())
    put(folder.with_name("ch04"), "lamp.ipynb", text())
    (folder.parents[2] / "source" / "ch04").mkdir(parents=True)
    notebooks = {NAME: released(), OTHER: other()}

    taken = of_student(folder.parents[2], "ch05", "ana", notebooks)

    assert taken.find_notebook(OTHER).item is None
    with pytest.raises(UnclearError, match=r"next to the submission's folder lies 'ch05 \(1\)'"):
        taken.find_notebook(NAME)


def test_an_empty_folder_asks_nothing(folder: Path) -> None:
    put(folder, "timestamp.txt", "2026-11-27 20:15:05 UTC")
    with pytest.raises(SubmissionError, match=r"There is no qos-design\.ipynb") as caught:
        found(folder)
    assert not isinstance(caught.value, UnclearError)
    assert not intake(folder).has_others


def test_the_notebook_in_its_place_counts_and_others_are_said(folder: Path) -> None:
    put(folder, f"{NAME}.ipynb", text())
    assert found(folder) == Found(found(folder).notebook)
    put(folder, f"{NAME} (1).ipynb", text(worked_on(solution="depth = 7")))
    taken = found(folder)
    assert work(taken.notebook)
    assert "there is 'qos-design (1).ipynb', too" in taken.remarks[0]


@pytest.mark.parametrize("content", ["{", text(released())])
def test_a_damaged_one_or_a_stub_in_its_place_is_asked_about_if_there_is_another(
    folder: Path, content: str
) -> None:
    put(folder, f"{NAME}.ipynb", content)
    put(folder, f"{NAME} (1).ipynb", text())
    assert "qos-design (1).ipynb" in str(asked(folder))


@pytest.mark.parametrize("content", ["{", text(released())])
@pytest.mark.parametrize(
    "place", ["my solution.ipynb", "rest.tar.gz", "qos-design.py", "hand-in.zip/inner.zip"]
)
def test_a_damaged_one_or_a_stub_is_asked_about_where_the_work_may_lie_beside_it(
    folder: Path, place: str, content: str
) -> None:
    put(folder, f"{NAME}.ipynb", content)
    colab = text(new_notebook(cells=[new_code_cell(WORK)]))
    put_unclaimed(folder, place, colab if place.endswith(".ipynb") else "x")
    assert f"'{place}'" in str(asked(folder))


def test_a_stub_beside_a_picture_and_a_module_is_a_stub(folder: Path) -> None:
    put(folder, f"{NAME}.ipynb", text(released()))
    put(folder, "robot.png", "x")
    put(folder, "lab.py", "x = 1")
    assert not work(found(folder).notebook)


def test_a_notebook_saved_under_the_name_of_another_is_asked_about(folder: Path) -> None:
    put(folder, f"{OTHER}.ipynb", text())
    unclear = asked(folder)
    assert f"{OTHER}.ipynb holds its cells" in str(unclear)
    assert f"qos-design {OTHER}.ipynb`" in unclear.suggestion


@pytest.mark.parametrize("written", ["composed", "decomposed"])
def test_decomposed_names_are_the_same_names(folder: Path, written: str) -> None:
    import unicodedata

    form = "NFC" if written == "composed" else "NFD"
    put(folder, f"{unicodedata.normalize(form, 'Übung')}.ipynb", text())
    taken = Intake(folder, {"Übung": released()}, {}, whose="ch05 ana").find_notebook("Übung")
    assert work(taken.notebook)
    assert (taken.notes, taken.remarks) == ((), ())


def claimed(folder: Path, file: str) -> dict[str, Claim]:
    handed_in = look_through(folder)
    return {NAME: Claim(file, claim_records.digest_state(folder, handed_in, f"{NAME}.ipynb", file))}


def test_what_is_claimed_counts(folder: Path) -> None:
    put(folder, "a.ipynb", text(worked_on(solution="depth = 7")))
    put(folder, "hand-in.zip", zipped(("b.ipynb", text())))
    taken = found(folder, claimed(folder, "hand-in.zip/b.ipynb"))
    assert work(taken.notebook)
    assert taken.claimed
    assert "as a person has said" in taken.notes[0]


def test_a_claimed_file_that_is_gone_or_another_is_asked_about(folder: Path) -> None:
    put(folder, "my work.ipynb", text(new_notebook(cells=[new_code_cell(WORK)])))
    claims = claimed(folder, "my work.ipynb")
    put(folder, "my work.ipynb", text(new_notebook(cells=[new_code_cell("other = 1")])))
    asked(folder, claims)
    (folder / "my work.ipynb").unlink()
    assert "is gone since" in str(asked(folder, claims))


def test_a_later_hand_in_is_not_hidden_by_a_claim(folder: Path) -> None:
    put(folder, "old.ipynb", text(worked_on(solution="depth = 7")))
    claims = claimed(folder, "old.ipynb")
    put(folder, f"{NAME}.ipynb", text())
    taken = found(folder, claims)
    assert work(taken.notebook)
    assert "the claim no longer holds" in taken.remarks[0]


def test_that_there_is_nothing_holds_until_something_else_is_handed_in(folder: Path) -> None:
    put(folder, "report.pdf", "x")
    claims = claimed(folder, "")
    with pytest.raises(NotHandedInError, match="as a person has said"):
        found(folder, claims)
    put(folder, "report2.pdf", "x")
    asked(folder, claims)


def test_claims_are_kept_and_taken_back(tmp_path: Path) -> None:
    odd = os.fsdecode(b"b\xff.ipynb")
    claim_records.keep_claim(tmp_path, "ch05", "ana", NAME, Claim(odd, "1"))
    claim_records.keep_claim(tmp_path, "ch05", "ana", OTHER, Claim("", "2"))
    assert claim_records.of_student(tmp_path, "ch05", "ana") == {
        NAME: Claim(odd, "1"), OTHER: Claim("", "2"),
    }  # fmt: skip
    claim_records.keep_claim(tmp_path, "ch05", "ana", NAME, None)
    assert set(claim_records.of_student(tmp_path, "ch05", "ana")) == {OTHER}
    assert claim_records.of_student(tmp_path, "ch06", "ana") == {}


@pytest.mark.parametrize("content", ["{", "[]", '{"version": 2}', '{"version": 1, "claims": [1]}'])
def test_a_damaged_file_of_claims_says_so(tmp_path: Path, content: str) -> None:
    (tmp_path / claim_records.FILE).write_text(content)
    with pytest.raises(ClaimError, match=re.escape(claim_records.FILE)):
        claim_records.of_student(tmp_path, "ch05", "ana")


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("a.ipynb", "a.ipynb"), ("a\nb", "a\\nb"), ("\x1b[31m", "\\x1b[31m"),
        ("A\u0308", "Ä"), ("\u202egnp", "\\u202egnp"), (os.fsdecode(b"\xff"), "\\udcff"),
        ("x" * 400, "x" * 300 + "…"),
    ],
)  # fmt: skip
def test_names_are_shown_safely(name: str, shown: str) -> None:
    assert file_names.printable_name(name) == shown


def test_no_more_than_so_many_files_are_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parsed = 0
    parse: Callable[[str, str], NotebookNode] = submission.parse

    def counting(content: str, name: str) -> NotebookNode:
        nonlocal parsed
        parsed += 1
        return parse(content, name)

    monkeypatch.setattr(submission, "parse", counting)
    for number in range(100):
        put(folder, f"{number}.ipynb", json.dumps({"number": number}))
    asked(folder)
    assert parsed <= 20
