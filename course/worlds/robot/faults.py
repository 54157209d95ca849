"""What can fail, and how."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from course.errors import SessionError
from course.util.close_matches import did_you_mean
from course.worlds.floor_plan import FloorPlan

FAULTS = {
    "gripper": ("works", "slow", "dead", "refuses"),
    "wheels": ("free", "jammed"),
    "camera": ("works", "unplugged"),
    "radio": ("there", "gone"),
    "battery": ("normal", "low"),
    "navigator": ("works", "rejects", "aborts", "stalls", "runaway", "dead"),
}
"""What can fail, and its states; the first is the sound one. Not every world has a navigator."""


def possible_faults(plan: FloorPlan) -> dict[str, tuple[str, ...]]:
    """Return what can fail in the world of a plan, with its states, of `FAULTS`."""
    has_navigator = "navigator" in plan.interfaces
    return {what: states for what, states in FAULTS.items() if what != "navigator" or has_navigator}


def check_fault(possible: Mapping[str, Sequence[str]], what: str, state: str) -> None:
    """Raise a `SessionError` if there is no such thing that can fail, or no such state of it."""
    if what not in possible:
        raise SessionError(
            f"Nothing called {what!r} can fail: there are {', '.join(possible)}."
            + did_you_mean(str(what), possible)
        )
    if state not in possible[what]:
        raise SessionError(
            f"The {what} cannot be {state!r}: it is one of {', '.join(possible[what])}."
            + did_you_mean(str(state), possible[what])
        )
