"""Both ends of an action as an examiner plays them: a server that fails on demand, and a client.

The server accepts or rejects a goal, lets its client wait for the answer, stalls, refuses to
cancel, aborts, or vanishes with the goal. The client sends goals, cancels them, and notes what
comes of each.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.client import ActionClient
from rclpy.action.server import GoalResponse, ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future

from autograder.observe.examiner.deferred_replies import DeferredReplies
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.nouns import Action
from course.runtime.executor.background import BackgroundExecutor
from course.runtime.requests.held_action import HeldActionServer

ENDS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}
"""The statuses of a goal that is over, in rclpy's words."""


class SentGoal:
    """A goal that the examiner has sent, and what came of it so far.

    Attributes:
        sent_at_s: when it was sent, in s of the node's time.
        answered_at_s, cancel_asked_at_s, ended_at_s: when that was, once it has been.
        accepted: whether the server accepted it; None without an answer.
        feedback: the messages of the action's feedback that came.
        feedback_at_s: when each came, in s of the node's time.
        cancel_accepted: whether the server accepted a request to cancel; None without an answer.
        end: how it ended, a word of `ENDS`; empty until then.
        result: the action's result, or None.
    """

    def __init__(self, now_s: Callable[[], float]) -> None:
        """Nothing has come of it yet; ``now_s`` tells the node's time."""
        self._now_s = now_s
        self.sent_at_s = now_s()
        self.answered_at_s: float | None = None
        self.cancel_asked_at_s: float | None = None
        self.ended_at_s: float | None = None
        self.accepted: bool | None = None
        self.feedback: list[Any] = []
        self.feedback_at_s: list[float] = []
        self.cancel_accepted: bool | None = None
        self.end = ""
        self.result: Any = None
        self._handle: Any = None

    def note_answer(self, future: Future) -> None:
        """Note the answer to the goal, and ask for its result if it was accepted."""
        self._handle = future.result()
        self.accepted, self.answered_at_s = bool(self._handle.accepted), self._now_s()
        if self.accepted:
            self._handle.get_result_async().add_done_callback(self._note_end)

    def _note_end(self, future: Future) -> None:
        self.result = future.result().result
        self.ended_at_s = self._now_s()
        self.end = ENDS.get(future.result().status, "unknown")

    def request_cancel(self) -> Future:
        """Ask the server to cancel it; return the future of the answer.

        Raises:
            RuntimeError: it has not been accepted.
        """
        if self._handle is None:
            raise RuntimeError("a goal that was not accepted cannot be canceled")
        self.cancel_asked_at_s = self._now_s()
        answer: Future = self._handle.cancel_goal_async()
        return answer

    def note_cancel(self, future: Future) -> None:
        """Note the answer to a request to cancel."""
        self.cancel_accepted = bool(future.result().goals_canceling)


class ActionClientEnd:
    """The examiner's client of an action that the student's node serves."""

    def __init__(self, node: Node, action: Action, now_s: Callable[[], float]) -> None:
        """Create it on a ``node`` of the examiner's; ``now_s`` tells the observed node's time."""
        self._node, self._type, self._now_s = node, action.type, now_s
        self._client = ActionClient(node, action.type, str(action))

    def is_ready(self) -> bool:
        """Return whether a server has been found."""
        return bool(self._client.server_is_ready())

    def send(self, **fields: Any) -> SentGoal:
        """Send a goal with these fields; what comes of it is noted as it comes."""
        goal = SentGoal(self._now_s)

        def note_feedback(message: Any) -> None:
            goal.feedback.append(message.feedback)
            goal.feedback_at_s.append(self._now_s())

        with self._hold_answers():
            answer = self._client.send_goal_async(self._type.Goal(**fields), note_feedback)
        answer.add_done_callback(goal.note_answer)
        return goal

    def cancel(self, goal: SentGoal) -> None:
        """Ask the server to cancel a goal that it has accepted."""
        with self._hold_answers():
            answer = goal.request_cancel()
        answer.add_done_callback(goal.note_cancel)

    def _hold_answers(self) -> AbstractContextManager[None]:
        """Keep answers from being taken: rclpy registers a request after it has sent it."""
        assert isinstance(self._node.executor, BackgroundExecutor)
        return self._node.executor.hold_still()

    def destroy(self) -> None:
        """Take it down."""
        self._client.destroy()


class _RestingServer(HeldActionServer):
    """A server whose results wait, too."""

    def __init__(self, end: ActionServerEnd, action: Action) -> None:
        self._end = end
        super().__init__(
            end, action.type, str(action), end,
            execute_callback=lambda _: action.type.Result(),
            handle_accepted_callback=end.goals.append,
        )  # fmt: skip

    async def _execute_get_result_request(self, request_header_and_message: Any) -> None:
        """Wait with a result that is there already: see `ActionServerEnd.release`."""
        await self._end.wait_for_rest()
        await super()._execute_get_result_request(request_header_and_message)


class ActionServerEnd(QuietNode):
    """An action server that the examiner plays, in a node of its own, which may vanish.

    Attributes:
        served: the action.
        requested: the goals that were asked for, as messages, accepted or not.
        goals: the handles of those that were accepted.
        cancels_at_s: when each request to cancel came, in s of the node's time.
    """

    def __init__(self, served: Action, now_s: Callable[[], float]) -> None:
        """Serve; ``now_s`` tells the time of the node under test, in s."""
        super().__init__(f"server_of_{served.name.replace('/', '_')}")
        self.served, self._now_s = served, now_s
        self.requested: list[Any] = []
        self.goals: list[ServerGoalHandle] = []
        self.cancels_at_s: list[float] = []
        self._resting, self._undecided = DeferredReplies(), DeferredReplies()
        self.plan()
        self._server = _RestingServer(self, served)

    def plan(
        self,
        *,
        accepts: bool = True,
        cancels: bool = True,
        holds_goal: bool = False,
        holds_cancel: bool = False,
    ) -> None:
        """Say what is done with the next goal, and forget those before.

        Args:
            accepts: whether it is accepted.
            cancels: whether a request to cancel it is accepted.
            holds_goal: the answer to the goal waits for `decide`.
            holds_cancel: the answer to a request to cancel waits for `decide`.
        """
        self._accepts, self._cancels = accepts, cancels
        self._holds_goal, self._holds_cancel = holds_goal, holds_cancel
        for noted in (self.requested, self.goals, self.cancels_at_s):
            noted.clear()

    def decide(self) -> None:
        """Give the answers that were held."""
        self._undecided.release()

    def send_feedback(self, **fields: Any) -> None:
        """Send feedback with these fields on the goal that was accepted first."""
        self.goals[0].publish_feedback(self.served.type.Feedback(**fields))

    def end_goal(self, how: Callable[[ServerGoalHandle], None]) -> None:
        """End that goal with a method of its handle: succeed, abort or canceled."""

        def end(goal: ServerGoalHandle) -> Any:
            how(goal)
            return self.served.type.Result()

        self.goals[0].execute(end)

    def release(self) -> bool:
        """Give the answers that wait until the student's node is at rest; return if there are any.

        rclpy's action client registers a request after it has sent it, and drops an answer that
        another thread takes in between. Where the node runs in several threads, an answer must not
        be faster than the line that asks.
        """
        return self._resting.release()

    async def wait_for_rest(self) -> None:
        """Wait, in a callback, for `release`."""
        await self._resting.wait(self)

    async def answer_goal(self, goal: Any) -> GoalResponse:
        """Answer a goal, as was planned."""
        self.requested.append(goal)
        await self._wait(self._holds_goal)
        return GoalResponse.ACCEPT if self._accepts else GoalResponse.REJECT

    async def refuses_cancel(self) -> bool:
        """Return whether a request to cancel is refused, as was planned."""
        self.cancels_at_s.append(self._now_s())
        await self._wait(self._holds_cancel)
        return not self._cancels

    async def _wait(self, holds: bool) -> None:
        await self.wait_for_rest()
        if holds:
            await self._undecided.wait(self)

    def destroy_node(self) -> None:
        """Take the server down, too: rclpy leaves it alive."""
        self._server.destroy()
        super().destroy_node()
