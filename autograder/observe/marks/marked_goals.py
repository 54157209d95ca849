"""Marked goals that the examiner sends to an action, one after the other."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from autograder.examination.exam import Failed
from autograder.observe.marks.marked_types import marked_message
from autograder.observe.patience import SETTLE_S
from autograder.observe.phrases import end_phrase
from course.errors import WaitTimeout
from course.runtime.core_session import CoreSession
from course.runtime.requests.actions import GoalRun, GoalState

WAYPOINT_M = 5.0
"""Metres to the place that a goal names: a robot that is there already would not start."""
GRACE_S = 0.1
"""Seconds that a goal may take to be over before it is cancelled."""
ENDS_S = 2.0
"""Seconds that a goal may take to end when it is cancelled, and a server to take another."""


class MarkedGoals:
    """Goals for one action, as of somebody who cancels the one before when another is wanted.

    Attributes:
        action: the action's full name.
        sent: how many goals were sent.
        rejected: how many of them were rejected.
        turned_away: how many were rejected although one had been taken before, and all were over.
        cancelled: how many said yes when they were cancelled.
        outlasts: whether a goal went on although it was asked to end.
        silence: why the server did not answer to a goal; empty if it has answered to each.
    """

    def __init__(self, session: CoreSession, action: str, action_type: Any) -> None:
        """Send none yet; ``action_type`` is the action's class."""
        self.action = action
        self.sent = self.rejected = self.turned_away = self.cancelled = 0
        self.outlasts, self.silence = False, ""
        self._session, self._type = session, action_type
        self._runs: list[GoalRun] = []

    def send(self, tag: int, ahead_m: float = WAYPOINT_M) -> bool:
        """Send a goal with a mark, so many metres ahead; return whether the server took it.

        One that has not answered to a goal is sent no other.
        """
        if self.silence:
            return False
        taken_before, all_over = bool(self._runs), self._all_over()
        goal = marked_message(self._type.Goal, tag, ahead_m)
        try:
            run = self._session.send_goal(
                self._type, self.action, goal, timeout=ENDS_S if taken_before else SETTLE_S
            )
        except WaitTimeout as timeout:
            self.silence = str(timeout).rstrip(".")
            return False
        self.sent += 1
        if run.accepted:
            self._runs.append(run)
        else:
            self.rejected += 1
            self.turned_away += taken_before and all_over
        return run.accepted

    def keep_one(self, tag: int) -> None:
        """See to it that a goal is under way, as far as the server takes one."""
        if self._all_over():
            self.send(tag)

    def cancel_last(self) -> None:
        """Cancel the last goal, and wait until it is over; it may go on all the same."""
        if not self.silence and self._runs and not self._runs[-1].done_within(GRACE_S):
            with suppress(WaitTimeout):
                if self._runs[-1].cancel(ENDS_S):
                    self.cancelled += 1
                    self._runs[-1].done_within(ENDS_S)
        self.outlasts = not self._all_over()

    def wait_for_end(self) -> None:
        """Wait for goals to end by themselves, as long as one that is cancelled may take."""
        with suppress(WaitTimeout):
            self._session.until(self._all_over, ENDS_S, "the end of a goal")
        self.outlasts = not self._all_over()

    def _all_over(self) -> bool:
        return all(run.done for run in self._runs)

    def require_next_taken(self) -> None:
        """Require that the server took goals whenever earlier ones were over.

        Raises:
            Failed: it rejected one, or more.
        """
        if self.turned_away:
            others = "the next" if self.turned_away == 1 else f"{self.turned_away} others"
            raise Failed(
                expected=f"The server of {self.action} takes a goal whenever the one before is "
                "over.",
                actual=f"It took a goal, and after that was over it rejected {others}.",
            )

    @property
    def remark(self) -> str:
        """What became of goals that set nothing off, as the end of a sentence."""
        aborted = sum(run.status == GoalState.ABORTED for run in self._runs)
        if self.silence and self._runs:
            return f"; while a goal went on, {self.action} did not answer to another"
        if self.silence:
            return f"; {self.silence}"
        if self.rejected:
            each = "each" if self.rejected == self.sent else f"{self.rejected}"
            return f"; the server of {self.action} rejected {each} of {self.sent} goals"
        if aborted:
            return f"; {'a goal' if aborted == 1 else f'{aborted} goals'} {end_phrase('aborted')}"
        return "; each was cancelled before the next was sent" if self.cancelled else ""
