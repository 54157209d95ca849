"""What a finding says beside what was found: where that was, and how it went over time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress

from autograder.examination.exam import Failed
from autograder.examination.pictures.picture import (
    DECIMALS,
    MAX_LABEL_CHARS,
    Lane,
    Picture,
    Timeline,
)

MOST_DUE, MOST_CAME = 30, 120
"""Messages that are shown of those that were due, and of those that came meanwhile."""


@contextmanager
def in_context(needed: str, seen: str) -> Iterator[None]:
    """Have a failure in the block say more.

    Args:
        needed: a sentence to put before what was needed.
        seen: what to put before what was seen: "In the next drive:".

    Raises:
        Failed: the block did.

    Example:
        >>> with in_context("The drive holds nobody up.", "At 2 m:"):
        ...     raise Failed(expected="Pictures come.", actual="None came.")
        Traceback (most recent call last):
        autograder.examination.exam.Failed: expected: The drive holds nobody up. Pictures come. \
observed: At 2 m: None came.
    """
    try:
        yield
    except Failed as failed:
        raise Failed(
            expected=f"{needed} {failed.expected}", actual=f"{seen} {failed.actual}",
            picture=failed.picture,
        ) from None  # fmt: skip


@contextmanager
def with_picture(draw: Callable[[], Picture | None]) -> Iterator[None]:
    """Have a failure in the block show what was seen over time, if it does not yet.

    Args:
        draw: makes the picture, once something has failed. What goes wrong in it costs no more than
            the picture: the finding stands without it.

    Raises:
        Failed: the block did.

    Example::

        with with_picture(lambda: rate_picture("Ticks", tick_times, hz=10.0, seconds=3.0)):
            require_rate(tick_times, 10.0)
    """
    try:
        yield
    except Failed as failed:
        add_picture(failed, draw)
        raise


def add_picture(failed: Failed, draw: Callable[[], Picture | None]) -> None:
    """Have a failure show what ``draw`` makes, as `with_picture` does."""
    if failed.picture is None:
        with suppress(Exception):
            failed.picture = draw()


def handled_picture(
    title: str, label: str, handled: Collection[int], times_s: Mapping[int, float],
    may: tuple[float, float], how: str = "acted on",
) -> Timeline:  # fmt: skip
    """Return a picture of messages that came in, and of which were handled later.

    Args:
        title: what it shows.
        label: what came in.
        handled: the numbers of the messages that were handled.
        times_s: {number: when it came in}, in s since the begin.
        may: from when to when (s) a message may have come that is still handled; what is older is
            wrong.
        how: what it is to be handled, as a participle.
    """
    oldest_s, ended_s = max(0.0, may[0]), may[1]
    young = {number for number, at in times_s.items() if at >= oldest_s}
    known = times_s.keys() & set(handled)

    def times_of(numbers: Iterable[int]) -> list[float]:
        return [times_s[number] for number in numbers]

    came = Lane.of(
        label[:MAX_LABEL_CHARS],
        {
            "done": times_of(young & known),
            "wrong": times_of(known - young),
            "lost": times_of(times_s.keys() - known),
        },
    )
    legend = [("done", how), ("lost", f"not {how}")]
    if not oldest_s:
        return Timeline(title, round(ended_s, DECIMALS), (came,), tuple(legend))
    legend.insert(1, ("wrong", f"{how}, and too old"))
    fresh = Lane.of(f"young enough to be {how}", {}, [(oldest_s, ended_s, "allowed")])
    return Timeline(title, round(ended_s, DECIMALS), (came, fresh), tuple(legend))


def rate_picture(title: str, times_s: Iterable[float], hz: float, seconds: float) -> Timeline:
    """Return a picture of messages beside the times at which they were due, one period apart.

    Args:
        title: what it shows.
        times_s: when messages came, in s since the begin.
        hz: how many were due each second.
        seconds: how long was listened; no more is shown than `MOST_DUE` periods of it.
    """
    shown_s = min(seconds, MOST_DUE / hz)
    came = [at for at in times_s if 0 <= at <= shown_s][:MOST_CAME]
    due = [number / hz for number in range(1, int(shown_s * hz + 1e-6) + 1)]
    lanes = (Lane.of("came", {"done": came}), Lane.of(f"due, {hz:g} each second", {"due": due}))
    return Timeline(title, round(shown_s, DECIMALS), lanes)
