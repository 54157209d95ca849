"""A simulation that follows a clock: how many steps are due, and the time of each."""

from __future__ import annotations

import threading
from collections.abc import Iterator

from course.errors import SessionError
from course.worlds.robot.base import STEP_S
from course.worlds.simulation import Readings, Simulation

STEP_NS = round(STEP_S * 1_000_000_000)
MAX_BEHIND_NS = 250_000_000
"""Nanoseconds of wall time that are made up for; if the machine was busy for longer, the world has
stood still meanwhile. Many steps at once would only make it later."""

SPEEDS = (0.25, 4.0)
"""How much slower or faster than the wall clock the world can go."""

ONE_LOOK_STEPS = 10
"""Steps that a paused world takes at a time: 0.1 s."""


class PacedSimulation:
    """Moves a simulation on with a clock that others read (ns), in whole steps.

    Hold ``lock`` while you look at the simulation, control it, or go through what is due.

    Attributes:
        simulation: the simulation.
        lock: for whoever uses it.
        exact: whether all steps are made up for that are due, however many, as on simulated time.
        paused: whether it stands still.
    """

    def __init__(self, simulation: Simulation, *, exact: bool) -> None:
        """Stand still until `start`."""
        self.simulation = simulation
        self.lock = threading.RLock()
        self.exact = exact
        self.paused = False
        self._speed = 1.0
        self._anchor_ns: int | None = None
        self._taken = 0  # steps since the anchor

    @property
    def speed(self) -> float:
        """Simulated seconds a second of the clock."""
        return self._speed

    @speed.setter
    def speed(self, factor: float) -> None:
        if self.exact:
            raise SessionError(
                "On simulated time the world is as fast as you move the clock: "
                "session.sim.advance(10.0)."
            )
        least, most = SPEEDS
        if isinstance(factor, bool) or not isinstance(factor, int | float) or not (
            least <= factor <= most
        ):  # fmt: skip
            raise SessionError(f"The world's speed is {least:g} to {most:g}, not {factor!r}.")
        with self.lock:
            self._anchor(self._last_stamp_ns)
            self._speed = float(factor)

    def start(self, now_ns: int) -> None:
        """Begin at a time of the clock."""
        self._anchor(now_ns)

    def resume(self, now_ns: int) -> None:
        """Go on after a pause, which is not made up for."""
        if self.paused:
            self._anchor(max(now_ns, self._last_stamp_ns))
            self.paused = False

    def steps_due(self, now_ns: int) -> Iterator[tuple[int, Readings]]:
        """Take the steps that are due; yield the time of each (ns of the clock) and its readings.

        Args:
            now_ns: what the clock says.
        """
        if self._anchor_ns is None or self.paused:
            return
        if not self.exact:
            self._bound_catch_up(now_ns)
        while (stamp := self._stamp_ns(self._taken + 1)) <= now_ns:
            self._taken += 1
            yield stamp, self.simulation.step()

    def steps_of_one_look(self, now_ns: int) -> Iterator[tuple[int, Readings]]:
        """Take 0.1 s of steps, also while paused; yield as `steps_due` does.

        They end now, unless steps before them end later than they would begin.
        """
        length_ns = round(ONE_LOOK_STEPS * STEP_NS / self._speed)
        self._anchor(max(now_ns - length_ns, self._last_stamp_ns))
        for _ in range(ONE_LOOK_STEPS):
            self._taken += 1
            yield self._last_stamp_ns, self.simulation.step()

    @property
    def _last_stamp_ns(self) -> int:
        return self._stamp_ns(self._taken)

    def _stamp_ns(self, number: int) -> int:
        return (self._anchor_ns or 0) + round(number * STEP_NS / self._speed)

    def _anchor(self, moment_ns: int) -> None:
        self._anchor_ns, self._taken = moment_ns, 0

    def _bound_catch_up(self, now_ns: int) -> None:
        """Forget steps that are too many, and follow a clock that was set back."""
        behind = now_ns - self._last_stamp_ns
        if behind > MAX_BEHIND_NS or behind < -MAX_BEHIND_NS:
            self._anchor(now_ns - STEP_NS)
