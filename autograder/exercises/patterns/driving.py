"""One navigation goal on its way, with the robot's wheels in the examiner's hands."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from rclpy.qos import ReliabilityPolicy

from autograder.examination.check_context import SubjectGone
from autograder.examination.exam import Failed
from autograder.exercises.patterns.discovery import hear_out, wait_for_discovery
from autograder.exercises.patterns.rig import GRAIN, STEP, RobotRig
from autograder.exercises.patterns.scenarios import NAMES
from autograder.observe.marked_types import load_type
from autograder.observe.phrases import end_phrase
from course.errors import WaitTimeout
from course.runtime.requests.actions import GoalRun

NAME = NAMES["navigation"]
ACTIONS = "example_interfaces/action/Fibonacci or test_msgs/action/Fibonacci"
"""The chapter's Fibonacci, and what stands in for it on a machine without a compiler."""
FEEDBACK = f"{NAME}/_action/feedback"
SPEED_MARGIN = 0.011  # m/s
PART_OF_THE_WAY = 0.7
"""Of the metre between two stations: who rounds a position is at the next one too early."""
CLOSE = 0.15
"""Metres before a station from which on a place is told by its distance."""
BEYOND = 0.04
"""Metres past a station where the robot says that it is there: it rarely says so just in time."""
ROUNDING = 1e-6  # m
STOOD = 1.0
"""Seconds of the node's clock without a new position, after which the aisle counts as blocked."""
HALTS = 3
"""Times that a robot may be found halting where it had been driving a moment before."""
RAMP = 30.0
"""Seconds of the node's clock that a robot may take to come to its speed."""
CLEARING = 2.0
"""Seconds of wall time that a goal gets to end after its check has failed."""


class Drive:
    """A goal that was accepted, and what the one who sent it heard of it.

    ``station`` is the last one that the robot has come to: what is reported before it has moved
    there is made up. ``position`` is where the robot is (m), ``since`` the node's time (s) at which
    it has come there.
    """

    def __init__(self, rig: RobotRig, position: float, goal: int) -> None:
        """Put the robot at a ``position`` (m) and send it to station ``goal``.

        Raises:
            Failed: the goal was not accepted.
        """
        self.station = self.start = int(position)
        self.goal = goal
        self.heard: list[list[int]] = []
        self.rig = rig
        self.move_to(float(position))
        action = load_type(rig.memory["offers"]["navigation"]["action"])
        self._listener = rig.node.listen(action.Impl.FeedbackMessage, FEEDBACK, self._note_feedback)
        wait_for_discovery(rig)
        rig.node.speeds.clear()
        try:
            run = rig.run_request(
                "a goal",
                lambda: rig.session.send_goal(
                    action, NAME, action.Goal(order=goal), timeout=rig.settle
                ),
            )
        except WaitTimeout:
            _require_feedback_for_all(rig)
            raise Failed(
                expected=f"A goal on {NAME} is accepted at once; the drive itself comes after.",
                actual=f"The goal (station {goal}) got no answer{rig.error_note()}.",
            ) from None
        if not run.accepted:
            raise Failed(
                expected=f"A goal on {NAME} for a station further along the line is accepted.",
                actual=f"With the robot {self.place_phrase}, station {goal} was rejected.",
            )
        self.run: GoalRun = run

    def _note_feedback(self, message: Any) -> None:
        self.heard.append([int(number) for number in message.feedback.sequence])

    def __enter__(self) -> Drive:
        """Return the drive, which the end of the block brings to an end if it goes on."""
        return self

    def __exit__(self, *_: object) -> None:
        """Leave nothing behind that the next drive would stumble over."""
        with suppress(Failed, SubjectGone):
            if not self.run.done:
                self.move_to(self.goal + BEYOND)
                self.rig.wait_stepping(lambda: self.run.done, 1.0, CLEARING)
        self.rig.node.destroy_subscription(self._listener)

    @property
    def moment_phrase(self) -> str:
        """When something was seen, by the robot's place, as a phrase."""
        return f"while the robot was {self.place_phrase} on the way to {self.goal}"

    @property
    def place_phrase(self) -> str:
        """The robot's place, between the stations or at one, as a phrase."""
        if not self.is_between_stations:
            return f"at station {self.station}"
        if (left := self.station + 1 - self.position) < CLOSE:
            return f"{left:.2g} m before station {self.station + 1}"
        return f"between stations {self.station} and {self.station + 1}"

    @property
    def is_between_stations(self) -> bool:
        """Whether the robot is between two stations."""
        return self.position - self.station > PART_OF_THE_WAY - ROUNDING

    @property
    def standstill_note(self) -> str:
        """For how long a blocked aisle has held the robot up by now, as a sentence; or nothing."""
        seconds = self.rig.elapsed - self.since
        if not self.is_between_stations or seconds < STOOD:
            return ""
        return (
            f" The robot had stood there for {seconds:.0f} s of the node's time, as in a blocked "
            "aisle."
        )

    def require_driving(self) -> None:
        """Wait until the robot is commanded to drive.

        What was commanded before its last report may still hold, and a halt come just after.

        Raises:
            Failed: it is not, or the goal has ended.
        """
        rig, stood = (
            self.rig,
            self.standstill_note,
        )  # from now on it stands if it is not told to drive
        for _ in range(HALTS):
            drives = rig.wait_stepping(lambda: rig.speed > 0 or self.run.done)
            rig.step(0.01)
            hear_out(rig)  # a goal that has ended here, not at the next station, is told so
            self.require_going_on()
            if rig.speed > 0:
                return
            if not drives:
                break
        speeds = f"said {rig.speed:g} m/s" if rig.node.speeds else "said nothing"
        raise Failed(
            expected="The robot drives until it is there: hardware/speed is more than 0.",
            actual=f"Speed {self.moment_phrase}: hardware/speed {speeds}{rig.error_note()}.{stood}",
        )

    def top_speed(self, limit: float) -> float:
        """Return the highest speed so far, once it is ``limit``; or the last, if it never is."""
        rig = self.rig
        reached = rig.wait_stepping(
            lambda: rig.speed >= limit - SPEED_MARGIN or self.run.done, RAMP
        )
        highest = max(rig.node.speeds, default=0.0)
        return highest if reached or highest > limit + SPEED_MARGIN else rig.speed

    def require_speed(self, limit: float, expected: str) -> None:
        """Fail unless the robot drives at ``limit`` (m/s), or comes to do so, and never faster."""
        found = self.top_speed(limit)
        if abs(found - limit) > SPEED_MARGIN:
            said = f"went up to {found:g} m/s" if found > limit else f"said {found:g} m/s"
            raise Failed(
                expected=f"{expected} the robot drives at {limit:g} m/s.",
                actual=f"Speed {self.moment_phrase}: hardware/speed {said}.",
            )

    def require_going_on(self) -> None:
        """Fail if the goal has ended."""
        if self.run.done:
            waits = " While the aisle is blocked, the robot waits." if self.standstill_note else ""
            how = end_phrase(self.run.status.name)
            raise Failed(
                expected=f"The goal ends when the robot is there.{waits}",
                actual=f"It {how} "
                f"{self.moment_phrase}{self.rig.error_note()}.{self.standstill_note}",
            )

    def roll_on(self) -> None:
        """Let the robot drive to the next station."""
        self.leave_station()
        self.station += 1
        self.move_to(self.station + BEYOND)

    def leave_station(self) -> None:
        """Let the robot drive most of the way to the next station, if it has not yet."""
        self.move_to(max(self.position, self.station + PART_OF_THE_WAY))

    def move_to(self, position: float) -> None:
        """Have the hardware report a ``position`` (m)."""
        self.position, self.since = position, self.rig.elapsed
        self.rig.report("position", position)

    def go_by(self, seconds: float, grain: float = GRAIN) -> None:
        """Let so many seconds of the node's clock go by, and hear what is said in them."""
        step = max(STEP, grain)
        for _ in range(round(seconds / step)):
            self.rig.step(step, grain)
        hear_out(self.rig)

    @property
    def latest_station(self) -> int:
        """The furthest station that the feedback has told of; -1 if there was none."""
        return max((number for stations in list(self.heard) for number in stations), default=-1)


def _require_feedback_for_all(rig: RobotRig) -> None:
    """Fail if the feedback is published so that an ordinary client cannot hear it."""
    offers = rig.node.get_publishers_info_by_topic(FEEDBACK)
    if any(offer.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT for offer in offers):
        raise Failed(
            expected="Whoever sends a goal hears its feedback.",
            actual=f"The goal could not be sent: the feedback of {NAME} is BEST_EFFORT, and an "
            "ordinary client asks for RELIABLE.",
        )
