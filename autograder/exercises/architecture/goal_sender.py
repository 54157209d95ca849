"""Errands: the marked goals that an examiner sends to a robot's navigation, one after the other."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from autograder.observe.phrases import end_phrase
from course.design import message_tags
from course.design.lifelike import AHEAD_M, lifelike_message
from course.errors import WaitTimeout
from course.runtime.core_session import CoreSession
from course.runtime.requests.actions import GoalRun, GoalState

SETTLE = 8.0
"""Seconds that something expected may take: discovery takes 0.3 s, on a busy machine a few."""
WAYPOINT = 5.0
"""Metres to the waypoint of a goal: a robot that is there already would not start."""
NEARER = 3.0
"""Metres to the next one: a robot that reckons where it has got to may be at the first."""
GRACE = 0.1
"""Seconds that a goal may take to be over before it is asked to end."""
PATIENCE = 2.0
"""Seconds that a goal may take to end when it is cancelled."""


class Errands:
    """The goals that the examiner sends to one action, one after the other."""

    def __init__(self, session: CoreSession, name: str, action_type: Any) -> None:
        """Send none yet."""
        self._session = session
        self._name = name
        self._type = action_type
        self._runs: list[GoalRun] = []
        self._rejected = 0
        self.answers = True
        """Whether the server has answered to each goal."""
        self.cancelled = 0
        """How many goals were cancelled and said yes to it."""
        self.turned_away = 0
        """Goals that were rejected when all earlier ones were over."""
        self.outlasts = False
        """Whether a goal went on although it was asked to end."""

    def send(self, tag: int, ahead: float = WAYPOINT) -> bool:
        """Send a marked goal; return whether the server took it.

        Raises:
            WaitTimeout: the server did not answer to the first goal; says why.
        """
        first = not self._runs
        if not self.answers:
            return False
        over = not first and self._all_done()
        goal = marked_message(self._type.Goal, tag, ahead)
        try:
            run = self._session.send_goal(
                self._type, self._name, goal, timeout=SETTLE if first else PATIENCE
            )
        except WaitTimeout:
            self.answers = False
            if first:
                raise
            return False
        if run.accepted:
            self._runs.append(run)
        elif not first:
            self._rejected += 1
            self.turned_away += over
        return run.accepted

    @property
    def rejection_remark(self) -> str:
        """What became of goals that were not taken; empty if there were none."""
        if not self.answers:
            return f"while that goal went on, {self._name} did not answer to another"
        times = "once" if self._rejected == 1 else f"{self._rejected} times"
        return f"another goal was rejected, {times}" if self._rejected else ""

    @property
    def aborted_goals(self) -> str:
        """How many goals ended as aborted; empty if none did."""
        count = sum(run.status == GoalState.ABORTED for run in self._runs)
        goals = "a goal" if count == 1 else f"{count} goals"
        return f"{goals} {end_phrase('aborted')}" if count else ""

    def end_goal(self) -> None:
        """Cancel the goal before, and wait until it is over; it may go on all the same."""
        run = self._runs[-1] if self._runs else None
        if self.answers and run is not None and not run.done_within(GRACE):
            with suppress(WaitTimeout):
                if run.cancel(PATIENCE):
                    self.cancelled += 1
                    run.done_within(PATIENCE)
        self.outlasts = not self._all_done()

    def wait_for_end(self) -> None:
        """Wait for goals to end by themselves, as long as one that is cancelled may take."""
        with suppress(WaitTimeout):
            self._session.until(self._all_done, PATIENCE, "the end of a goal")
        self.outlasts = not self._all_done()

    def _all_done(self) -> bool:
        return all(run.done for run in self._runs)

    def keep_one(self, tag: int) -> None:
        """See to it that a goal is under way, as far as the server takes one."""
        if not self._runs or self._runs[-1].done:
            with suppress(WaitTimeout):
                self.send(tag)


def marked_message(msg_type: Any, tag: int, ahead: float = AHEAD_M) -> Any:
    """Return a message as a robot would send it, with a mark in it."""
    message = lifelike_message(msg_type, ahead)
    message_tags.mark(message, tag)
    return message
