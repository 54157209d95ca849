"""Goals of actions that tell places: sent, and carried out until the robot is there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer, CancelResponse, ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future

from course.design.at_work.meanings import Meaning
from course.design.at_work.places import messages as places
from course.design.at_work.places.place import Place


class GoalSender:
    """Sends places as goals; each replaces the one before.

    Attributes:
        name: of the action.
        meaning: what its goals tell.
    """

    def __init__(self, node: Node, action_type: Any, name: str, meaning: Meaning) -> None:
        """Send to the action ``name``."""
        self.name, self.meaning = name, meaning
        self._type = action_type
        self._client = ActionClient(node, action_type, name)

    def send(self, found: list[Place], frame: str) -> None:
        """Send a goal, if the server is there and its type has room for places."""
        goal = self._type.Goal()
        if self._client.server_is_ready() and places.write_places(goal, found, frame):
            self._client.send_goal_async(goal)


class GoalServer:
    """Carries out the goals of an action: the newest counts.

    Attributes:
        name: of the action.
        meaning: what its goals tell.
    """

    def __init__(
        self, node: Node, action_type: Any, name: str, meaning: Meaning,
        begin: Callable[[str, Any], None],
    ) -> None:  # fmt: skip
        """Serve the action ``name``; ``begin`` gets the name and each goal."""
        self.name, self.meaning = name, meaning
        self._type, self._begin = action_type, begin
        self._goal: ServerGoalHandle | None = None
        self._ended: Future | None = None
        ActionServer(
            node, action_type, name, self._carry_out,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )  # fmt: skip

    @property
    def is_busy(self) -> bool:
        """Whether a goal is being carried out."""
        return self._ended is not None and not self._ended.done()

    def report(self, distance: float | None) -> bool:
        """Tell the client how far it is (m); return whether it has cancelled the goal."""
        if self._goal is None or not self.is_busy:
            return False
        feedback = self._type.Feedback()
        if distance is not None and places.write_places(feedback, [Place(distance, 0.0)], "map"):
            self._goal.publish_feedback(feedback)
        return bool(self._goal.is_cancel_requested)

    def finish(self, *, arrived: bool) -> None:
        """End the goal that is being carried out, if there is one."""
        if self._ended is not None and not self._ended.done():
            self._ended.set_result(arrived)

    async def _carry_out(self, goal: ServerGoalHandle) -> Any:
        self.finish(arrived=False)
        self._goal, self._ended = goal, Future()
        ended = self._ended
        self._begin(self.name, goal.request)
        if self.meaning is Meaning.OBSTACLES:
            ended.set_result(True)
        arrived = await ended
        if goal.is_cancel_requested:
            goal.canceled()
        elif arrived:
            goal.succeed()
        else:
            goal.abort()
        result = self._type.Result()
        if hasattr(result, "arrived"):
            result.arrived = bool(arrived)
        return result
