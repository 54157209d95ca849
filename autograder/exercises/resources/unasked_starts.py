"""Starts of a driver that fail, in a plain program: nobody knows of them but the driver.

That a constructor has raised, and what it leaves, is otherwise seen in the student's process alone,
which is asked for it.
"""

from __future__ import annotations

from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_duties import DRIVER
from autograder.exercises.resources.ctrl_c import TRIED, seen_lives
from autograder.exercises.resources.rig import CameraRig


def require_nothing_left_unasked(rig: CameraRig) -> None:
    """Fail if failed starts leave something in a plain program in which a driver runs."""
    if (lives := seen_lives(rig)) is not None and lives.of_starts:
        raise Failed(
            expected=f"In a program of its own that has tried {TRIED} times to start a driver with "
            "a camera 'stuck', and has ended the one that works by Ctrl-C, nothing of them is "
            "left.",
            actual=lives.of_starts,
        )


def require_start_raises_unasked(rig: CameraRig) -> None:
    """Fail unless a plain program ends where its driver cannot start; nothing if there is none."""
    if rig.programs is None:
        return
    lives = seen_lives(rig)
    raises = lives.start_raises if lives is not None else None
    if raises is None:
        device = rig.new_device("unplugged")
        with rig.programs.program([(DRIVER, [device])]) as program:
            raises = rig.start_patience().wait(program.session, program.has_ended)
    if not raises:
        raise Failed(
            expected=f"{DRIVER}('unplugged') raises in a program of its own as well, which so "
            "ends.",
            actual="The program went on as if all were well.",
        )
