"""Pictures in a verdict: bounded data, a small SVG in which nothing acts, and the same in words."""

from __future__ import annotations

import doctest
import json
import xml.etree.ElementTree as ElementTree
from dataclasses import asdict, replace
from types import ModuleType
from typing import Any

import pytest

from autograder.examination.pictures import drawing, wording
from autograder.examination.pictures import picture as picture_data
from autograder.examination.pictures.drawing import HEIGHT, WIDTH, draw_picture
from autograder.examination.pictures.picture import (
    MAX_BYTES,
    MAX_ITEMS,
    MAX_LABEL_CHARS,
    MAX_TITLE_CHARS,
    Lane,
    Picture,
    Series,
    Timeline,
    picture_from_data,
)
from autograder.examination.pictures.wording import describe_picture
from autograder.examination.verdict import CheckResult, Verdict, VerdictError
from autograder.examination.verdict_text import Report
from autograder.gradebook.safe_html import allowed_html

TRIES = Timeline(
    "Tries of a grip",
    5.0,
    (
        Lane.of("tries", {"done": [0.0, 1.5], "wrong": [3.0]}, [(0.0, 1.0, "busy")]),
        Lane.of("due", {"due": [0.0, 1.5, 3.5], "lost": [4.0], "event": [4.5]}),
        Lane.of("may be", {}, [(3.5, 5.0, "allowed")]),
    ),
    (("done", "called"), ("wrong", "too early"), ("busy", "waits")),
)
THREADS = Series("Threads over lives", "lives", "threads", tuple((n, 12 + n) for n in range(21)))
BOTH = [TRIES, THREADS]
EVIL = "</title><script>x"


@pytest.mark.parametrize("module", [drawing, picture_data, wording])
def test_the_examples_run(module: ModuleType) -> None:
    result = doctest.testmod(module)
    assert result.attempted
    assert not result.failed


def failed(picture: Picture | None) -> CheckResult:
    return CheckResult(
        "fresh", "Scans are fresh", "failed", 0.0, 2.0, expected="5.", actual="15.", picture=picture
    )


def data_of(picture: Picture) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(json.dumps(asdict(picture)))
    return data


@pytest.mark.parametrize("picture", BOTH)
def test_a_picture_survives_json_in_its_verdict(picture: Picture) -> None:
    verdict = Verdict("qos", "visible", (failed(picture), failed(None)))
    assert Verdict.from_data(json.loads(json.dumps(verdict.as_data()))) == verdict


def test_a_verdict_of_before_there_were_pictures_is_read() -> None:
    data = Verdict("qos", "visible", (failed(None),)).as_data()
    del data["checks"][0]["picture"]
    assert Verdict.from_data(data).checks == (failed(None),)


def many(number: int) -> list[list[Any]]:
    return [[0.001 * n, "done"] for n in range(number)]


@pytest.mark.parametrize(
    ("picture", "change"),
    [
        (TRIES, {"form": "film"}),
        (TRIES, {"title": "x" * (MAX_TITLE_CHARS + 1)}),
        (TRIES, {"title": 5}),
        (TRIES, {"seconds": 0.0}),
        (TRIES, {"seconds": float("nan")}),
        (TRIES, {"seconds": "1"}),
        (TRIES, {"seconds": True}),
        (TRIES, {"lanes": []}),
        (TRIES, {"lanes": [{"label": "x", "marks": [], "spans": []}] * 5}),
        (TRIES, {"lanes": [{"label": "x", "marks": many(MAX_ITEMS + 1), "spans": []}]}),
        (TRIES, {"lanes": [{"label": "x" * (MAX_LABEL_CHARS + 1), "marks": [], "spans": []}]}),
        (TRIES, {"lanes": [{"label": "x", "marks": [[0.0, "<svg>"]], "spans": []}]}),
        (TRIES, {"lanes": [{"label": "x", "marks": [["<svg>", "done"]], "spans": []}]}),
        (TRIES, {"lanes": [{"label": "x", "marks": [], "spans": [[0.0, 1e300, "busy"]]}]}),
        (TRIES, {"lanes": [{"label": "x", "marks": [], "spans": [[0.0, 1.0, "done"]]}]}),
        (TRIES, {"legend": [["done", "a"], ["done", "b"]]}),
        (TRIES, {"legend": [["<svg>", "a"]]}),
        (TRIES, {"lanes": 5}),
        (THREADS, {"points": [[0, 1]]}),
        (THREADS, {"points": [[0, 10**400], [1, 2]]}),
        (THREADS, {"points": [[0.123456789012, 0.123456789012]] * MAX_ITEMS}),
    ],
)
def test_what_is_no_picture_or_a_large_one_damages_its_verdict(
    picture: Picture, change: dict[str, Any]
) -> None:
    data = Verdict("qos", "visible", (failed(picture),)).as_data()
    data["checks"][0]["picture"].update(change)
    with pytest.raises(VerdictError, match="damaged"):
        Verdict.from_data(data)


def test_the_largest_picture_is_small() -> None:
    lanes = (Lane.of("x" * MAX_LABEL_CHARS, {"done": [n / 10 for n in range(MAX_ITEMS)]}),)
    picture = Timeline("x" * MAX_TITLE_CHARS, 20.0, lanes)
    assert len(json.dumps(asdict(picture))) < MAX_BYTES * 1.2  # with a blank after each comma
    assert len(draw_picture(picture)) < 32_000


@pytest.mark.parametrize("picture", [*BOTH, replace(THREADS, points=((0, 3), (0, 3)))])
def test_a_drawing_is_a_small_svg_that_says_what_it_shows(picture: Picture) -> None:
    drawn = draw_picture(picture)
    svg = ElementTree.fromstring(drawn)
    _, _, width, height = map(float, svg.attrib["viewBox"].split())
    assert width <= WIDTH
    assert height <= HEIGHT
    words = describe_picture(picture)
    tag = "{http://www.w3.org/2000/svg}"
    assert [svg.findtext(f"{tag}title"), svg.findtext(f"{tag}desc")] == [picture.title, words]
    assert (svg.attrib["role"], svg.attrib["aria-label"]) == ("img", words)
    assert allowed_html.is_still(drawn.encode())
    assert not [e for e in svg.iter() if "id" in e.attrib or "href" in str(e.attrib)]


@pytest.mark.parametrize("seconds", [0.001, 0.05, 1.0, 7.3, 1e11])
def test_time_of_any_length_has_an_axis(seconds: float) -> None:
    drawn = draw_picture(replace(TRIES, seconds=seconds))
    assert 3 <= drawn.count('text-anchor="middle"') <= 9


def test_texts_of_a_picture_are_escaped() -> None:
    lane = Lane.of(EVIL, {"done": [1.0]})
    pictures = [
        Timeline(EVIL, 2.0, (lane,), (("done", EVIL),)),
        Series(EVIL, EVIL, EVIL, ((0, 1), (1, 2))),
    ]
    for picture in pictures:
        for shown in (
            draw_picture(picture),
            Report(Verdict("qos", "visible", (failed(picture),)))._repr_html_(),
        ):
            assert "<script" not in shown
            assert "&lt;script&gt;" in shown


def test_the_words_name_each_row_with_its_times() -> None:
    assert describe_picture(TRIES) == (
        "Tries of a grip. tries: called: 2 (0.0, 1.5 s); too early: 1 (3.0 s); waits: 0.0 to 1.0 s."
        " due: 3 (0.0, 1.5, 3.5 s); 1 (4.0 s); 1 (4.5 s). may be: 3.5 to 5.0 s."
    )
    assert describe_picture(THREADS) == (
        "Threads over lives. threads over lives: 12 at 0, 16 at 4, 20 at 8, 24 at 12, 28 at 16, "
        "32 at 20."
    )


def test_the_report_shows_a_picture_after_what_was_observed() -> None:
    report = Report(Verdict("qos", "visible", (failed(TRIES),)))
    lines = repr(report).splitlines()
    assert lines[3].startswith("    observed")
    assert lines[4].startswith("    picture: Tries of a grip. tries: called")
    html = report._repr_html_()
    assert html.index("observed:") < html.index("<svg")
    assert html.count("<svg") == 1


def test_a_submission_cannot_put_a_drawing_of_its_own_into_a_page() -> None:
    drawn = draw_picture(TRIES)
    cleaned = allowed_html.cleaned_html(f"<div>{drawn}</div>")
    assert "<svg" not in cleaned
    assert 'src="data:image/svg+xml;base64,' in cleaned  # a picture, in which nothing acts
    for nested in ("<svg><svg></svg>", "<svg onload=alert(1)>", "<SVG/onload=alert(1)><p>"):
        assert "<svg" not in allowed_html.cleaned_html(nested).lower()


def test_the_data_of_a_picture_are_read_as_they_are() -> None:
    assert picture_from_data(None) is None
    for picture in BOTH:
        assert picture_from_data(data_of(picture)) == picture
