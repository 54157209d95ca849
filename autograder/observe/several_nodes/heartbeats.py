"""A heartbeat, judged by its silences, and for how long nothing came on a topic."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from autograder.observe.nouns import Topic
from autograder.observe.observed_node import STRIDE_S, ObservedNode
from autograder.observe.phrases import there_were

BLUR_S = 1.5 * STRIDE_S
"""Seconds: a beat is known to a stride; and half a one, lest sums of floats decide."""
ON_THE_WALL_CLOCK = " Does it beat on the wall clock? In simulated time that hardly moves."
STOPPED = (
    " It had beaten before: was it stopped, or is it in one callback group with what waits here?"
)


def longest_silence(times_s: Sequence[float], since_s: float, until_s: float) -> float:
    """Return the longest time between two messages, or between one and either end, in s.

    Args:
        times_s: when each came, in order; those outside do not count.
        since_s: the begin of the time that is looked at.
        until_s: its end.

    Example:
        >>> longest_silence([1.0, 1.5, 4.0], 1.0, 3.0)
        1.5
    """
    within = [at for at in times_s if since_s <= at <= until_s]
    return max(after - before for before, after in pairwise([since_s, *within, until_s]))


def guess_cause(beats: int, wanted: float, period_s: float, watched_s: float | None) -> str:
    """Return what a student is asked for whom there were hardly any beats; empty if nothing.

    Args:
        beats: how many there were.
        wanted: how many there should have been.
        period_s: from one to the next.
        watched_s: for how long nothing else went on in the node, by the wall clock; None if
            something did.
    """
    if beats > wanted / 2:
        return ""
    if watched_s is None:
        return STOPPED
    # By the wall clock there would be no more than these.
    return ON_THE_WALL_CLOCK if beats <= watched_s / period_s + 1 else ""


def require_heartbeat(
    node: ObservedNode,
    topic: Topic,
    period_s: float,
    *,
    allowed_s: float,
    since_s: float,
    when: str,
    watched_s: float | None = None,
) -> None:
    """Require a heartbeat since a time: neither a silence nor a rush.

    What counts is each silence between two beats, and not how many there were: a node that looks by
    a timer may be late each time. Too many are told by their number: some may come soon after one
    that was late.

    Args:
        node: the one that beats.
        topic: what it beats on.
        period_s: from one beat to the next, in s of the node's time.
        allowed_s: seconds more or less that do no harm.
        since_s: from when on.
        when: that time in words, as the beginning of a sentence.
        watched_s: how long it was by the wall clock, if nothing else went on in the node.

    Raises:
        Failed: it was silent, or raced.
    """
    lasted_s = node.now_s - since_s
    times_s = [beat.at_s for beat in node.end.heard(topic) if beat.at_s > since_s]
    silence_s, beats = longest_silence(times_s, since_s, node.now_s), len(times_s)
    came = f"In {lasted_s:.1f} s {there_were(beats, 'heartbeat', 'heartbeats')}"
    goes_on = f"{when}, the heartbeat goes on at one every {period_s:g} s"
    hint = guess_cause(beats, lasted_s / period_s, period_s, watched_s)
    node.require_that(
        silence_s <= period_s + allowed_s + BLUR_S,
        f"{goes_on}: no silence is longer than {period_s + allowed_s:g} s.",
        f"{came}; the longest silence lasted {silence_s:.1f} s.{hint}",
    )
    most = int((lasted_s + BLUR_S) / (period_s - allowed_s)) + 1
    node.require_that(beats <= most, f"{goes_on}: at most {most} in {lasted_s:.1f} s.", f"{came}.")
