"""One navigation goal on its way, with the robot's wheels in the examiner's hands."""

from __future__ import annotations

from contextlib import suppress

from autograder.examination.check_context import SubjectGone
from autograder.examination.exam import Failed, NotExaminable
from autograder.examination.pictures.picture import Lane, Timeline
from autograder.exercises.patterns.robot import POSITION, Robot
from autograder.exercises.patterns.scenarios import SCENARIOS
from autograder.observe import Action
from autograder.observe.findings import add_picture
from autograder.observe.marks.marked_types import load_type
from autograder.observe.stepped_time.stepped_goal import SteppedGoal

SPEED_MARGIN = 0.011  # m/s
PART_OF_THE_WAY_M = 0.7
"""Of the metre between two stations: who rounds a position is at the next one too early."""
BEYOND_M = 0.04
"""Metres past a station where the robot says that it is there: it rarely says so just in time."""
STOOD_S = 1.0
"""Seconds of the node's clock without a new position that are worth a word."""
MAX_HALTS = 3
"""Times that a robot may be found halting where it had been driving a moment before."""
RAMP_S = 30.0
"""Seconds of the node's clock that a robot may take to come to its speed."""
MOST_DRAWN, SHORTEST_DRAWN_S = 40, 0.1
"""Feedback messages, and stretches of driving, in a picture; and seconds that it shows at least."""
CLEARING_S = 2.0
"""Seconds of wall time that a goal gets to end after its check has failed."""


class Drive:
    """A drive that was accepted.

    Attributes:
        start: the station at which it began, or which the robot had passed last then.
        station: the last one that the robot has come to since: what is reported before it has
            moved there is made up.
        goal: the station that was named.
        sent: the goal as its sender sees it.
    """

    def __init__(self, robot: Robot, goal: int) -> None:
        """Send the robot from where it is to station ``goal``."""
        self.robot, self.goal = robot, goal
        self.start = self.station = int(robot.position)
        self._since_s = self._began_s = robot.elapsed_s
        self._reached_s: list[float] = []
        robot.speeds.clear()
        action_type = load_type(robot.found.offers["navigation"]["action"])
        self.sent = SteppedGoal(
            robot,
            Action(SCENARIOS["navigation"].topic, action_type),
            action_type.Goal(order=goal),
            lambda message: [int(number) for number in message.sequence],
            f"With the robot at {robot.position:g} m, a goal for station {goal}",
        )

    def __enter__(self) -> Drive:
        """Return the drive, which the end of the block brings to an end if it goes on."""
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        """Leave nothing behind that the next drive would stumble over."""
        if isinstance(error, Failed):
            add_picture(error, self.draw)
        with suppress(Failed, NotExaminable, SubjectGone):
            if not self.sent.is_done:
                self.move_to(self.goal + BEYOND_M)
                self.robot.wait_stepping(lambda: self.sent.is_done, 1.0, CLEARING_S)
        self.sent.close()

    # The robot's way.

    @property
    def place_phrase(self) -> str:
        """Where the robot is, and for how long, as a phrase."""
        stood_s = self.robot.elapsed_s - self._since_s
        stood = f", where it has been for {stood_s:.0f} s of the node's clock,"
        way = f"on the way from station {self.start} to {self.goal}"
        return f"at {self.robot.position:g} m{stood if stood_s >= STOOD_S else ''} {way}"

    def roll_on(self) -> None:
        """Let the robot drive to the next station."""
        self.leave_station()
        self.station += 1
        self.move_to(self.station + BEYOND_M)
        self._reached_s.append(self.robot.elapsed_s)

    def leave_station(self) -> None:
        """Let the robot drive most of the way to the next station, if it has not yet."""
        self.move_to(max(self.robot.position, self.station + PART_OF_THE_WAY_M))

    def move_to(self, position: float) -> None:
        """Have the hardware report a ``position`` (m)."""
        self._since_s = self.robot.elapsed_s
        self.robot.report(POSITION, position)

    def draw(self) -> Timeline:
        """Return a picture of the drive so far: its stations and feedback, and when it moved."""
        begin_s, now_s = self._began_s, self.robot.elapsed_s
        seconds = max(now_s - begin_s, SHORTEST_DRAWN_S)
        turns = [
            (self.robot.clock_at(told.published_ns)[1] - begin_s, told.value != 0)
            for told in self.robot.speeds.publications
        ]
        changes = [turn for at, turn in enumerate(turns) if not at or turn[1] != turns[at - 1][1]]
        ends = [at for at, _ in changes[1:]] + [seconds]
        drives = [
            (max(at, 0.0), end, "busy")
            for (at, moves), end in zip(changes, ends, strict=True) if moves
        ][-MOST_DRAWN:]  # fmt: skip
        reports = [at - begin_s for at in self.sent.feedback_at_s][-MOST_DRAWN:]
        reached = [at - begin_s for at in self._reached_s]
        lanes = (
            Lane.of("the robot reaches a station", {"due": reached}),
            Lane.of("feedback of the goal", {"done": reports}),
            Lane.of("the motors are told", {}, drives),
            Lane.of("the goal", {"event": [seconds]}, [(0.0, seconds, "allowed")]),
        )
        legend = (
            ("busy", "to drive"),
            ("allowed", "is executed"),
            ("event", "has ended" if self.sent.is_done else "is still executed"),
        )  # fmt: skip
        title = f"The drive from station {self.start} to {self.goal}, by the node's clock"
        return Timeline(title, seconds, lanes, legend)

    # The motors.

    def require_driving(self) -> None:
        """Wait until the robot is commanded to drive.

        What was commanded before its last report may still hold, and a halt come just after.
        """
        robot = self.robot
        for _ in range(MAX_HALTS):
            drives = robot.wait_stepping(lambda: robot.speed > 0 or self.sent.is_done)
            robot.step(0.01)
            robot.drain()  # a goal that has ended here, not at the next station, is told so
            self.require_going_on()
            if robot.speed > 0:
                return
            if not drives:
                break
        said = "nothing" if robot.speeds.last is None else f"{robot.speed:g} m/s"
        raise Failed(
            expected="The robot drives until it is there: hardware/speed is more than 0.",
            actual=f"With the robot {self.place_phrase}, hardware/speed said {said}"
            f"{robot.error_note()}.",
        )

    def find_top_speed(self, limit: float) -> float:
        """Return the highest speed so far, once it is ``limit``; or the last, if it never is."""
        robot = self.robot
        reached = robot.wait_stepping(
            lambda: robot.speed >= limit - SPEED_MARGIN or self.sent.is_done, RAMP_S
        )
        highest = max(robot.speeds.values, default=0.0)
        return highest if reached or highest > limit + SPEED_MARGIN else robot.speed

    def require_speed(self, limit: float, also: str = "") -> None:
        """Require that the robot drives at ``limit`` (m/s), or comes to do so, and never faster."""
        found = self.find_top_speed(limit)
        if abs(found - limit) > SPEED_MARGIN:
            said = f"went up to {found:g} m/s" if found > limit else f"said {found:g} m/s"
            raise Failed(
                expected=f"With max_speed at {limit:g} m/s{also}, the robot drives at that.",
                actual=f"With the robot {self.place_phrase}, hardware/speed {said}.",
            )

    # What the sender hears.

    def require_going_on(self) -> None:
        """Require that the goal has not ended."""
        if self.sent.is_done:
            raise Failed(
                expected="The goal ends when the robot is there; while it is held up, it waits.",
                actual=f"With the robot {self.place_phrase}, it {self.sent.end_phrase}"
                f"{self.robot.error_note()}.",
            )

    def require_report(self) -> None:
        """Wait for feedback with all stations up to the robot's, and with none further on."""
        self.robot.wait_stepping(lambda: self._latest >= self.station or self.sent.is_done)
        self.require_going_on()
        self.require_no_further()
        told = [max(stations, default=-1) for stations in self.sent.feedback]
        grows = told == sorted(told) and told[-1:] == [self.station]
        self._require_feedback(grows and self._are_passed(self.sent.feedback[-1], self.station))

    def require_no_further(self) -> None:
        """Require that the feedback is not ahead of the robot, and the goal has not ended."""
        self._require_feedback(not self.is_ahead)
        self.require_going_on()

    def require_result(self) -> None:
        """Require that the result has the stations of the whole drive, in order."""
        result = self.sent.run.result
        passed = [int(number) for number in result.sequence] if result else []
        if not self._are_passed(passed, self.goal):
            wanted = list(range(self.start + 1, self.goal + 1))
            raise Failed(
                expected=f"The result has the stations that were passed, in that order: {wanted}.",
                actual=f"From station {self.start} to {self.goal}, the result was {passed}.",
            )

    @property
    def is_ahead(self) -> bool:
        """Whether the feedback has told of a station that the robot has not come to."""
        return self._latest > self.station

    @property
    def _latest(self) -> int:
        told = [number for stations in [*self.sent.feedback] for number in stations]
        return max(told, default=-1)

    def _are_passed(self, stations: list[int], last: int) -> bool:
        # Whether the one where the drive began counts as passed is a matter of taste.
        passed = list(range(self.start + 1, last + 1))
        return stations in (passed, [self.start, *passed])

    def _require_feedback(self, is_right: bool) -> None:
        if not is_right:
            lists = ", ".join(str(stations) for stations in self.sent.feedback[-4:])
            said = f"the feedback so far was {lists}" if lists else "there was no feedback at all"
            so_far = list(range(self.start + 1, self.station + 1))
            raise Failed(
                expected="At each station the feedback tells all those that the robot has passed "
                "so far, in that order: the list grows, and its last number is that station. Here "
                f"it is {so_far}.",
                actual=f"With the robot {self.place_phrase}, {said}{self.robot.error_note()}.",
            )
