"""One navigation goal on its way, with the robot's wheels in the examiner's hands."""

# mypy: allow-untyped-calls

from __future__ import annotations

import importlib
from contextlib import suppress
from typing import Any, NoReturn

from rcl_interfaces.srv import GetParameters

from autograder.bench import SubjectGone
from autograder.exam import Failed
from autograder.rigs.robot import SETTLE, RobotRig
from autograder.rigs.scenarios import NAMES
from course import GoalRun, GoalState, WaitTimeout

NAME = NAMES["navigation"]
ACTIONS = "example_interfaces/action/Fibonacci or test_msgs/action/Fibonacci"
"""The chapter's Fibonacci, and what stands in for it on a machine without a compiler."""
PART_OF_THE_WAY = 0.7
"""Of the metre between two stations: who rounds a position is at the next one too early."""
BLOCKED, BLOCKED_WALL = 12, 0.3
"""Steps of the node's clock, and then seconds on the wall, for which the robot cannot get on."""
LOOKING, STOPPING = 0.6, 4.0
"""Seconds of wall time for those who look by the wall's clock whether they are called off, and for
a stop to become visible."""
CLEARING = 2.0
"""Seconds of wall time that a goal gets to end after its check has failed."""


class Drive:
    """A goal that was accepted, and what the one who sent it heard of it.

    ``station`` is where the robot is: what is reported before it has moved there is made up.
    """

    def __init__(self, rig: RobotRig, start: int, goal: int) -> None:
        """Put the robot at station ``start`` and send it to station ``goal``.

        Raises:
            Failed: the goal was not accepted.
        """
        self.station, self.start, self.goal = start, start, goal
        self._between = False
        self.heard: list[list[int]] = []
        self._rig = rig
        rig.report("position", float(start))
        action = _action_type(rig.memory["offers"]["navigation"]["action"])
        self._listener = rig.node.listen(
            action.Impl.FeedbackMessage, f"{NAME}/_action/feedback", self._hear
        )
        _acquaint(rig)
        rig.node.speeds.clear()
        try:
            run = rig.session.send_goal(action, NAME, action.Goal(order=goal), timeout=SETTLE)
        except WaitTimeout:
            raise Failed(
                expected=f"A goal on {NAME} is accepted at once; the drive itself comes after.",
                actual=f"The goal (station {goal}) got no answer{rig.because()}.",
            ) from None
        if not run.accepted:
            raise Failed(
                expected=f"A goal on {NAME} for a station further along the line is accepted.",
                actual=f"With the robot at station {start}, station {goal} was rejected.",
            )
        self.run: GoalRun = run

    def _hear(self, message: Any) -> None:
        self.heard.append([int(number) for number in message.feedback.sequence])

    def __enter__(self) -> Drive:
        """Return the drive, which the end of the block brings to an end if it goes on."""
        return self

    def __exit__(self, *_: object) -> None:
        """Leave nothing behind that the next drive would stumble over."""
        with suppress(Failed, SubjectGone):
            if not self.run.done:
                self._rig.report("position", float(self.goal))
                self._rig.wait_stepping(lambda: self.run.done, 1.0, CLEARING)
        self._rig.node.destroy_subscription(self._listener)

    @property
    def where(self) -> str:
        """The robot's place, as a phrase."""
        place = f"at station {self.station}"
        if self._between:
            place = f"between stations {self.station} and {self.station + 1}"
        return f"while the robot was {place} on the way to {self.goal}"

    def require_driving(self) -> None:
        """Wait until the robot is commanded to drive.

        Raises:
            Failed: it is not, or the goal has ended.
        """
        rig = self._rig
        rig.wait_stepping(lambda: rig.speed > 0 or self.run.done)
        rig.step(0.01)
        _hear_out(rig)  # a goal that has ended here, not at the next station, is told so
        self._require_going_on()
        if rig.speed <= 0:
            speeds = "hardware/speed said nothing"
            if rig.node.speeds:
                speeds = f"hardware/speed said {rig.speed:g} m/s"
            raise Failed(
                expected="The robot drives until it is there: hardware/speed is more than 0.",
                actual=f"Speed {self.where}: {speeds}{rig.because()}.",
            )

    def _require_going_on(self) -> None:
        if self.run.done:
            raise Failed(
                expected="The goal ends when the robot is there.",
                actual=f"It ended as {self.run.status.name} {self.where}{self._rig.because()}.",
            )

    def cancel(self) -> bool:
        """Ask for the goal to be cancelled; return whether that was agreed to.

        Raises:
            Failed: there was no answer.
        """
        try:
            return self.run.cancel(SETTLE)
        except WaitTimeout:
            raise Failed(
                expected="A request to cancel a drive is answered.",
                actual=f"It got no answer, {self.where}{self._rig.because()}.",
            ) from None

    def roll_on(self) -> None:
        """Let the robot drive to the next station."""
        self._leave()
        self.station += 1
        self._between = False
        self._rig.report("position", float(self.station))

    def _leave(self) -> None:
        self._between = True
        self._rig.report("position", self.station + PART_OF_THE_WAY)

    def require_report(self) -> None:
        """Wait for feedback that says that the robot is at its station, and at none further on.

        Raises:
            Failed: there is none, or it is ahead of the robot, or goes back.
        """
        self._rig.wait_stepping(lambda: self._latest >= self.station or self.run.done)
        if self._latest == self.station and self.heard == sorted(self.heard, key=_last):
            self._require_going_on()
            return
        self._require_going_on()
        self._complain()

    def hold(self) -> None:
        """Let the aisle be blocked before the next station, whatever the robot is told.

        Raises:
            Failed: the feedback goes on, so it does not look where the robot is, or not closely.
        """
        self._leave()
        for _ in range(BLOCKED):
            self._rig.step()
        if self._rig.wait(lambda: self._latest > self.station, BLOCKED_WALL):
            self._complain()
        self._require_going_on()

    def _complain(self) -> NoReturn:
        lists = ", ".join(str(stations) for stations in self.heard[-4:])
        said = f"The feedback so far was {lists}" if lists else "There was no feedback at all"
        raise Failed(
            expected="At each station the feedback tells which ones the robot has passed so far: "
            "the list grows, and its last number is that station.",
            actual=f"{said}, {self.where}{self._rig.because()}.",
        )

    @property
    def _latest(self) -> int:
        return max((number for stations in list(self.heard) for number in stations), default=-1)

    def stops_within(self, seconds: float) -> bool:
        """Return whether the robot is told to stop in so many seconds of the node's clock.

        Who looks by the clock on the wall gets the time to do so before that one moves on.
        """

        def stopped() -> bool:
            return self._rig.speed == 0

        self._rig.wait(stopped, LOOKING)
        return self._rig.wait_stepping(stopped, seconds, STOPPING)

    def require_end(self, state: GoalState, expected: str) -> None:
        """Wait for the end of the goal, and for the robot to stand still.

        Args:
            state: how the goal must end.
            expected: what is needed, as a sentence.

        Raises:
            Failed: it does not end, ends otherwise, or the robot goes on.
        """
        rig = self._rig
        rig.wait_stepping(lambda: self.run.done)
        if not self.run.done or self.run.status != state:
            how = f"ended as {self.run.status.name}" if self.run.done else "went on and on"
            raise Failed(
                expected=f"{expected} The goal ends as {state.name}.",
                actual=f"The goal {how}, {self._place}{rig.because()}.",
            )
        rig.wait_stepping(lambda: rig.speed == 0)
        rig.step(0.5)
        _acquaint(rig)  # whatever was on its way has come in by now
        if not rig.node.speeds or rig.speed != 0:
            raise Failed(
                expected=f"{expected} The robot is told to stop: hardware/speed is 0.0.",
                actual=f"The goal ended as {state.name}, but the last speed that the motors were "
                f"told was {rig.speed:g} m/s: the robot drives on.",
            )

    @property
    def _place(self) -> str:
        return f"with the robot at station {self.station}"

    def to_the_end(self) -> None:
        """Let the robot drive to its goal, with a report at each station on the way.

        Raises:
            Failed: it does not drive, does not report, or does not end as it should.
        """
        while self.station < self.goal:
            self.require_driving()
            self.roll_on()
            if self.station < self.goal:
                self.require_report()
            if self.station == self.start + 1 < self.goal:
                self.hold()
        self.require_end(GoalState.SUCCEEDED, "At the station named the robot has arrived.")

    def require_result(self) -> None:
        """Fail unless the result has the stations of the whole drive, in order."""
        passed = [int(number) for number in self.run.result.sequence] if self.run.result else []
        wanted = list(range(self.start + 1, self.goal + 1))
        # Whether the station where it began counts as passed is a matter of taste.
        if passed not in (wanted, [self.start, *wanted]):
            raise Failed(
                expected=f"The result has the stations that were passed: {wanted}.",
                actual=f"From station {self.start} to {self.goal}, the result was {passed}.",
            )


def _last(stations: list[int]) -> int:
    return max(stations, default=-1)


def _action_type(name: str) -> Any:
    package, kind, cls = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), cls)


def _acquaint(rig: RobotRig) -> None:
    """Return when the subject knows every endpoint that the examiner has made so far.

    DDS makes endpoints known in the order in which they were made. So once a client that is newer
    than all of them gets an answer, the subject's writers know the earlier readers, too.
    """
    if name := _answering(rig):
        client = rig.node.create_client(GetParameters, name)
        if rig.wait(client.service_is_ready):
            rig.wait(client.call_async(GetParameters.Request()).done)
        rig.node.destroy_client(client)


def _hear_out(rig: RobotRig) -> None:
    """Return when what the subject has sent so far has come in: it has answered since."""
    if name := _answering(rig):
        rig.call(GetParameters, name, GetParameters.Request())


def _answering(rig: RobotRig) -> str | None:
    """Return a service that every node of the subject's has, unless it was made without."""
    for name, types in rig.node.get_service_names_and_types():
        if types == ["rcl_interfaces/srv/GetParameters"] and rig.node.count_services(name):
            return name
    return None
