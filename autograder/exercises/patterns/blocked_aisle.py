"""A blocked aisle on a drive: its feedback stands still, and nothing else is held up."""

from __future__ import annotations

from autograder.exercises.patterns import camera_stream, unaffected_during_drive
from autograder.exercises.patterns.driving import Drive
from autograder.exercises.patterns.stations import require_no_further

FURTHER = (0.8, 0.9)
"""Parts of the way to which the robot creeps on, for who is content with less than all of it."""
BLOCKED, BLOCKED_WALL = 1.2, 0.3
"""Seconds of the node's clock, and at last on the wall, for which the robot cannot get on."""
WAITS, WAITS_ON = 5.0, 15.0
"""Seconds of the node's clock for which it cannot get on in all, and then once more: longer than a
metre takes who reckons by the time, and than the patience of who gives up."""
COARSE, COARSER = 0.2, 0.5
"""Seconds of the node's clock between two looks of those who wait all that time: the fewer, the
less time they take, and who has waited so long needs still fewer."""
NEAR, BEFORE_GOAL = 0.1, 0.6
"""Metres before the goal where the robot is held up, twice as far as a place may count as the
station, and for how many seconds of the node's clock."""


def block_aisle(drive: Drive) -> None:
    """Let the aisle be blocked before the next station, whatever the robot is told.

    Raises:
        Failed: the feedback goes on, so it does not look where the robot is, or not closely.
    """
    drive.leave_station()
    stretch = camera_stream.Stretch(drive.rig)
    if drive.rig.films:
        stretch.run(BLOCKED, sum(unaffected_during_drive.FILMED) / 2)
    else:
        drive.go_by(BLOCKED)
    require_no_further(drive)
    _require_the_rest(drive, stretch)
    drive.go_by(WAITS - BLOCKED, COARSE)
    require_no_further(drive)
    drive.go_by(WAITS_ON, COARSER)
    _wait_on_the_wall(drive)
    require_no_further(drive)


def hold_before_goal(drive: Drive) -> None:
    """Let the robot be held up just before its goal, so that it cannot be there yet.

    Raises:
        Failed: the goal counts as reached, or the robot drives no further.
    """
    drive.leave_station()
    drive.move_to(drive.goal - NEAR)
    drive.go_by(BEFORE_GOAL, COARSE)
    _wait_on_the_wall(drive)
    require_no_further(drive)
    drive.require_driving()


def _wait_on_the_wall(drive: Drive) -> None:
    """Give those who look by the wall's clock the time to get ahead of the robot."""
    drive.rig.wait(lambda: drive.latest_station > drive.station or drive.run.done, BLOCKED_WALL)


def _require_the_rest(drive: Drive, stretch: camera_stream.Stretch) -> None:
    """Fail if the drive, of which ``stretch`` is a part, holds up what worked without one."""
    where = drive.moment_phrase.replace("while", "While", 1)
    unaffected_during_drive.require_pictures(drive.rig, stretch, where)
    # Twice: a position that is looked up now and then may be right by chance, but then it has
    # just been looked up.
    for part in FURTHER:
        drive.move_to(drive.station + part)
        unaffected_during_drive.require_position(drive.rig, drive.position, where)
    unaffected_during_drive.require_battery(drive.rig, where)
    unaffected_during_drive.require_parameters(drive.rig, where)
