"""A navigator that fails on demand, and a dispatcher: the examiner's side of actions."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import AbstractContextManager
from typing import Any

from action_msgs.srv import CancelGoal
from geometry_msgs.msg import Twist
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Bool, Int32, String
from test_msgs.action import Fibonacci as Drive

from autograder.exercises.safety.counterpart import Player
from autograder.exercises.safety.deferred_replies import Held
from autograder.observe.quiet_node import QuietNode
from course.runtime.executor.background import BackgroundExecutor


class _PlainServer(ActionServer):
    """An action server that gives no result before `Player.pause` is over, and refuses clearly.

    Of a refused request to cancel rclpy only leaves the goal out of `goals_canceling`, and the code
    at ERROR_NONE. By the comments of action_msgs/srv/CancelGoal it has the code ERROR_REJECTED, as
    rclcpp's servers answer: a client may read either.
    """

    def __init__(
        self,
        node: Node,
        refuses: Callable[[], Awaitable[bool]],
        pause: Callable[[], Awaitable[None]],
        **options: Any,
    ) -> None:
        """Serve `navigate` of ``node``; ``refuses`` says of each request whether it is refused."""
        self._refuses, self._pause = refuses, pause
        super().__init__(node, Drive, "navigate", **options)

    async def _execute_cancel_request(self, request_header_and_message: Any) -> None:
        """Answer a refused request here; rclpy deals with one that is accepted."""
        if not await self._refuses():
            await super()._execute_cancel_request(request_header_and_message)
            return
        header, _request = request_header_and_message
        answer = CancelGoal.Response(return_code=CancelGoal.Response.ERROR_REJECTED)
        self._handle.send_cancel_response(header, answer)

    async def _execute_get_result_request(self, request_header_and_message: Any) -> None:
        """Wait with a result that is there already: see `Player.pause`."""
        await self._pause()
        await super()._execute_get_result_request(request_header_and_message)


class Navigator(QuietNode):
    """The server of `navigate`: takes goals and does with them what it is told to."""

    def __init__(self, user: NavigatorUser) -> None:
        """Serve; what arrives is noted with ``user``, who also decides what is accepted."""
        super().__init__("navigator")
        self._user = user
        self._server = _PlainServer(
            self, self._refuses_cancel, lambda: user.pause(self),
            execute_callback=lambda _: Drive.Result(),
            goal_callback=self._answer_goal, handle_accepted_callback=user.goals.append,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )  # fmt: skip

    async def _answer_goal(self, goal: Drive.Goal) -> GoalResponse:
        self._user.orders.append(goal.order)
        await self._user.pause(self)
        await self._user.delay_goal(self)
        return GoalResponse.ACCEPT if self._user.accepts else GoalResponse.REJECT

    async def _refuses_cancel(self) -> bool:
        self._user.cancels.append(self._user.now)
        await self._user.pause(self)
        await self._user.delay_cancel(self)
        return not self._user.obeys

    def destroy_node(self) -> None:
        """Take the server down, too: rclpy leaves it alive."""
        self._server.destroy()
        super().destroy_node()


class NavigatorUser(Player):
    """Asks for drives, plays the navigator, and listens to outcomes."""

    CLIENT = "NavigationClient"

    def __init__(self) -> None:
        """Create everything but the navigator."""
        super().__init__("navigator_user")
        self.accepts = self.obeys = True
        self.hesitates = self.ponders = False
        self.metres = 0
        self._undecided = Held()
        self.orders: list[int] = []
        self.goals: list[ServerGoalHandle] = []
        self.cancels: list[float] = []
        self.outcomes: list[str] = []
        self.before: list[str] = []  # the outcome of the request before this one, if there was any
        self.speeds: list[bool] = []
        self._request = self.add_publisher(Int32, "navigate/request")
        self.add_listener(
            String, "navigate/outcome", lambda message: self.outcomes.append(message.data)
        )
        self.add_listener(Twist, "cmd_vel", lambda message: self.speeds.append(is_motion(message)))

    def make_navigator(self) -> Navigator:
        """Return a navigator; it is for the session to run."""
        return Navigator(self)

    def request(
        self,
        metres: int,
        *,
        accepts: bool = True,
        obeys: bool = True,
        hesitates: bool = False,
        ponders: bool = False,
    ) -> None:
        """Ask for a drive that is accepted or not, and that can be cancelled or not.

        A navigator that ``hesitates`` answers the goal when it is told to `decide`, and one that
        ``ponders`` does so with the cancel.
        """
        self.before = self.outcomes[-1:]
        self.metres, self.accepts, self.obeys = metres, accepts, obeys
        self.hesitates, self.ponders = hesitates, ponders
        for noted in (self.orders, self.goals, self.cancels, self.outcomes, self.speeds):
            noted.clear()
        self._request.publish(Int32(data=metres))

    async def delay_goal(self, server: Node) -> None:
        """Let the navigator wait until it is to decide, if this goal is one of that kind."""
        if self.hesitates:
            await self._undecided.wait(server)

    async def delay_cancel(self, server: Node) -> None:
        """Do the same with a request to cancel."""
        if self.ponders:
            await self._undecided.wait(server)

    def decide(self) -> None:
        """Have the navigator answer the goal, or the request to cancel, that it has."""
        self._undecided.release()

    def send_feedback(self, metres: int) -> None:
        """Tell how far the drive has come."""
        marks = list(range(1, metres + 1))
        self.goals[0].publish_feedback(Drive.Feedback(sequence=marks))

    def end_goal(self, how: Callable[[ServerGoalHandle], None]) -> None:
        """End the goal with a method of its handle: succeed, abort or canceled."""

        def ending(goal: ServerGoalHandle) -> Drive.Result:
            how(goal)
            return Drive.Result()

        self.goals[0].execute(ending)


class Drives:
    """What became of one goal that was sent to the student's server."""

    def __init__(self) -> None:
        """Nothing yet."""
        self.began = 0.0
        self.handle: Any = None
        self.feedback: list[list[int]] = []
        self.fed: list[float] = []  # when, in simulated s
        self.canceling: bool | None = None
        self.status: int | None = None
        self.result: list[int] = []


class Dispatcher(Player):
    """Sends goals to the student's server, cancels them, jams the wheels, watches the speed."""

    SERVER = "NavigationServer"

    def __init__(self) -> None:
        """Create the client and ends of topics."""
        super().__init__("dispatcher")
        self.speeds: list[bool] = []
        self.commands: list[Twist] = []
        self.told: list[float] = []  # when each came, in simulated s
        self.faults: list[str] = []
        self._jam = self.add_publisher(Bool, "hardware/jammed")
        self.add_listener(Twist, "cmd_vel", self._note_command)
        self.add_listener(String, "drive/fault", lambda message: self.faults.append(message.data))
        self._client = ActionClient(self, Drive, "drive")
        for service in services_of("drive"):
            self.add_used_service(service)

    def _note_command(self, message: Twist) -> None:
        self.commands.append(message)
        self.told.append(self.now)
        self.speeds.append(is_motion(message))

    def jam_wheels(self, jammed: bool) -> None:
        """Jam the wheels, or free them."""
        self._jam.publish(Bool(data=jammed))

    def send(self, metres: int) -> Drives:
        """Send a goal; forgets what was before."""
        self.speeds.clear()
        self.commands.clear()
        self.told.clear()
        self.faults.clear()
        drive = Drives()

        def answered(future: Future) -> None:
            drive.handle = future.result()
            if drive.handle.accepted:
                drive.handle.get_result_async().add_done_callback(ended)

        def ended(future: Future) -> None:
            drive.result = list(future.result().result.sequence)
            drive.status = future.result().status

        def fed(message: Any) -> None:
            drive.feedback.append(list(message.feedback.sequence))
            drive.fed.append(self.now)

        with self._hold_answers():
            goal = self._client.send_goal_async(Drive.Goal(order=metres), fed)
        goal.add_done_callback(answered)
        return drive

    def cancel(self, drive: Drives) -> None:
        """Ask the server to cancel."""

        def answered(future: Future) -> None:
            drive.canceling = bool(future.result().goals_canceling)

        with self._hold_answers():
            canceling = drive.handle.cancel_goal_async()
        canceling.add_done_callback(answered)

    def _hold_answers(self) -> AbstractContextManager[None]:
        """Keep answers from being taken: rclpy registers a request after it has sent it."""
        assert isinstance(self.executor, BackgroundExecutor)
        return self.executor.hold_still()

    def missing_servers(self) -> list[str]:
        """Return whether the server is missing."""
        return [] if self._client.server_is_ready() else ["no action server of drive"]

    def destroy_node(self) -> None:
        """Take the client down, too: rclpy leaves it alive."""
        self._client.destroy()
        super().destroy_node()


def services_of(action: str) -> list[str]:
    """Return the services that an action is made of (ROS 2 design, "Actions")."""
    return [f"{action}/_action/{part}" for part in ("send_goal", "cancel_goal", "get_result")]


def is_motion(speed: Twist) -> bool:
    """Whether a Twist is anything but a stop; NaN is no stop."""
    parts = (speed.linear, speed.angular)
    return any(value != 0.0 for part in parts for value in (part.x, part.y, part.z))
