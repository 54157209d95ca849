"""A span of the node's time, and what came in it: rates, silence, counts without gaps."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NoReturn

from autograder.examination.exam import Failed
from autograder.examination.pictures.picture import Timeline
from autograder.observe.examiner.examiner_end import Heard
from autograder.observe.findings import rate_picture, with_picture
from autograder.observe.nouns import Topic
from autograder.observe.phrases import capitalize_first

PACES = (0.6, 1.5)
"""Seconds of wall time in which a second of the node's time passes, where a rate is taken again.

A thread that looks at the clock now and then loses what it sees too late, where time jumps. Neither
pace is that of the wall clock, by which a timer would have the right rate at just one of them.
"""
STANDSTILL_S = 2.5
"""Seconds of wall time in which a timer on the wall clock goes off, if it has 0.4 Hz or more."""


@dataclass(frozen=True)
class Rate:
    """How many messages came, how many were to come, and the most that came at once."""

    came: int
    wanted: float
    leeway: float
    most_at_once: int
    allowed_at_once: int

    @property
    def is_right(self) -> bool:
        """Whether about as many came, one by one."""
        return self.fault == ""

    @property
    def fault(self) -> str:
        """What is wrong with it: "number", "burst" or nothing."""
        if abs(self.came - self.wanted) > max(1.0, self.leeway * self.wanted):
            return "number"
        return "burst" if self.most_at_once > self.allowed_at_once else ""


def rate_of(
    times_s: Sequence[float], seconds: float, stride_s: float, hz: float, leeway: float
) -> Rate:
    """Return the rate of what came at ``times_s``, each known to a stride.

    Args:
        times_s: when, in s of the node's time.
        seconds: of what length the span was.
        stride_s: in what strides time went on.
        hz: what it is to be.
        leeway: part of the number that may be missing or too many; one always may.
    """
    most = max(Counter(times_s).values(), default=0)
    # One of the stride before may have been on its way.
    allowed = math.ceil(hz * stride_s) + 2
    return Rate(len(times_s), hz * seconds, leeway, most, allowed)


def first_gap(values: Sequence[int], step: int = 1) -> tuple[int, int] | None:
    """Return the first two neighbours of a count that are not ``step`` apart, if there are any."""
    for before, after in pairwise(values):
        if after != before + step:
            return before, after
    return None


class Span:
    """What came while the node's time went on, as `ObservedNode.advance` returns it."""

    def __init__(
        self, when: str, begin_s: float, end_s: float, stride_s: float,
        heard: Mapping[str, list[Heard]], again: Callable[[float], Span] | None,
        note: Callable[[], str],
        stands_still: Callable[[Topic, float], bool],
    ) -> None:  # fmt: skip
        """Keep it.

        Args:
            when: what the span is, to begin a sentence with; empty if it is nothing special.
            begin_s: its begin in s of the node's time; ``end_s`` its end.
            stride_s: in what strides time went on.
            heard: what came, by the names of the topics.
            again: goes on for as long once more, at a pace in s of wall time a second; None if what
                went on in it is over.
            note: what a callback raised, as a sentence to add.
            stands_still: whether nothing comes while time stands still, for so many s.
        """
        self.when, self.begin_s, self.end_s, self.stride_s = when, begin_s, end_s, stride_s
        self._heard, self._again, self._note = heard, again, note
        self._stands_still = stands_still

    @property
    def seconds(self) -> float:
        """Its length in s of the node's time."""
        return self.end_s - self.begin_s

    def heard(self, topic: Topic) -> list[Heard]:
        """Return what came on a topic, each with its time."""
        return list(self._heard.get(topic.name, ()))

    def values(self, topic: Topic) -> list[Any]:
        """Return what came on a topic, as `Topic.value` has it."""
        return [heard.value for heard in self.heard(topic)]

    def last_value(self, topic: Topic) -> Any:
        """Return what came last on a topic, as `Topic.value` has it.

        Raises:
            Failed: nothing came.
        """
        if not (values := self.values(topic)):
            raise Failed(
                expected=self._sentence(f"something comes on {topic}."),
                actual=f"In {self.seconds:g} s of the node's time nothing came.{self._note()}",
            )
        return values[-1]

    def require_rate(self, topic: Topic, hz: float, leeway: float = 0.1) -> None:
        """Require about ``hz`` messages a second on a topic, one by one, by the node's clock.

        A rate that is not right is taken again, twice, as slowly as time passes on a robot, unless
        it was taken ``once``: what it is then is what counts.

        Args:
            topic: one that the node publishes on.
            hz: messages a second.
            leeway: part of the number that may be missing or too many; one always may.

        Raises:
            Failed: it is another one.
        """
        rate = self._rate(topic, hz, leeway)
        span = self
        for pace in PACES:
            if rate.is_right or self._again is None:
                break
            span = self._again(pace)
            rate = span._rate(topic, hz, leeway)
        if rate.is_right:
            return
        with with_picture(lambda: span._rate_picture(topic, hz)):
            span._refuse_rate(topic, rate, hz)

    def _refuse_rate(self, topic: Topic, rate: Rate, hz: float) -> NoReturn:
        each = "a second" if hz >= 1 else f"every {1 / hz:g} s"
        number = f"{hz:g} messages" if hz > 1 else "a message"
        expected = self._sentence(f"{number} {each} {'come' if hz > 1 else 'comes'} on {topic}.")
        if rate.fault == "burst":
            raise Failed(
                expected=expected,
                actual=f"There were as many, but up to {rate.most_at_once} came at once."
                + self._note(),
            )
        raise Failed(
            expected=expected,
            actual=f"In {self.seconds:g} s of the node's time {_came(rate.came)}."
            + self._note()
            + self._clock_hint(topic, rate),
        )

    def _rate_picture(self, topic: Topic, hz: float) -> Timeline:
        times_s = [heard.at_s - self.begin_s for heard in self.heard(topic)]
        return rate_picture(f"Messages on {topic}, by the node's clock", times_s, hz, self.seconds)

    def require_silence(self, topic: Topic) -> None:
        """Require that nothing comes on a topic.

        Raises:
            Failed: something did.
        """
        if came := self.heard(topic):
            raise Failed(
                expected=self._sentence(f"nothing comes on {topic}."),
                actual=f"In {self.seconds:g} s of the node's time {_came(len(came))}."
                + self._note(),
            )

    def require_values(
        self, topic: Topic, values: Sequence[Any], *, ordered: bool = True, tolerance: float = 0.0
    ) -> None:
        """Require that these values come on a topic, and no others.

        Args:
            topic: one that the node publishes on.
            values: as `Topic.value` has them.
            ordered: whether their order matters.
            tolerance: by how much each may differ, if they are numbers, in their unit.

        Raises:
            Failed: others did.
        """
        came = self.values(topic)
        if not _are_alike(came, values, ordered, tolerance):
            within = f", to within {tolerance:g}," if tolerance else ""
            raise Failed(
                expected=self._sentence(f"{list(values)!r:.300}{within} comes on {topic}."),
                actual=f"What came was {came!r:.300}." if came else f"Nothing came.{self._note()}",
            )

    def require_at_most(self, topic: Topic, number: int) -> None:
        """Require that no more than ``number`` messages come on a topic.

        Raises:
            Failed: more did.
        """
        if (came := len(self.values(topic))) > number:
            raise Failed(
                expected=self._sentence(f"at most {number} messages come on {topic}."),
                actual=f"In {self.seconds:g} s of the node's time {_came(came)}.{self._note()}",
            )

    def require_count(self, topic: Topic, step: int = 1, first: int | None = None) -> None:
        """Require that each value on a topic is the one before and ``step``.

        Args:
            topic: one that whole numbers come on.
            step: from one to the next.
            first: what the first one is to be, if that matters.

        Raises:
            Failed: one is not, or a value is no number.
        """
        values = self.values(topic)
        if first is not None and values[:1] != [first]:
            came = f"{values[0]!r:.80} came." if values else "Nothing came."
            raise Failed(
                expected=self._sentence(f"the first number on {topic} is {first}."),
                actual=came + self._note(),
            )
        expected = self._sentence(f"each number on {topic} is the one before and {step}.")
        if any(not isinstance(value, int) for value in values):
            raise Failed(
                expected=expected, actual=f"What came was {values[0]!r:.80}: no whole number."
            )
        if (gap := first_gap(values, step)) is not None:
            raise Failed(expected=expected, actual=f"After {gap[0]} came {gap[1]}." + self._note())

    def _rate(self, topic: Topic, hz: float, leeway: float) -> Rate:
        times = [heard.at_s for heard in self.heard(topic)]
        return rate_of(times, self.seconds, self.stride_s, hz, leeway)

    def _clock_hint(self, topic: Topic, rate: Rate) -> str:
        if rate.came and not self._stands_still(topic, STANDSTILL_S):
            return (
                " Messages come while the node's time, which is simulated, stands still: make them "
                "with a timer of the node, or by its clock."
            )
        return ""

    def _sentence(self, text: str) -> str:
        return f"{self.when}, {text}" if self.when else capitalize_first(text)


def _came(number: int) -> str:
    return "1 message came" if number == 1 else f"{number or 'no'} messages came"


def _are_alike(came: Sequence[Any], wanted: Sequence[Any], ordered: bool, tolerance: float) -> bool:
    if tolerance:
        if not ordered:
            came, wanted = sorted(came), sorted(wanted)
        pairs = zip(came, wanted, strict=False)
        return len(came) == len(wanted) and all(
            abs(value - other) <= tolerance * (1 + 1e-9) for value, other in pairs
        )
    return list(came) == list(wanted) or (not ordered and _same_members(came, wanted))


def _same_members(some: Sequence[Any], others: Sequence[Any]) -> bool:
    """Whether both have the same values equally often; they may be messages, without a hash."""
    left = list(others)
    for value in some:
        if value not in left:
            return False
        left.remove(value)
    return not left
