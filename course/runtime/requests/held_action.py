"""An action server that fails on demand: it answers late or never, and refuses to cancel."""

from __future__ import annotations

from typing import Any, Protocol

from action_msgs.srv import CancelGoal
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node


class GoalAnswers(Protocol):
    """What decides on goals. Each answer is awaited, so it may come late, or never."""

    async def answer_goal(self, goal: Any) -> GoalResponse:
        """Return whether a goal, a message, is accepted."""

    async def refuses_cancel(self) -> bool:
        """Return whether a request to cancel is refused."""


class HeldActionServer(ActionServer):
    """An action server whose answers wait, and that refuses to cancel in so many words.

    Of a refused request to cancel rclpy only leaves the goal out of `goals_canceling`, and the code
    at ERROR_NONE. By the comments of action_msgs/srv/CancelGoal it has the code ERROR_REJECTED, as
    rclcpp's servers answer: a client may read either.
    """

    def __init__(
        self, node: Node, action_type: Any, name: str, answers: GoalAnswers, **callbacks: Any
    ) -> None:
        """Serve an action from a node.

        Args:
            node: spun by an executor of a session. Other callbacks of it run while answers wait.
            action_type: the class of the action's type.
            name: the action.
            answers: what decides on goals.
            callbacks: rclpy's ``execute_callback``, and ``handle_accepted_callback`` if wanted.
        """
        self._answers = answers
        super().__init__(
            node, action_type, name, goal_callback=answers.answer_goal,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(), **callbacks,
        )  # fmt: skip

    async def _execute_cancel_request(self, request_header_and_message: Any) -> None:
        """Answer a refused request here; rclpy deals with one that is accepted."""
        if not await self._answers.refuses_cancel():
            await super()._execute_cancel_request(request_header_and_message)
            return
        header, _request = request_header_and_message
        answer = CancelGoal.Response(return_code=CancelGoal.Response.ERROR_REJECTED)
        self._handle.send_cancel_response(header, answer)
