"""The robot's navigator: an action that drives so many metres straight on, and how it fails."""

from __future__ import annotations

from typing import Any

from rclpy.action.server import GoalResponse, ServerGoalHandle
from rclpy.task import Future
from test_msgs.action import Fibonacci

from course.runtime.requests.held_action import HeldActionServer
from course.worlds.interfaces.ports import Ports
from course.worlds.robot.base import STEP_S

ACTION = "navigate"
SPEED_MPS = 1.0
SIGN_OF_LIFE_S = 1.0
"""Seconds after which feedback comes again, if no metre was passed meanwhile."""

PATIENCE_S = 5.0
"""Seconds that the robot may stand still on its way, before the goal is aborted."""

_NEAR_M = 0.02  # m before a mark that count as there: wheels do not stop to the micrometre


class Navigator:
    """``navigate``, a `test_msgs/Fibonacci`: ``order`` is how many metres, ``sequence`` the marks.

    A new goal takes the place of the one before. The fault has it reject goals, abort after the
    next metre, stall (it stands still and says nothing), be a runaway (it drives on, says nothing
    and refuses to be canceled), or be dead (it answers nothing, and has forgotten its goal when it
    works again).
    """

    def __init__(self, ports: Ports) -> None:
        """Serve it from the world's node."""
        self._ports = ports
        self._goal: ServerGoalHandle | None = None
        self._begin()
        self._server = HeldActionServer(
            ports.node, Fibonacci, ACTION, self, execute_callback=self._execute_goal
        )

    def _begin(self) -> None:
        self._over = Future()
        self._marks: list[int] = []
        self._driven_m = self._quiet_s = self._still_s = 0.0
        self._has_died = self._is_halted = False

    async def answer_goal(self, goal: Any) -> GoalResponse:
        """Accept a goal of a metre or more, unless it rejects them."""
        await self._live()
        accepts = goal.order > 0 and self._state != "rejects"
        return GoalResponse.ACCEPT if accepts else GoalResponse.REJECT

    async def refuses_cancel(self) -> bool:
        """Return whether it is a runaway."""
        await self._live()
        return self._state == "runaway"

    def after_step(self) -> None:
        """Go on with the goal that is under way."""
        goal, robot, state = self._goal, self._ports.simulation.robot, self._state
        if goal is None:
            return
        self._driven_m += abs(robot.speed) * STEP_S
        self._quiet_s += STEP_S
        self._still_s = 0.0 if robot.speed else self._still_s + STEP_S
        if state == "dead":
            self._has_died = True
            self._halt()
        elif self._has_died:
            self._finish("abort")
        elif state == "runaway":
            return
        elif goal.is_cancel_requested:
            self._finish("canceled")
        elif state == "stalls":
            self._halt()
        elif robot.jammed or self._still_s > PATIENCE_S:
            self._finish("abort")
        else:
            self._go_on(goal)

    def reset(self) -> None:
        """Abort the goal that is under way."""
        if self._goal is not None:
            self._finish("abort")

    @property
    def _state(self) -> str:
        return self._ports.simulation.faults["navigator"] if self._ports.has_radio else "dead"

    async def _live(self) -> None:
        """Go on, unless it is dead: then whoever asks waits in vain."""
        if self._state == "dead":
            await Future()

    async def _execute_goal(self, goal: ServerGoalHandle) -> Any:
        with self._ports.lock:
            self._ports.catch_up()
            self.reset()
            self._begin()
            self._goal, over, marks = goal, self._over, self._marks
            self._ports.simulation.drive_on(SPEED_MPS)
        getattr(goal, await over)()
        return Fibonacci.Result(sequence=marks)

    def _go_on(self, goal: ServerGoalHandle) -> None:
        if self._is_halted:
            self._is_halted = False
            self._ports.simulation.drive_on(SPEED_MPS)
        passed = self._driven_m >= len(self._marks) + 1 - _NEAR_M
        if passed:
            self._marks.append(len(self._marks) + 1)
        if passed or self._quiet_s >= SIGN_OF_LIFE_S:
            self._quiet_s = 0.0
            goal.publish_feedback(Fibonacci.Feedback(sequence=self._marks))
        if passed and self._state == "aborts":
            self._finish("abort")
        elif len(self._marks) >= goal.request.order:
            self._finish("succeed")

    def _halt(self) -> None:
        if not self._is_halted:
            self._is_halted = True
            self._ports.simulation.drive_on(0.0)

    def _finish(self, how: str) -> None:
        """End the goal with a method of its handle, and let the robot stand."""
        self._goal = None
        self._ports.simulation.drive_on(0.0)
        self._over.set_result(how)
        if self._ports.node.executor is not None:
            self._ports.node.executor.wake()
