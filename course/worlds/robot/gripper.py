"""The gripper, and how it fails."""

from __future__ import annotations

from course.worlds.robot.base import STEP_S

SLOW_S = 1.5
"""Seconds that a slow gripper takes to move and to answer; a sound one does both at once."""

SLOW_STEPS = round(SLOW_S / STEP_S)


class Gripper:
    """Two fingers. They take hold of a parcel if they close at a station.

    Attributes:
        closed: whether it is.
        holding: whether it holds a parcel.
    """

    def __init__(self) -> None:
        """Be open and empty."""
        self.closed = self.holding = False
        self._orders: list[tuple[int, bool]] = []  # steps left, and whether to close then

    def command(self, closed: bool, state: str) -> bool:
        """Take a command in a state of its fault; return False if it refuses."""
        if state in ("works", "slow"):
            self._orders.append((SLOW_STEPS if state == "slow" else 0, closed))
        return state != "refuses"

    def step(self, *, at_station: bool) -> bool | None:
        """Move on by one step; return whether it has closed (True) or opened (False) in it."""
        if not self._orders:
            return None
        due = [closed for left, closed in self._orders if left <= 0]
        self._orders = [(left - 1, closed) for left, closed in self._orders if left > 0]
        if not due or due[-1] == self.closed:
            return None
        self.closed = due[-1]
        self.holding = self.closed and at_station
        return self.closed
