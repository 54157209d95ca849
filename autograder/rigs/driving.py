"""One navigation goal on its way, with the robot's wheels in the examiner's hands."""

# mypy: allow-untyped-calls

from __future__ import annotations

import importlib
from concurrent.futures import Future
from contextlib import suppress
from typing import Any, NoReturn

from rclpy.qos import ReliabilityPolicy

from autograder.bench import SubjectGone
from autograder.exam import Failed
from autograder.rigs import filming, odometry
from autograder.rigs.listening import acquaint, hear_out
from autograder.rigs.robot import GRAIN, SETTLE, STEP, RobotRig
from autograder.rigs.scenarios import NAMES
from course import GoalRun, GoalState, WaitTimeout

NAME = NAMES["navigation"]
ACTIONS = "example_interfaces/action/Fibonacci or test_msgs/action/Fibonacci"
"""The chapter's Fibonacci, and what stands in for it on a machine without a compiler."""
FEEDBACK = f"{NAME}/_action/feedback"
SPEED_MARGIN = 0.011  # m/s
PART_OF_THE_WAY = 0.7
"""Of the metre between two stations: who rounds a position is at the next one too early."""
BLOCKED, BLOCKED_WALL = 1.2, 0.3
"""Seconds of the node's clock, and then on the wall, for which the robot cannot get on."""
WAITS = 5.0
"""Seconds of the node's clock for which it cannot get on in all: longer than a metre takes who
reckons by the time, and than the patience of who gives up."""
COARSE = 0.05
"""Seconds of the node's clock between two looks of those who wait all that time: a fifth as many
take a fifth of the time."""
FILMED = (8.0, 12.0)
"""Pictures a second, as far as such a short time tells."""
LOOKING, STOPPING, UNDER_WAY = 0.6, 4.0, 2.0
"""Seconds of wall time for those who look by the wall's clock whether they are called off, for a
stop to become visible, and for one that was under way when the result came."""
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
        self._listener = rig.node.listen(action.Impl.FeedbackMessage, FEEDBACK, self._hear)
        acquaint(rig)
        rig.node.speeds.clear()
        try:
            run = rig.answer(
                "a goal",
                lambda: rig.session.send_goal(
                    action, NAME, action.Goal(order=goal), timeout=SETTLE
                ),
            )
        except WaitTimeout:
            _require_feedback_for_all(rig)
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
        hear_out(rig)  # a goal that has ended here, not at the next station, is told so
        self._require_going_on()
        if rig.speed <= 0:
            speeds = "hardware/speed said nothing"
            if rig.node.speeds:
                speeds = f"hardware/speed said {rig.speed:g} m/s"
            raise Failed(
                expected="The robot drives until it is there: hardware/speed is more than 0.",
                actual=f"Speed {self.where}: {speeds}{rig.because()}.",
            )

    def top_speed(self, limit: float) -> float:
        """Return the highest speed so far, once it is ``limit``, or will not be."""
        rig = self._rig
        rig.wait_stepping(lambda: rig.speed >= limit - SPEED_MARGIN or self.run.done)
        return max(rig.node.speeds, default=0.0)

    def _require_going_on(self) -> None:
        if self.run.done:
            raise Failed(
                expected="The goal ends when the robot is there.",
                actual=f"It ended as {self.run.status.name} {self.where}{self._rig.because()}.",
            )

    def cancel_within(self, seconds: float) -> bool:
        """Ask for the goal to be cancelled; return whether the robot is told to stop in time.

        The time counts from the request on: the answer, too, may wait for the node's clock.

        Args:
            seconds: of the node's clock until the stop.

        Raises:
            Failed: the request was refused, or got no answer.
        """
        answer = self._rig.ask("to cancel", lambda: self.run.cancel(SETTLE))
        if answer.done():
            self._require_agreed(answer)
        in_time = self._stops_within(seconds)
        self._rig.wait_stepping(answer.done)
        self._require_agreed(answer)
        return in_time

    def _require_agreed(self, answer: Future[bool]) -> None:
        try:
            agreed = answer.result()
        except WaitTimeout:
            raise Failed(
                expected="A request to cancel a drive is answered.",
                actual=f"It got no answer, {self.where}{self._rig.because()}.",
            ) from None
        if not agreed:
            raise Failed(
                expected="A request to cancel a drive is accepted.",
                actual=f"It was refused, {self.where}{self._rig.because()}.",
            )

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
        stretch = filming.Stretch(self._rig)
        if self._rig.films:
            stretch.run(BLOCKED, sum(FILMED) / 2)
        else:
            self._go_by(BLOCKED)
        if self._rig.wait(lambda: self._latest > self.station, BLOCKED_WALL):
            self._complain()
        self._require_going_on()
        self._require_the_rest(stretch)
        self._go_by(WAITS - stretch.seconds, COARSE)
        hear_out(self._rig)
        if self._latest > self.station:
            self._complain()
        self._require_going_on()

    def _go_by(self, seconds: float, grain: float = GRAIN) -> None:
        for _ in range(round(seconds / STEP)):
            self._rig.step(STEP, grain)

    def _require_the_rest(self, stretch: filming.Stretch) -> None:
        """Fail if the drive holds up what worked without one: the camera, or the position.

        ``stretch`` is a part of the drive.
        """
        rig = self._rig
        where = self.where.replace("while", "While", 1)
        if rig.films:
            rates = stretch.rates()
            wrong = "" if rates is None else filming.rate_fault(rates, FILMED)
            if wrong or rates is None:
                came = f"they came at {wrong} a second" if wrong else "no picture came"
                raise Failed(
                    expected="While the robot drives, pictures come as they did before, 10 a "
                    "second: the drive holds nobody up.",
                    actual=f"{where}, {came}{rig.because()}.",
                )
        if rig.asker is None:
            return
        if answer := odometry.fault(rig, rig.asker, self.station + PART_OF_THE_WAY):
            raise Failed(
                expected="While the robot drives, whoever wants to know the position gets it, at "
                f"most {odometry.AGE:g} s old: the drive holds nobody up.",
                actual=f"{where}, at {self.station + PART_OF_THE_WAY:g} m, {answer}",
            )

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

    def _stops_within(self, seconds: float) -> bool:
        """Return whether the robot is told to stop in so many seconds of the node's clock.

        Who looks by the clock on the wall gets the time to do so before that one moves on.
        """

        def stopped() -> bool:
            return self._rig.speed == 0

        self._rig.wait(stopped, LOOKING)
        return self._rig.wait_stepping(stopped, seconds, STOPPING)

    def require_end(self, state: GoalState, expected: str, *, stopped: bool = False) -> None:
        """Wait for the end of the goal, and for the robot to stand still.

        Args:
            state: how the goal must end.
            expected: what is needed, as a sentence.
            stopped: whether the robot must stand when the result comes, not a while later.

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
        # Which of two messages comes first is the transport's affair: a stop may be under way.
        late = stopped and not rig.wait(lambda: rig.speed == 0, UNDER_WAY)
        told = rig.speed
        rig.wait_stepping(lambda: rig.speed == 0)
        rig.step(0.5)
        acquaint(rig)  # whatever was on its way has come in by now
        if not rig.node.speeds or rig.speed != 0:
            raise Failed(
                expected=f"{expected} The robot is told to stop: hardware/speed is 0.0.",
                actual=f"The goal ended as {state.name}, but the last speed that the motors were "
                f"told was {rig.speed:g} m/s: the robot drives on.",
            )
        if late:
            raise Failed(
                expected=f"{expected} The robot is told to stop first, and then the goal ends.",
                actual=f"The result came while the motors were still told {told:g} m/s; only later "
                "were they told to stop.",
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
        arrived = "At the station named the robot has arrived."
        self.require_end(GoalState.SUCCEEDED, arrived, stopped=True)

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


def _require_feedback_for_all(rig: RobotRig) -> None:
    """Fail if the feedback is published so that an ordinary client cannot hear it."""
    offers = rig.node.get_publishers_info_by_topic(FEEDBACK)
    if any(offer.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT for offer in offers):
        raise Failed(
            expected="Whoever sends a goal hears its feedback.",
            actual=f"The goal could not be sent: the feedback of {NAME} is BEST_EFFORT, and an "
            "ordinary client asks for RELIABLE.",
        )


def _last(stations: list[int]) -> int:
    return max(stations, default=-1)


def _action_type(name: str) -> Any:
    package, kind, cls = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), cls)
