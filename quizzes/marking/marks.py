"""A mark: what one answer earned, and what is said about it."""

from __future__ import annotations

from dataclasses import dataclass

from quizzes.attempts.quiz_answers import Answer
from quizzes.bank.selection import PaperItem


@dataclass(frozen=True)
class Remark:
    """Something to tell about an answer: Markdown, and Python that shows it on live nodes.

    ``feedback`` may be empty in a closed quiz. ``letter`` is the option that it is about, or "" if
    it is about the whole answer.
    """

    right: bool
    feedback: str
    letter: str = ""
    misconception: str | None = None
    show: str | None = None


@dataclass(frozen=True)
class Mark:
    """What one answer earned: ``credit`` from 0 to 1, and why."""

    item: PaperItem
    answer: Answer
    credit: float
    remarks: tuple[Remark, ...]

    @property
    def is_right(self) -> bool:
        """Whether the answer is fully right."""
        return self.credit == 1.0

    @property
    def misconceptions(self) -> tuple[str, ...]:
        """The ids of the beliefs that the answer shows, each once."""
        return tuple(dict.fromkeys(r.misconception for r in self.remarks if r.misconception))
