"""What an exam found: versioned JSON, one result a check.

Five outcomes are kept apart, because they mean different things to a student and an instructor:
a check *passed*, *failed* (the behaviour was seen and was wrong), was *not checked* (something it
needs had failed), was *not examined* (this machine cannot: a person decides), or ended in a
*grader error* (our fault: never the student's). `autograder.examination.exam` decides which it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

from autograder.examination.pictures.picture import Picture, picture_from_data
from course.errors import CourseError

VERSION = 1

MAX_TEXT, MOST_TEXTS = 10_000, 1000
"""Characters of a text that an examiner may send, and how many texts."""

Status = Literal["passed", "failed", "not_checked", "not_examined", "grader_error"]
STATUSES: tuple[Status, ...] = get_args(Status)


class VerdictError(CourseError):
    """A verdict that cannot be read: damaged, too large, or of another version."""


@dataclass(frozen=True)
class CheckResult:
    """The outcome of one check.

    ``points`` is what was earned of ``max_points``. ``expected`` and ``actual`` are what was needed
    and what was observed; ``actual`` of a check that was not made says why not. ``rationale`` says
    why the behaviour matters on a robot, ``hints`` lead to the mend step by step, ``read`` names
    where to read more: only of a check that failed, as what was not examined gives nothing away.
    ``note`` is a remark on a pass.
    ``steps`` are what the examiner did and saw: for the author of the exam, not for students.
    ``picture`` shows a sequence in time or over rounds that was wrong.
    """

    name: str
    title: str
    status: Status
    points: float
    max_points: float
    rationale: str = ""
    expected: str = ""
    actual: str = ""
    hints: tuple[str, ...] = ()
    read: str = ""
    note: str = ""
    steps: tuple[str, ...] = ()
    picture: Picture | None = None

    @property
    def passed(self) -> bool:
        """Whether the behaviour was seen and right."""
        return self.status == "passed"

    def all_texts(self) -> Iterator[str]:
        """Yield all that it says in words."""
        yield from (self.name, self.title, self.rationale, self.expected, self.actual)
        yield from (*self.hints, self.read, self.note, *self.steps)


@dataclass(frozen=True)
class Verdict:
    """The results of one part of one exam on one subject.

    ``seed`` is what the examination's numbers were drawn from; 0 if it was not sat.
    """

    exam: str
    part: str
    checks: tuple[CheckResult, ...]
    notes: tuple[str, ...] = ()
    seed: int = 0
    version: int = field(default=VERSION)

    @property
    def score(self) -> float:
        """Points earned, rounded to the hundredth so that sums print as people write them."""
        return round(sum(check.points for check in self.checks), 2)

    @property
    def max_score(self) -> float:
        """Points there are to earn."""
        return round(sum(check.max_points for check in self.checks), 2)

    @property
    def needs_human(self) -> bool:
        """Whether a check was left to a person: it could not be examined, or the grader failed."""
        return self.has_grader_error or any(check.status == "not_examined" for check in self.checks)

    @property
    def has_grader_error(self) -> bool:
        """Whether the grader itself failed somewhere: another try may well succeed."""
        return any(check.status == "grader_error" for check in self.checks)

    @property
    def unexamined_points(self) -> float:
        """Points of the checks that could not be examined on this machine."""
        return sum(check.max_points for check in self.checks if check.status == "not_examined")

    def as_data(self) -> dict[str, Any]:
        """Return the verdict as JSON knows it."""
        return asdict(self)

    def require_asked(self, exam: str, part: str, points: Mapping[str, float]) -> None:
        """Require that it answers what was asked, with texts that can be shown.

        An examiner takes in what a stranger's program sends, so its verdict is data, too.

        Args:
            exam: the exam that was asked for.
            part: its part.
            points: {check: points} of that part.

        Raises:
            VerdictError: it is about something else, or its texts are too long.
        """
        worth = {check.name: check.max_points for check in self.checks}
        if (self.exam, self.part) != (exam, part) or len(self.checks) != len(worth):
            raise VerdictError("it is not about what was asked")
        if worth != dict(points):
            raise VerdictError("its checks and their points are not those of the exam")
        if any(check.points not in (0.0, check.max_points) for check in self.checks):
            raise VerdictError("a check has a part of its points")
        if any(check.points and check.status != "passed" for check in self.checks):
            raise VerdictError("a check has points and did not pass")
        texts = [*self.notes, *(text for check in self.checks for text in check.all_texts())]
        if any(len(text) > MAX_TEXT for text in texts) or len(texts) > MOST_TEXTS:
            raise VerdictError("it says more than a verdict does")

    @classmethod
    def from_data(cls, data: Any) -> Verdict:
        """Read what `as_data` returned, after a way through JSON.

        Raises:
            VerdictError: it is no verdict of this version.
        """
        try:
            if data["version"] != VERSION:
                raise VerdictError(
                    f"A verdict of version {data['version']} cannot be read by this release, which "
                    f"reads version {VERSION}: grade the submission again."
                )
            checks = tuple(_check_from_data(item) for item in data["checks"])
            notes = tuple(str(note) for note in data["notes"])
            return cls(str(data["exam"]), str(data["part"]), checks, notes, int(data["seed"]))
        except (ValueError, KeyError, TypeError, RecursionError, OverflowError) as error:
            raise VerdictError(
                f"A verdict is damaged ({type(error).__name__}: {error}): grade it again."
            ) from error


@dataclass(frozen=True)
class Progress:
    """How far the examination of a part is: the results so far, and the check that is made now.

    ``title`` is that check's; it is ``number`` in the part, of so many.
    """

    so_far: Verdict
    title: str
    number: int
    of: int

    def as_data(self) -> dict[str, Any]:
        """Return it as JSON knows it."""
        return asdict(self)

    @classmethod
    def from_data(cls, data: Any) -> Progress:
        """Read what `as_data` returned, after a way through JSON.

        Raises:
            ValueError, KeyError, TypeError, VerdictError: it is something else.
        """
        so_far = Verdict.from_data(data["so_far"])
        return cls(so_far, str(data["title"])[:MAX_TEXT], int(data["number"]), int(data["of"]))


def _check_from_data(item: dict[str, Any]) -> CheckResult:
    if item["status"] not in STATUSES:
        raise ValueError(f"unknown status {item['status']!r}")
    points, max_points = float(item["points"]), float(item["max_points"])
    if not 0 <= points <= max_points:
        raise ValueError(f"{points} points of {max_points}")
    hints, steps = tuple(item["hints"]), tuple(item.get("steps", ()))
    result = CheckResult(
        **{
            **item, "points": points, "max_points": max_points, "hints": hints, "steps": steps,
            "picture": picture_from_data(item.get("picture")),  # older verdicts have none
        }
    )  # fmt: skip
    if not all(isinstance(text, str) for text in result.all_texts()):
        raise TypeError("something else where a text belongs")
    return result
