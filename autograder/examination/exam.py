"""Exams: checks that depend on each other, run in order by the examiner.

A check is a function that gets the exam's rig and returns normally when the behaviour is right (a
string it returns becomes a remark in the report) or raises `Failed`. The first line of its
docstring is the title that a student reads; the rest says why it matters on a robot.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass, field, replace
from types import MappingProxyType, TracebackType
from typing import Any, Generic, NamedTuple, Protocol, TypeVar, runtime_checkable

from autograder.examination import not_checked
from autograder.examination import points as points_table
from autograder.examination.check_context import CheckContext, StudentError, SubjectGone
from autograder.examination.pictures.picture import Picture
from autograder.examination.plain_programs import SlowProgramError
from autograder.examination.verdict import CheckResult, Progress, Status, Verdict
from autograder.processes.fair_deadline import FairDeadline
from autograder.util import exercise_folders
from course.errors import CourseError
from course.util.close_matches import did_you_mean

RigT = TypeVar("RigT")


MAX_TEXT_CHARS = 7000
"""Characters of a text in a verdict: of an error in a student's code, 6000 are told."""

SITTING_S = 180.0
"""Seconds in which checks of one sitting begin: a twelfth is enough for all of them, as a rule.

A node that takes its time for each answer, and yet gives it, would keep the examiner for longer
than it may take (`autograder.running.start.EXAM_TIMEOUT_S`), and that would be the grader's fault.
"""

LEFT_PATIENCE = 0.125
"""Share of the usual patience that a check has where one has failed on which it builds: it will
hardly pass, and a stub has many of them."""

MAX_NAME_BYTES = 200
"""Bytes that are shown of a name that is no text."""


class ExamError(CourseError):
    """An exam that does not exist, or whose definition does not hold together."""


class Failed(Exception):  # noqa: N818 - it is a finding, not a fault
    """The behaviour was observed and was not what is needed.

    ``expected`` and ``actual`` are one sentence each, in the terms of the exercise. ``picture``
    shows what was seen over time: see `autograder.observe.findings.with_picture`.
    """

    def __init__(self, *, expected: str, actual: str, picture: Picture | None = None) -> None:
        """Record what was needed and what was seen."""
        super().__init__(f"expected: {expected} observed: {actual}")
        self.expected = expected
        self.actual = actual
        self.picture = picture


class NotExaminable(Exception):  # noqa: N818 - a limit of this machine, not a fault
    """The check cannot be made on this machine; the message says why, for the student's grade."""


class Part(NamedTuple):
    """A part of an exam: its name, and the answer key that its cell carries, if any."""

    name: str
    key: Mapping[str, Any] = MappingProxyType({})


@runtime_checkable
class FreshForEachCheck(Protocol):
    """A rig that gives each check something of its own, such as a fresh node."""

    def for_check(self) -> AbstractContextManager[Any]:
        """Give a check what it takes, for as long as it runs; it raises as a check does."""


@dataclass(frozen=True)
class Check(Generic[RigT]):
    """One check: what it examines, what it needs, and how it helps."""

    name: str
    title: str
    rationale: str
    run: Callable[[RigT], str | None]
    needs: tuple[str, ...]
    builds_on: tuple[str, ...]
    hints: tuple[str, ...]
    read: str

    @property
    def rests_on(self) -> tuple[str, ...]:
        """The checks that are made before this one: those that it needs, or builds on."""
        return (*self.needs, *self.builds_on)

    @property
    def is_root(self) -> bool:
        """Whether it is made whatever else has failed."""
        return not self.rests_on


@dataclass
class Exam(Generic[RigT]):
    """The checks of one exercise, and the rig they run on.

    ``rig`` is a context manager around the check context: what it gives is what every check takes,
    or what it has for it (`FreshForEachCheck`).
    With ``fresh_parts`` each part has one of its own, for checks that leave their mark on what the
    nodes do later: what failed in an earlier part is not tried again there, what passed is.
    ``read`` is where to read on about a check that does not say so itself.
    """

    name: str
    rig: Callable[[CheckContext], AbstractContextManager[Any]]
    fresh_parts: bool = False
    read: str = ""
    checks: dict[str, Check[RigT]] = field(default_factory=dict)
    _left_up: ExitStack | None = field(default=None, init=False, repr=False)
    """What a check context that ends leaves up: it would be taken down if nobody referred to it."""

    def check(
        self,
        *,
        needs: Sequence[str] = (),
        builds_on: Sequence[str] = (),
        hints: Sequence[str] = (),
        read: str = "",
    ) -> Callable[[Callable[[RigT], str | None]], Callable[[RigT], str | None]]:
        """Register a check under its function's name.

        Args:
            needs: checks without which this one can show nothing: it is not made if one of them
                has not passed. So it is where what it looks for would be right of a node that does
                nothing at all.
            builds_on: checks whose mistake may make this one fail, too. It is made all the same,
                and what is right counts. Where it fails and one of them has not passed, it counts
                as not checked: one mistake is told once.
            hints: from a nudge to nearly the answer; shown one by one.
            read: where to read on (a section of the chapter, a page of the ROS 2 docs).
        """
        unknown = [name for name in (*needs, *builds_on) if name not in self.checks]
        if unknown:
            raise ExamError(f"Exam '{self.name}' has no check {unknown[0]!r} to depend on.")

        def register(run: Callable[[RigT], str | None]) -> Callable[[RigT], str | None]:
            title, _, rationale = inspect.cleandoc(run.__doc__ or run.__name__).partition("\n")
            self.checks[run.__name__] = Check(
                run.__name__, title.strip(), " ".join(rationale.split()), run,
                tuple(needs), tuple(builds_on), tuple(hints), read or self.read,
            )  # fmt: skip
            return run

        return register

    def part(self, part: str) -> dict[str, float]:
        """Return {check: points} of a part, in the order of ``points.toml``.

        Raises:
            ExamError: no such part, or the table of points and the checks disagree.
        """
        table = points_table.of_part(self.name, part)
        if not table:
            entry = points_table.table().get(self.name)
            parts = ", ".join(entry.parts) if entry else ""
            raise ExamError(
                f"Exam '{self.name}' has no part '{part}': there are {parts or 'none'}."
            )
        for name in table:
            if name not in self.checks:
                raise ExamError(
                    f"points.toml names a check '{name}' that the exam '{self.name}' lacks."
                    f"{did_you_mean(name, self.checks)} Give one of them the other's name."
                )
        return table

    def require_points(self) -> None:
        """Require that the exercise's points name each check once, and nothing else.

        Raises:
            ExamError: they do not.
        """
        parts = points_table.table()[self.name].parts
        worth = [check for part in parts for check in self.part(part)]
        file = exercise_folders.exercise_file(self.name, exercise_folders.POINTS)
        for name in self.checks:
            if (times := worth.count(name)) != 1:
                says = "has no points" if times == 0 else f"has points {times} times"
                raise ExamError(
                    f"The check '{name}' of exam '{self.name}' {says}: name it once in {file}."
                )

    def sit(
        self,
        parts: Iterable[Part],
        bench: CheckContext,
        follow: Callable[[Progress], object] = lambda _: None,
    ) -> Iterator[Verdict]:
        """Run the checks of each part, and what they need, each once; yield a verdict a part.

        ``follow`` is told of each check before it is made, with the results so far.

        All parts are one examination of the same running nodes, but for ``fresh_parts``. A check
        that is needed in another part earns nothing there: its points are in its own. One that the
        untouched notebook passes has no points at all: see ``points.toml``.
        """
        done: dict[str, CheckResult] = {}
        gone: list[CheckResult] = []
        told: set[str] = set()
        deadline = bench.deadline(SITTING_S)
        with ExitStack() as stack:
            rig: Any = None
            for number, part in enumerate(parts):
                if number == 0 or self.fresh_parts:
                    stack.close()
                    done = {n: result for n, result in done.items() if result.status == "failed"}
                    try:
                        rig = stack.enter_context(self.rig(bench))
                    except (StudentError, SubjectGone) as error:
                        roots = [check for check in self.checks.values() if check.is_root]
                        done.update((check.name, _student_failure(check, error)) for check in roots)
                        rig = None
                table = self.part(part.name)
                bench.key = part.key
                told.update(table)
                so_far = Verdict(self.name, part.name, ())
                for number, name in enumerate(table, 1):
                    follow(Progress(so_far, self.checks[name].title, number, len(table)))
                    result = self._examine_check(name, rig, bench, done, gone, deadline)
                    result = _with_points(self._with_reason(result, done, told), table[name])
                    so_far = replace(so_far, checks=(*so_far.checks, result))
                yield so_far
            if bench.ends:
                self._left_up = stack.pop_all()

    def _with_reason(
        self, result: CheckResult, done: dict[str, CheckResult], told: set[str]
    ) -> CheckResult:
        """Say why what a check needs failed, where no report so far says so."""
        needs = [done[need] for need in self.checks[result.name].rests_on if need in done]
        hidden = [need for need in needs if need.status == "failed" and need.name not in told]
        if result.status != "not_checked" or not hidden:
            return result
        return replace(result, actual=f"{result.actual} It failed: {hidden[0].actual}")

    def _examine_check(
        self,
        name: str,
        rig: Any,
        bench: CheckContext,
        done: dict[str, CheckResult],
        gone: list[CheckResult],
        deadline: FairDeadline,
    ) -> CheckResult:
        if name not in done:
            check = self.checks[name]
            for need in check.rests_on:
                self._examine_check(need, rig, bench, done, gone, deadline)
            missing = [done[need] for need in check.needs if not done[need].passed]
            at_fault = [done[need] for need in check.builds_on if not done[need].passed]
            if rig is None:
                missing = missing or at_fault
            if missing:
                done[name] = _not_checked(check, not_checked.needed_check(missing[0]))
            elif not deadline.seconds_left:
                done[name] = _not_checked(check, not_checked.time_was_up(SITTING_S))
            else:
                assert rig is not None  # without one, what needs nothing has failed already
                bench.steps.clear()
                bench.outside.patience = LEFT_PATIENCE if at_fault else 1.0
                result = _run_check(check, rig, gone)
                if result.status in ("failed", "not_examined") and at_fault:
                    result = _not_checked(check, not_checked.needed_check(at_fault[0]))
                done[name] = replace(result, steps=tuple(bench.steps))
        return done[name]


def _with_points(result: CheckResult, points: float) -> CheckResult:
    # A check may quote what a student's code said of itself, at any length.
    expected, actual, note = (
        _shorten_text(t) for t in (result.expected, result.actual, result.note)
    )
    earned = points if result.passed else 0.0
    return replace(
        result, points=earned, max_points=points, expected=expected, actual=actual, note=note
    )


def _shorten_text(text: str) -> str:
    return (
        text
        if len(text) <= MAX_TEXT_CHARS
        else f"{text[:MAX_TEXT_CHARS]} [{len(text) - MAX_TEXT_CHARS} more]"
    )


def _result_of(check: Check[RigT], status: Status) -> CheckResult:
    """Return a result without what leads to the mend: that belongs to a check that failed."""
    return CheckResult(check.name, check.title, status, 0.0, 0.0)


def _not_checked(check: Check[RigT], reason: str) -> CheckResult:
    return replace(_result_of(check, "not_checked"), actual=reason)


def _run_check(check: Check[RigT], rig: Any, gone: list[CheckResult]) -> CheckResult:
    """Run a check; add its result to ``gone`` if it lost the subject.

    What comes after a check that did is not at fault.
    """
    try:
        with rig.for_check() if isinstance(rig, FreshForEachCheck) else nullcontext(rig) as given:
            note = check.run(given) or ""
    except Failed as failed:
        result = replace(
            _failed_result(check, failed.expected, failed.actual), picture=failed.picture
        )
        if isinstance(failed.__cause__, SubjectGone):
            gone.append(result)
        return result
    except StudentError as error:
        return _student_failure(check, error)
    except SubjectGone as error:
        if gone:
            return _not_checked(check, not_checked.program_was_gone(gone[0]))
        gone.append(_student_failure(check, error))
        return gone[0]
    except (NotExaminable, SlowProgramError) as reason:
        return replace(_result_of(check, "not_examined"), actual=str(reason))
    except Exception as error:  # noqa: BLE001 - whatever else goes wrong in here is our fault
        if isinstance(error, UnicodeDecodeError) and _read_by_ros(error):
            return _failed_result(check, *_no_text(error))
        return replace(
            _result_of(check, "grader_error"),
            actual=f"The grader itself failed ({type(error).__name__}: {error}, in "
            f"{_describe_place(error)}). This is not your fault; after a hand-in a person looks at "
            "it.",
        )
    return replace(_result_of(check, "passed"), note=note)


def _student_failure(check: Check[RigT], error: StudentError | SubjectGone) -> CheckResult:
    """Return the failure of a check that the student's own code or process has cut short."""
    if isinstance(error, StudentError):
        expected, actual = (
            "Your code does what it is asked for without an error.",
            error.feedback_text,
        )
    else:
        expected = "Your program keeps running and answering while it is examined."
        actual = str(error)
    return _failed_result(check, expected, actual)


def _failed_result(check: Check[RigT], expected: str, actual: str) -> CheckResult:
    return replace(
        _result_of(check, "failed"), expected=expected, actual=actual,
        rationale=check.rationale, hints=check.hints, read=check.read,
    )  # fmt: skip


def _read_by_ros(error: BaseException) -> bool:
    """Whether rclpy raised it: its messages may quote what other processes have sent."""
    place = _innermost_frame(error)
    return place is not None and place.tb_frame.f_globals.get("__name__", "").startswith("rclpy.")


def _no_text(error: UnicodeDecodeError) -> tuple[str, str]:
    """Return what is needed of a name on the ROS graph, and what one was that is no text."""
    return (
        "The names and types on the ROS graph are text.",
        f"A name on the ROS graph is no text: {error.object[:MAX_NAME_BYTES]!r}. Did something in "
        "the notebook make a node, a topic or a type of that name?",
    )


def _innermost_frame(error: BaseException) -> TracebackType | None:
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace


def _describe_place(error: BaseException) -> str:
    trace = _innermost_frame(error)
    return f"{trace.tb_frame.f_code.co_name}, line {trace.tb_lineno}" if trace else "unknown"


def unexamined_verdict(
    exam: Exam[RigT], part: str, reason: str, status: Status = "not_checked"
) -> Verdict:
    """Return the verdict of a part that could not be sat.

    ``status`` says whose fault it is: ``"not_checked"`` the subject's, ``"grader_error"`` ours.
    """
    table = exam.part(part)
    results = (
        replace(_result_of(exam.checks[name], status), actual=reason, max_points=table[name])
        for name in table
    )
    return Verdict(exam.name, part, tuple(results))
