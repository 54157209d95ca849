"""What a drive tells of the stations it has passed: its feedback on the way, and its result."""

from __future__ import annotations

from typing import NoReturn

from autograder.examination.exam import Failed
from autograder.exercises.patterns.driving import Drive


def require_report(drive: Drive) -> None:
    """Wait for feedback with all stations up to the robot's, and with none further on.

    Raises:
        Failed: there is none, or it is ahead of the robot, or goes back, or some are left out.
    """
    drive.rig.wait_stepping(lambda: drive.latest_station >= drive.station or drive.run.done)
    drive.require_going_on()
    if drive.latest_station != drive.station or drive.heard != sorted(
        drive.heard, key=_last_station
    ):
        _fail_feedback(drive)
    if not _are_passed(drive, drive.heard[-1], drive.station):
        _fail_feedback(drive)


def require_no_further(drive: Drive) -> None:
    """Fail if the feedback is ahead of the robot, or the goal has ended."""
    if drive.latest_station > drive.station:
        _fail_feedback(drive)
    drive.require_going_on()


def require_result(drive: Drive) -> None:
    """Fail unless the result has the stations of the whole drive, in order."""
    passed = [int(number) for number in drive.run.result.sequence] if drive.run.result else []
    if not _are_passed(drive, passed, drive.goal):
        wanted = list(range(drive.start + 1, drive.goal + 1))
        raise Failed(
            expected=f"The result has the stations that were passed, in that order: {wanted}.",
            actual=f"From station {drive.start} to {drive.goal}, the result was {passed}.",
        )


def _fail_feedback(drive: Drive) -> NoReturn:
    lists = ", ".join(str(stations) for stations in drive.heard[-4:])
    said = f"The feedback so far was {lists}" if lists else "There was no feedback at all"
    so_far = list(range(drive.start + 1, drive.station + 1))
    raise Failed(
        expected="At each station the feedback tells all those that the robot has passed so "
        "far, in that order: the list grows, and its last number is that station. Here it is "
        f"{so_far}.",
        actual=f"{said}, {drive.moment_phrase}{drive.rig.error_note()}.",
    )


def _are_passed(drive: Drive, stations: list[int], last: int) -> bool:
    """Return whether ``stations`` are all up to the ``last``.

    Whether the one where the drive began counts as passed is a matter of taste.
    """
    passed = list(range(drive.start + 1, last + 1))
    return stations in (passed, [drive.start, *passed])


def _last_station(stations: list[int]) -> int:
    return max(stations, default=-1)
