"""Verdicts: what is written can be read, and what is damaged is refused in one sentence."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from autograder.examination.verdict import CheckResult, Verdict, VerdictError
from autograder.examination.verdict_text import Report

FAILED = CheckResult(
    "fresh", "Scans are <fresh>", "failed", 0.0, 2.0, rationale="Half a metre.", expected="5.",
    actual="<script>alert(1)</script>", hints=("one", "two", "three"), read="Chapter 5",
)  # fmt: skip
PASSED = CheckResult("start", "Nodes start", "passed", 1.0, 1.0, note="well done")
VERDICT = Verdict("qos", "visible", (PASSED, FAILED), notes=("a cell was put back",))


def through_json(verdict: Verdict) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(json.dumps(verdict.as_data()))
    return data


def test_a_verdict_survives_json() -> None:
    assert Verdict.from_data(through_json(VERDICT)) == VERDICT


def test_scores_add_up() -> None:
    assert (VERDICT.score, VERDICT.max_score, VERDICT.needs_human) == (1.0, 3.0, False)


@pytest.mark.parametrize(
    "change",
    [
        {"version": 2},
        {"checks": [{"status": "perfect"}]},
        {"checks": None},
        {"exam": None, "checks": [{}]},
    ],
)
def test_a_forged_or_damaged_verdict_is_refused(change: dict[str, object]) -> None:
    data = {**through_json(VERDICT), **change}
    with pytest.raises(VerdictError):
        Verdict.from_data(data)


@pytest.mark.parametrize("points", [3.0, -1.0, float("nan")])
def test_points_outside_their_range_are_refused(points: float) -> None:
    data = through_json(VERDICT)
    data["checks"][1]["points"] = points
    with pytest.raises(VerdictError, match="damaged"):
        Verdict.from_data(data)


@pytest.mark.parametrize("data", [None, 1, "text", [], {}, [[]]])
def test_what_is_no_verdict_is_refused(data: object) -> None:
    with pytest.raises(VerdictError):
        Verdict.from_data(data)


def test_the_report_escapes_what_came_from_a_subject() -> None:
    html = Report(VERDICT)._repr_html_()
    assert "<script>" not in html
    assert "&lt;script&gt;" in html


def test_a_check_without_points_says_why_it_was_made_all_the_same() -> None:
    start = replace(PASSED, points=0.0, max_points=0.0)
    report = Report(Verdict("qos", "visible", (start, FAILED)))
    assert "✔ Nodes start (passed; needed for others, earns nothing by itself)" in repr(report)
    assert "(passed; needed for others, earns nothing by itself)" in report._repr_html_()
    assert "0/0" not in repr(report) + report._repr_html_()
    assert "(not yet, 0/2)" in repr(report)


def test_hints_are_given_one_by_one() -> None:
    one, two, three = (repr(Report(VERDICT, hints=n)) for n in (1, 2, 3))
    assert "hint 1: one" in one
    assert "two" not in one
    assert 'check("qos", hint=2)' in one
    assert "hint 2: two" in two
    assert "hint=4" not in three


def test_the_report_says_what_was_seen_needed_and_why() -> None:
    text = repr(Report(VERDICT))
    for part in (
        "1 of 3 points",
        "a cell was put back",
        "needed: 5.",
        "Half a metre.",
        "Chapter 5",
    ):
        assert part in text
