"""How a drive ends: the robot has arrived, or was called off, and stands."""

from __future__ import annotations

import time
from concurrent.futures import Future

from autograder.examination.exam import Failed
from autograder.exercises.patterns.blocked_aisle import block_aisle, hold_before_goal
from autograder.exercises.patterns.discovery import wait_for_discovery
from autograder.exercises.patterns.driving import Drive
from autograder.exercises.patterns.rig import SETTLE, STEP
from autograder.exercises.patterns.stations import require_report
from autograder.observe.patience import IDLE_S
from autograder.observe.phrases import end_phrase
from course.errors import WaitTimeout
from course.runtime.requests.actions import GoalState

LOOKING, STOPPING, UNDER_WAY = 0.6, 4.0, 2.0
"""Seconds of wall time for those who look by the wall's clock whether they are called off, for a
stop to become visible, and for one that was under way when the result came."""
STOPS = 0.5
"""Seconds of the node's clock within which a robot that is called off is told to stop."""
WATCHED, STANDS, SELDOM = 2.0, 0.5, 0.25
"""Seconds of the node's clock: for which a cancelled robot must stay where it is; for which every
robot must at the end of a drive; and between two clock messages meanwhile."""


def to_the_end(drive: Drive, *, blocked: bool = False) -> None:
    """Let the robot drive to its goal, with a report at each station on the way.

    Args:
        drive: the drive.
        blocked: whether the aisle is blocked for a while after the first station, and for a
            moment just before the goal.

    Raises:
        Failed: it does not drive, does not report, or does not end as it should.
    """
    while drive.station < drive.goal:
        drive.require_driving()
        if blocked and drive.station == drive.goal - 1:
            hold_before_goal(drive)
        drive.roll_on()
        if drive.station < drive.goal:
            require_report(drive)
        if blocked and drive.station == drive.start + 1:
            block_aisle(drive)
    arrived = "At the station named the robot has arrived."
    require_end(drive, GoalState.SUCCEEDED, arrived, stopped=True)


def require_end(drive: Drive, state: GoalState, expected: str, *, stopped: bool = False) -> None:
    """Wait for the end of the goal, and for the robot to stand still, and stay so.

    Args:
        drive: the drive.
        state: how the goal must end.
        expected: what is needed, as a sentence.
        stopped: whether the robot must stand when the result comes, not a while later.

    Raises:
        Failed: it does not end, ends otherwise, or the robot goes on.
    """
    rig = drive.rig
    rig.wait_stepping(lambda: drive.run.done)
    if not drive.run.done or drive.run.status != state:
        how = end_phrase(drive.run.status.name) if drive.run.done else "went on and on"
        stood = drive.standstill_note
        if stood and not drive.run.done and state == GoalState.CANCELED:
            stood = (
                " It stood there all the time: does your node look whether a drive is called off "
                "only at the next station, or once the robot has moved?"
            )
        raise Failed(
            expected=f"{expected} The goal ends as {state.name}.",
            actual=f"The goal {how}, with the robot {drive.place_phrase}{rig.error_note()}.{stood}",
        )
    # Which of two messages comes first is the transport's affair: a stop may be under way.
    late = stopped and not rig.wait(lambda: rig.speed == 0, UNDER_WAY)
    told = rig.speed
    rig.wait_stepping(lambda: rig.speed == 0)
    if state == GoalState.CANCELED:
        rig.step(WATCHED, SELDOM)
    rig.step(STANDS, SELDOM)
    wait_for_discovery(rig)  # whatever was on its way has come in by now
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


def cancel_drive(drive: Drive, seconds: float, looking: float = LOOKING) -> int:
    """Ask for the goal to be cancelled, and let the robot have the time to be told to stop.

    The time counts from the request on: the answer, too, may wait for the node's clock.

    Args:
        drive: the drive.
        seconds: of the node's clock until the stop.
        looking: seconds of wall time before that clock moves on.

    Returns:
        When that time was over (ns): a stop that was told by then is in time, see `stopped_by`.

    Raises:
        Failed: the request was refused, or got no answer.
    """
    rig = drive.rig

    def stopped() -> bool:
        return rig.speed == 0

    answer, began = rig.submit_request("to cancel", lambda: drive.run.cancel(SETTLE)), rig.elapsed
    if answer.done():
        _require_agreed(drive, answer)
    else:
        rig.await_answer(answer, "to cancel", seconds)
    # Who looks by the clock on the wall gets the time to do so before the node's moves on.
    rig.wait(stopped, looking)
    while not stopped() and seconds - (rig.elapsed - began) > STEP / 2:
        rig.step(STEP)
    # The robot has had its time: only a message that is under way is waited for.
    rig.start_patience(STOPPING, stepped=IDLE_S).wait(rig.session, stopped)
    over = time.time_ns()
    rig.await_answer(answer, "to cancel")
    _require_agreed(drive, answer)
    return over


def stopped_by(drive: Drive, moment: int) -> bool:
    """Return whether the robot had been told to stop by a ``moment`` (ns), and nothing since."""
    speeds = drive.rig.node.speeds
    return drive.rig.speed == 0 and speeds.same_since <= moment


def _require_agreed(drive: Drive, answer: Future[bool]) -> None:
    try:
        agreed = answer.result()
    except WaitTimeout:
        raise Failed(
            expected="A request to cancel a drive is answered.",
            actual=f"It got no answer, {drive.moment_phrase}{drive.rig.error_note()}.",
        ) from None
    if not agreed:
        raise Failed(
            expected="A request to cancel a drive is accepted.",
            actual=f"It was refused, {drive.moment_phrase}{drive.rig.error_note()}.",
        )
