"""Part A, the heartbeat: neither a silence nor a rush, whatever else goes on."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from autograder.examination.exam import Failed
from autograder.exercises.safety.node_under_test import STRIDE

BEAT = 0.5  # s between two heartbeats
ALLOWED = 0.2  # s more or less that do no harm
BLUR = 1.5 * STRIDE  # s: a beat is known to a stride; and half a one, lest sums of floats decide


BY_THE_WALL = "Does it beat on the wall clock? In simulated time that hardly moves."
HELD_UP = (
    "It had beaten before: was it stopped, or is it in one callback group with what waits here?"
)


def require_beats(
    seen: Sequence[float], since: float, until: float, when: str, watched: float | None = None
) -> None:
    """Require a heartbeat every 0.5 s from ``since`` to ``until``, by the times of those seen.

    What counts is each silence between two beats, and not how many there were: a node that looks
    by a timer may be late each time. Too many are told by their number: some may come soon after
    one that was late.

    Args:
        seen: when each was seen, in s of simulated time.
        since: from when on.
        until: until when.
        when: that time in words, as the beginning of a sentence.
        watched: how long it was in s of wall time, if nothing else went on in the node.
    """
    there = [beat for beat in seen if since < beat <= until]
    lasted = until - since
    silence = max(after - before for before, after in pairwise([since, *there, until]))
    if silence > BEAT + ALLOWED + BLUR:
        hint = _guess_cause(len(there), watched) if len(there) <= lasted / BEAT / 2 else ""
        raise Failed(
            expected=f"{when}, the heartbeat goes on at one every {BEAT:g} s: no silence is longer "
            f"than {BEAT + ALLOWED:g} s.",
            actual=f"In {lasted:.1f} s there {_say_beats(len(there))}; the longest silence lasted "
            f"{silence:.1f} s.{hint}",
        )
    most = int((lasted + BLUR) / (BEAT - ALLOWED)) + 1
    if len(there) > most:
        raise Failed(
            expected=f"{when}, the heartbeat goes on at one every {BEAT:g} s: at most {most} in "
            f"{lasted:.1f} s.",
            actual=f"In {lasted:.1f} s there {_say_beats(len(there))}.",
        )


def _guess_cause(count: int, watched: float | None) -> str:
    """Return what a student is asked for whom there were hardly any, to add; empty if nothing."""
    if watched is None:
        return f" {HELD_UP}"
    # By the wall clock there would be no more than these.
    return f" {BY_THE_WALL}" if count <= watched / BEAT + 1 else ""


def _say_beats(count: int) -> str:
    return "was 1 heartbeat" if count == 1 else f"were {count or 'no'} heartbeats"
