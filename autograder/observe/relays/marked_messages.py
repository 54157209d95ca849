"""Marks by which messages are known again, whatever is done to their headers."""

from __future__ import annotations

import re
import secrets
from collections.abc import Iterable
from typing import Any, NamedTuple, Protocol


class Mark(NamedTuple):
    """Three numbers that a message bears: one of this run, and two that nobody can foresee.

    Whoever could tell from them what comes next, or what came before, could make it up. Each is a
    number that a float32 holds exactly.

    Example:
        >>> mark = Mark(7, 12, 345)
        >>> str(mark), Mark.from_text(str(mark)) == mark, Mark.from_text("7/12")
        ('00000007/0012/00345', True, None)
        >>> Mark.from_numbers([7.0, 12.0, 345.2]) == mark, Mark.from_numbers([float("nan")] * 3)
        (True, None)
    """

    run: int
    first: int
    second: int

    @classmethod
    def draw(cls, run: int) -> Mark:
        """Return a new one."""
        return cls(run, secrets.randbelow(10**4), secrets.randbelow(10**5))

    def __str__(self) -> str:
        """Return it as text of 19 characters.

        After a frame id of that length DDS needs no bytes to fill a gap before what comes next, of
        which nobody knows what they hold: so messages that are equal are equal when serialized.
        """
        return f"{self.run:08}/{self.first:04}/{self.second:05}"

    @classmethod
    def from_text(cls, text: str) -> Mark | None:
        """Return the mark that ``text`` is, or None."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})/(\d{1,9})", text)
        return cls(*map(int, found.groups())) if found else None

    @classmethod
    def from_numbers(cls, numbers: Iterable[float]) -> Mark | None:
        """Return the mark that three numbers are, or None."""
        return cls.from_text("/".join(f"{number:.0f}" for number in numbers))


class MarkedMessages(Protocol):
    """A kind of message that nodes relay, and where it bears its mark."""

    @property
    def noun(self) -> str:
        """What one is called in sentences."""

    @property
    def source(self) -> str:
        """The topic that they come in on, which the examiner plays."""

    @property
    def topic(self) -> str:
        """The topic that the first of the student's nodes relays them to."""

    @property
    def output(self) -> str:
        """The topic on which the last of the student's nodes hands on what it acts on."""

    @property
    def type(self) -> Any:
        """The message's class."""

    @property
    def rate_hz(self) -> float:
        """How many come in each second."""

    @property
    def most(self) -> int:
        """How many of the last ones a consumer may go on with after a pause."""

    @property
    def ahead(self) -> int:
        """How many may be on their way into a node."""

    @property
    def probes(self) -> int:
        """How many in a row show that they get through: one alone may be taken for an outlier."""

    def make_message(self, mark: Mark, stamp_ns: int, number: int) -> Any:
        """Return the message of a number, which bears ``mark`` and the time ``stamp_ns``."""

    def find_marks(self, message: Any) -> Iterable[Mark | None]:
        """Return what stands in each place where a mark may stand; what was cleaned may, too."""

    def is_same(self, message: Any, other: Any) -> bool:
        """Return whether two are the same, but for the header, which a node may set."""
