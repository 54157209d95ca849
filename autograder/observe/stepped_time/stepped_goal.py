"""A goal that the examiner sends to a node whose time it moves, and what is heard of it.

An answer, or the end of a goal, that is not there at once may wait for the node's clock.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from rclpy.qos import ReliabilityPolicy

from autograder.examination.exam import Failed
from autograder.observe.examiner.examiner_end import UNDEMANDING
from autograder.observe.nouns import Action
from autograder.observe.patience import IDLE_S, SETTLE_S
from autograder.observe.phrases import end_phrase
from autograder.observe.stepped_time.stepped_observer import STEP_S, SteppedObserver
from course.errors import WaitTimeout
from course.runtime.requests.actions import GoalRun, GoalState

LOOKING_S = 0.6
"""Seconds of wall time for those who look by the wall's clock whether they are called off."""
ARRIVING_S = 4.0
"""Seconds of wall time for what was done in time to become visible."""


class SteppedGoal:
    """A goal that was accepted.

    Attributes:
        action: what it was sent to.
        run: the goal as its sender sees it: its state, and its result.
        feedback: what counts of the feedback messages so far.
        feedback_at_s: when each came, in s of the node's time.
    """

    def __init__(
        self,
        observer: SteppedObserver,
        action: Action,
        goal: Any,
        feedback: Callable[[Any], Any],
        where: str,
    ) -> None:
        """Send it, and let the node's time pass until it is accepted.

        Args:
            observer: whose time passes meanwhile.
            action: the node's.
            goal: the message.
            feedback: what of a feedback message counts.
            where: what is asked for, to begin a sentence with: "The goal for station 3".

        Raises:
            Failed: it is rejected, or not answered.
        """
        self.action, self.feedback = action, list[Any]()
        self.feedback_at_s: list[float] = []
        self._observer = observer

        def note(message: Any) -> None:
            self.feedback.append(feedback(message.feedback))
            self.feedback_at_s.append(observer.elapsed_s)

        self._listener = observer.node.create_subscription(
            action.type.Impl.FeedbackMessage, f"{action}/_action/feedback", note, UNDEMANDING
        )
        observer.await_discovery()
        timeout_s, send = observer.host.settle_s, observer.host.session.send_goal
        answer = observer.submit_request(
            "a goal", lambda: send(action.type, action.name, goal, timeout=timeout_s)
        )
        observer.await_answer(answer, "a goal")
        try:
            self.run: GoalRun = answer.result()
        except WaitTimeout:
            self._require_reliable_feedback()
            raise Failed(
                expected=f"A goal on {action} is accepted at once; the work itself comes after.",
                actual=f"{where} got no answer{observer.error_note()}.",
            ) from None
        if not self.run.accepted:
            raise Failed(
                expected=f"A goal on {action} that can be reached is accepted.",
                actual=f"{where} was rejected.",
            )

    def _require_reliable_feedback(self) -> None:
        name = f"{self.action}/_action/feedback"
        offers = self._observer.node.get_publishers_info_by_topic(name)
        if any(offer.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT for offer in offers):
            raise Failed(
                expected="Whoever sends a goal hears its feedback.",
                actual=f"The goal could not be sent: the feedback of {self.action} is BEST_EFFORT, "
                "and an ordinary client asks for RELIABLE.",
            )

    def close(self) -> None:
        """Listen to its feedback no more."""
        self._observer.node.destroy_subscription(self._listener)

    @property
    def is_done(self) -> bool:
        """Whether it has ended, and the result is there."""
        return bool(self.run.done)

    @property
    def end_phrase(self) -> str:
        """How it ended, as a phrase: "ended as ABORTED ..."; or that it has not."""
        return end_phrase(self.run.status.name) if self.is_done else "went on and on"

    def require_end(self, state: GoalState, needed: str, where: Callable[[], str]) -> None:
        """Let the node's time pass until it ends, and require how.

        Args:
            state: as what it is to end.
            needed: a sentence to put before that.
            where: returns what is there then, as a phrase: "with the robot at 3 m".

        Raises:
            Failed: it ends otherwise, or not at all.
        """
        self._observer.wait_stepping(lambda: self.is_done)
        if not self.is_done or self.run.status != state:
            raise Failed(
                expected=f"{needed} The goal ends as {state.name}.",
                actual=f"The goal {self.end_phrase}, {where()}{self._observer.error_note()}.",
            )

    def cancel(
        self, obeyed: Callable[[], bool], seconds: float, looking_s: float = LOOKING_S
    ) -> int:
        """Ask for it to be cancelled, and let time pass until that is ``obeyed``.

        The time counts from the request on: the answer, too, may wait for the node's clock.

        Args:
            obeyed: whether the node has done what it must do then.
            seconds: of the node's time for that.
            looking_s: seconds of wall time before the node's time passes.

        Returns:
            When that time was over, in ns: what was published by then is in time.

        Raises:
            Failed: the request was refused, or got no answer.
        """
        observer, run = self._observer, self.run
        answer = observer.submit_request("to cancel", lambda: run.cancel(SETTLE_S))
        began_s = observer.elapsed_s
        if answer.done():
            self._require_agreed(answer)
        else:
            observer.await_answer(answer, "to cancel", seconds)
        observer.wait(obeyed, looking_s)
        while not obeyed() and seconds - (observer.elapsed_s - began_s) > STEP_S / 2:
            observer.step()
        # It has had its time: only a message that is under way is waited for.
        patience = observer.start_patience(ARRIVING_S, stepped_s=IDLE_S)
        patience.wait(observer.host.session, obeyed)
        over_ns = time.time_ns()
        observer.await_answer(answer, "to cancel")
        self._require_agreed(answer)
        return over_ns

    def _require_agreed(self, answer: Future[bool]) -> None:
        try:
            fault = "" if answer.result() else "It was refused"
        except WaitTimeout:
            fault = "It got no answer"
        if fault:
            raise Failed(
                expected="A request to cancel a goal is answered, and accepted.",
                actual=f"{fault}{self._observer.error_note()}.",
            )
