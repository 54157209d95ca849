"""The runner of exams: dependencies, four outcomes, and points from one table."""

from __future__ import annotations

import gc
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from autograder import exercises
from autograder.examination import points
from autograder.examination.check_context import CheckContext, StudentError, SubjectGone
from autograder.examination.exam import (
    Exam,
    ExamError,
    Failed,
    NotExaminable,
    Part,
    unexamined_verdict,
)
from autograder.examination.verdict import CheckResult, Progress, Verdict
from autograder.examination.verdict_text import Report


@contextmanager
def no_rig(_bench: Any) -> Iterator[list[str]]:
    yield []


class Deadline:
    """Tells what is left in turn; without that, there is always some."""

    def __init__(self, left: Iterator[float] | None) -> None:
        self._left = left

    @property
    def seconds_left(self) -> float:
        return next(self._left) if self._left else 1.0


@pytest.fixture
def exam(monkeypatch: pytest.MonkeyPatch) -> Exam[list[str]]:
    parts = {"visible": {"first": 1.0, "second": 2.0, "third": 4.0}, "hidden": {"last": 8.0}}
    table = {"toy": points.PointsEntry("Toy", "toy", parts, manual={})}
    monkeypatch.setattr(points, "table", lambda: table)
    exam: Exam[list[str]] = Exam("toy", no_rig)

    @exam.check()
    def first(rig: list[str]) -> str:
        """It starts.

        Because it must.
        """
        rig.append("first")
        return "nice"

    @exam.check(needs=("first",))
    def second(rig: list[str]) -> None:
        """It runs."""
        rig.append("second")
        raise Failed(expected="left", actual="right")

    @exam.check(needs=("second",))
    def third(rig: list[str]) -> None:
        """It flies."""
        rig.append("third")

    @exam.check(needs=("first",))
    def last(rig: list[str]) -> None:
        """It ends."""
        raise ZeroDivisionError("of the grader's own")

    return exam


def bench(*, ends: bool = False, left: Iterator[float] | None = None) -> CheckContext:
    def deadline(_seconds: float) -> Deadline:
        return Deadline(left)

    return cast(
        CheckContext,
        SimpleNamespace(
            ends=ends,
            key={},
            deadline=deadline,
            steps=[],
            outside=SimpleNamespace(patience=1.0),
        ),
    )


def sit(exam: Exam[list[str]], *parts: str) -> list[Verdict]:
    return list(exam.sit(map(Part, parts), bench()))


def checks(exam: Exam[list[str]], part: str) -> tuple[CheckResult, ...]:
    (verdict,) = sit(exam, part)
    return verdict.checks


def test_who_follows_is_told_of_each_check_with_the_results_before_it(
    exam: Exam[list[str]],
) -> None:
    told: list[Progress] = []
    (verdict,) = exam.sit([Part("visible")], bench(), told.append)
    assert [(p.title, p.number, p.of) for p in told] == [
        ("It starts.", 1, 3),
        ("It runs.", 2, 3),
        ("It flies.", 3, 3),
    ]
    assert [p.so_far.checks for p in told] == [verdict.checks[:number] for number in range(3)]
    assert Progress.from_data(json.loads(json.dumps(told[2].as_data()))) == told[2]


def test_what_is_up_at_the_end_of_all_processes_is_left_up(exam: Exam[list[str]]) -> None:
    taken_down: list[str] = []

    @contextmanager
    def rig(_bench: Any) -> Iterator[list[str]]:
        try:
            yield []
        finally:
            taken_down.append("rig")

    exam.rig = rig
    for ends, down in ((True, []), (False, ["rig"])):
        list(exam.sit([Part("visible")], bench(ends=ends)))
        gc.collect()
        assert taken_down == down


def test_what_a_check_quotes_is_cut(exam: Exam[list[str]]) -> None:
    exam.checks["second"] = replace(exam.checks["second"], run=quotes)
    actual = checks(exam, "visible")[1].actual
    assert len(actual) < 8000
    assert actual.endswith("x [993000 more]")


def quotes(rig: list[str]) -> None:
    raise Failed(expected="a word", actual="x" * 1_000_000)


def test_a_check_whose_need_failed_is_not_checked(exam: Exam[list[str]]) -> None:
    (verdict,) = sit(exam, "visible")
    assert [check.status for check in verdict.checks] == ["passed", "failed", "not_checked"]
    assert (verdict.score, verdict.max_score) == (1.0, 7.0)
    first, second, third = verdict.checks
    assert (first.title, first.note) == ("It starts.", "nice")
    assert (second.expected, second.actual) == ("left", "right")
    assert "“It runs”" in third.actual


def test_only_what_failed_says_why_it_matters_and_how_to_mend_it(exam: Exam[list[str]]) -> None:
    told = {"rationale": "Because it must.", "hints": ("Look.",), "read": "Chapter 1"}
    for name, check in exam.checks.items():
        exam.checks[name] = replace(check, **told)
    (verdict,) = sit(exam, "visible")
    passed, failed, unchecked = verdict.checks
    (broken,) = checks(exam, "hidden")
    assert broken.status == "grader_error"
    assert (failed.rationale, failed.hints, failed.read) == tuple(told.values())
    for check in (passed, unchecked, broken):
        assert (check.rationale, check.hints, check.read) == ("", (), "")
    for shown in (repr(Report(verdict)), Report(verdict)._repr_html_()):
        assert shown.count("Because it must.") == shown.count("why it matters") == 1
        assert "This needs “It runs” first." in shown


def test_what_needs_a_check_that_could_not_be_made_is_not_at_fault(exam: Exam[list[str]]) -> None:
    def not_here(rig: list[str]) -> None:
        raise NotExaminable("Not on this machine.")

    exam.checks["second"] = replace(exam.checks["second"], run=not_here)
    third = checks(exam, "visible")[2]
    assert third.status == "not_checked"
    assert third.actual == (
        "This needs “It runs”, which could not be examined here. It is not your fault."
    )


def test_what_no_report_tells_of_is_told_with_what_needs_it(exam: Exam[list[str]]) -> None:
    exam.checks["first"] = replace(exam.checks["first"], run=exam.checks["second"].run)
    (last,) = checks(exam, "hidden")
    assert last.status == "not_checked"
    assert last.actual == "This needs “It starts” first. It failed: right"
    _, hidden = sit(exam, "visible", "hidden")  # what a report says is not said again
    assert hidden.checks[0].actual == "This needs “It starts” first."


def test_the_graders_own_fault_is_never_the_students(exam: Exam[list[str]]) -> None:
    (verdict,) = sit(exam, "hidden")
    assert [check.status for check in verdict.checks] == ["grader_error"]
    assert verdict.needs_human
    assert "ZeroDivisionError" in verdict.checks[0].actual


@pytest.mark.parametrize(
    ("module", "status"), [("rclpy.node", "failed"), ("autograder.toy", "grader_error")]
)
def test_a_name_on_the_graph_that_is_no_text_is_whose_name_it_is(
    exam: Exam[list[str]], module: str, status: str
) -> None:
    reader: dict[str, Any] = {"__name__": module}
    exec("def read(rig): b'\\xffoo'.decode()", reader)
    exam.checks["last"] = replace(exam.checks["last"], run=reader["read"])
    (check,) = checks(exam, "hidden")
    assert check.status == status
    told = r"A name on the ROS graph is no text: b'\xffoo'."
    assert check.actual.startswith(told) == (status == "failed")


def test_a_subject_that_ends_fails_the_check(exam: Exam[list[str]]) -> None:
    @exam.check()
    def gone(rig: list[str]) -> None:
        """It stays."""
        raise SubjectGone("It left.")

    points.table()["toy"].parts["late"] = {"gone": 1.0}
    (check,) = checks(exam, "late")
    assert (check.status, check.actual) == ("failed", "It left.")


@pytest.mark.parametrize("told", [False, True])
def test_what_comes_after_a_subject_is_gone_is_not_at_fault(
    exam: Exam[list[str]], told: bool
) -> None:
    @exam.check()
    def loses(rig: list[str]) -> None:
        """It comes back."""
        try:
            raise SubjectGone("It left.")
        except SubjectGone as gone:
            if not told:
                raise
            raise Failed(expected="It comes back.", actual="It did not.") from gone

    @exam.check()
    def later(rig: list[str]) -> None:
        """It stays."""
        raise SubjectGone("It left.")

    points.table()["toy"].parts["late"] = {"loses": 1.0, "later": 1.0}
    first, second = checks(exam, "late")
    assert (first.status, second.status) == ("failed", "not_checked")
    assert "“It comes back”" in second.actual


def test_what_comes_after_too_long_a_time_is_not_checked_and_nobody_elses_fault(
    exam: Exam[list[str]],
) -> None:
    late = bench(left=iter([1.0, 0.0, 0.0, 0.0]))
    (verdict,) = exam.sit([Part("visible")], late)
    assert [check.status for check in verdict.checks] == ["passed", "not_checked", "not_checked"]
    assert "took 180 s in all" in verdict.checks[1].actual
    assert "This needs “It runs” first." in verdict.checks[2].actual


def test_each_check_runs_once_a_sitting(exam: Exam[list[str]]) -> None:
    seen: list[str] = []

    @contextmanager
    def rig(_bench: CheckContext) -> Iterator[list[str]]:
        yield seen

    exam.rig = rig
    exam.checks["last"] = replace(exam.checks["last"], run=lambda rig: rig.append("last"))
    sit(exam, "visible", "hidden")
    assert seen == ["first", "second", "last"]


def test_an_exam_may_have_a_fresh_rig_for_each_part(exam: Exam[list[str]]) -> None:
    """What passed is run again in it if something needs it, what failed is not."""
    rigs: list[list[str]] = []

    @contextmanager
    def rig(_bench: CheckContext) -> Iterator[list[str]]:
        rigs.append([])
        yield rigs[-1]

    exam.rig, exam.fresh_parts = rig, True
    exam.checks["last"] = replace(exam.checks["last"], run=lambda rig: rig.append("last"))
    sit(exam, "visible", "hidden")
    assert rigs == [["first", "second"], ["first", "last"]]


def test_unexamined_parts_keep_their_points_out_of_reach(exam: Exam[list[str]]) -> None:
    verdict = unexamined_verdict(exam, "visible", "the process ended")
    assert (verdict.score, verdict.max_score) == (0.0, 7.0)
    assert {check.actual for check in verdict.checks} == {"the process ended"}


def test_an_unknown_part_names_those_there_are(exam: Exam[list[str]]) -> None:
    with pytest.raises(ExamError, match=r"no part 'secret': there are visible, hidden"):
        exam.part("secret")


def test_an_unknown_need_is_refused(exam: Exam[list[str]]) -> None:
    with pytest.raises(ExamError, match="no check 'nothing'"):
        exam.check(needs=("nothing",))


def test_an_unknown_exam_names_those_there_are() -> None:
    with pytest.raises(ExamError, match=r"no exam 'qso': there are .*qos.* Did you mean 'qos'"):
        exercises.load_exam("qso")


@pytest.mark.parametrize("name", exercises.exercise_names())
def test_every_exam_and_the_table_of_points_agree(name: str) -> None:
    exam = exercises.load_exam(name)
    worth = [check for part in points.table()[name].parts for check in exam.part(part)]
    assert sorted(worth) == sorted(exam.checks), "each check has points in exactly one part"
    for check in exam.checks.values():
        assert check.rationale, f"{check.name} must say why it matters on a robot"
        assert len(check.hints) <= 3
        assert check.read


@pytest.mark.parametrize(
    "error", [StudentError("KeyError: 'x'", "line 3\n"), SubjectGone("It ended.")]
)
def test_what_the_students_code_raises_in_the_rig_fails_every_check_without_needs(
    exam: Exam[list[str]], error: Exception
) -> None:
    @contextmanager
    def rig(_bench: Any) -> Iterator[list[str]]:
        raise error
        yield []

    exam.rig = rig
    results = {check.name: check for check in checks(exam, "visible")}
    assert {name: check.status for name, check in results.items()} == {
        "first": "failed", "second": "not_checked", "third": "not_checked"
    }  # fmt: skip
    assert str(error) in results["first"].actual


def test_an_error_of_the_students_code_in_a_check_is_not_the_graders(
    exam: Exam[list[str]],
) -> None:
    @exam.check()
    def last(rig: list[str]) -> None:
        """It ends."""
        raise StudentError("KeyError: 'x'", "  line 3, in tick\n")

    check = checks(exam, "hidden")[0]
    assert check.status == "failed"
    assert check.actual == "It raised KeyError: 'x'. It happened here:\n  line 3, in tick\n"


@pytest.mark.parametrize(
    ("fault", "status"),
    [
        (None, "passed"),
        (Failed(expected="left", actual="right"), "not_checked"),
        (NotExaminable("It was not seen in time."), "not_checked"),
    ],
)
def test_what_builds_on_a_check_that_failed_is_made_all_the_same_and_told_once(
    exam: Exam[list[str]], fault: Exception | None, status: str
) -> None:
    exam.checks["third"] = replace(exam.checks["third"], needs=(), builds_on=("second",))

    def fly(_rig: list[str]) -> None:
        if fault:
            raise fault

    exam.checks["third"] = replace(exam.checks["third"], run=fly)
    _, second, third = checks(exam, "visible")
    assert (second.status, third.status) == ("failed", status)
    assert third.points == (4.0 if status == "passed" else 0.0)
    assert third.actual == ("This needs “It runs” first." if fault else "")


def test_a_check_that_builds_on_a_failed_one_is_made_with_less_patience(
    exam: Exam[list[str]],
) -> None:
    examiner, had = bench(), dict[str, float]()

    def note(name: str) -> Callable[[list[str]], None]:
        return lambda _rig: had.update({name: examiner.outside.patience})

    exam.checks["first"] = replace(exam.checks["first"], run=note("first"))
    exam.checks["third"] = replace(
        exam.checks["third"], needs=(), builds_on=("second",), run=note("third")
    )
    list(exam.sit([Part("visible")], examiner))
    assert had["first"] == 1.0
    assert 0 < had["third"] < 1.0
