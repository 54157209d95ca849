"""Progress: a bar with the time left on a terminal, plain lines elsewhere, nothing for machines."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from autograder.examination.verdict import CheckResult, Verdict
from autograder.grading import run_progress
from autograder.grading.engine import Graded
from autograder.grading.run_progress import Clock, Lines, Live, RunProgress
from autograder.running.runner import Outcome

ADA = Graded("ada [bold]", {}, 12.5, 15.0, 4.04)
BOB = Graded("bob", {}, 0.0, 15.0, 0.0, "It was cut off.")


def console(*, terminal: bool) -> Console:
    return Console(file=io.StringIO(), force_terminal=terminal, width=70)


def said(out: Console) -> str:
    assert isinstance(out.file, io.StringIO)
    return out.file.getvalue()


def test_lines_say_what_each_submission_got() -> None:
    out = console(terminal=False)
    lines = Lines(out)
    lines.begin(submissions=10, notebooks=10, unchanged=2)
    lines.notebook_ran(waited=False)
    lines.submission_done(ADA)
    lines.submission_done(BOB)
    lines.end()
    assert said(out).splitlines() == [
        "2 submissions have not changed since they were graded: they are left as they are.",
        "   1 of 10  ada [bold]: 12.5 of 15 automatic points, 4.0 s",
        "   2 of 10  bob: 0 of 15 automatic points, 0.0 s  It was cut off.",
    ]


def test_what_was_not_examined_is_said_once_with_its_reason() -> None:
    check = CheckResult("repaired", "Lost stops are sent again", "not_examined", 0.0, 2.0)
    checks = (replace(check, actual="This network loses nothing."),)
    outcome = Outcome(verdicts={"hidden": Verdict("qos", "hidden", checks)})
    out = console(terminal=False)
    lines = Lines(out)
    lines.begin(submissions=2, notebooks=2, unchanged=0)
    for student in ("ada", "bob"):
        lines.submission_done(Graded(student, {"qos-design": outcome}, 13.0, 15.0, 4.0))
    lines.end()
    assert said(out).splitlines() == [
        "  1 of 2  ada: 13 of 15 automatic points (2 not examined), 4.0 s",
        "  2 of 2  bob: 13 of 15 automatic points (2 not examined), 4.0 s",
        "Left to a person: qos-design, “Lost stops are sent again”: This network loses nothing.",
    ]


def test_many_reasons_are_told_by_the_report() -> None:
    lines = Lines(out := console(terminal=False))
    for number in range(20):
        check = CheckResult("c", f"Check {number}", "not_examined", 0.0, 1.0, actual="Why.")
        outcome = Outcome(verdicts={"hidden": Verdict("qos", "hidden", (check,))})
        lines.submission_done(Graded("ada", {"qos-design": outcome}))
    lines.end()
    told = [line for line in said(out).splitlines() if line.startswith("Left to a person")]
    assert len(told) == run_progress.MOST_REASONS + 1
    assert "autograder report" in told[-1]


def test_a_terminal_has_a_bar_that_goes_away() -> None:
    out = console(terminal=True)
    live = Live(out)
    live.begin(submissions=2, notebooks=2, unchanged=0)
    live.notebook_ran(waited=True)
    live.submission_done(ADA)
    live.end()
    assert "1/2" in said(out)
    assert "a few seconds left" in said(out)
    assert "1 of 2  ada [bold]: 12.5" in said(out)
    assert said(out).rstrip().endswith("\x1b[2K"), "the bar's line is cleared in the end"


def test_the_time_left_counts_what_was_really_run() -> None:
    now = [100.0]
    clock = Clock(now=lambda: now[0])
    clock.begin(notebooks=100)
    assert clock.time_left() == ""
    for _ in range(60):
        clock.count_notebook(waited=False)
    assert clock.time_left() == "", "what was kept took no time"
    now[0] += 60
    for _ in range(10):
        clock.count_notebook(waited=True)
    assert clock.time_left() == "about 3 min left"
    for _ in range(30):
        clock.count_notebook(waited=True)
    assert clock.time_left() == ""


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (2, "a few seconds"),
        (7, "about 5 s"),
        (61, "about 60 s"),
        (95, "about 2 min"),
        (3700, "about 62 min"),
        (9000, "about 2 h 30 min"),
    ],
)
def test_a_duration_is_said_no_finer_than_it_is_known(seconds: float, words: str) -> None:
    assert run_progress.in_words(seconds) == words


@pytest.mark.parametrize(
    ("terminals", "machine", "kind"),
    [
        ("out err", False, Live),
        ("err", False, Lines),
        ("out err", True, Live),
        ("", True, RunProgress),
    ],
)
def test_standard_output_is_a_machine_s_own(terminals: str, machine: bool, kind: type) -> None:
    out, err = (console(terminal=name in terminals.split()) for name in ("out", "err"))
    shown = run_progress.for_console(out, err, machine=machine)
    assert type(shown) is kind
    shown.begin(1, 1, 0)
    shown.end()
    assert not (machine and said(out))
