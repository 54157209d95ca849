"""The drive's server in a plain program of rclpy that calls its ``shutdown()`` in a drive.

A session calls it through the student's process, which so knows that it is looked at. A program
that is interrupted does it by itself, and what becomes of the robot is seen from outside.
"""

from __future__ import annotations

from autograder.examination.check_context import Bench
from autograder.examination.exam import Failed, NotExaminable
from autograder.exercises.safety import drive_goal
from autograder.exercises.safety.navigation import Dispatcher, Drives
from autograder.exercises.safety.plain_program_survival import (
    THREADS,
    Act,
    Part,
    Run,
    Stage,
    wait_until,
)
from autograder.observe.patience import Patience
from autograder.observe.stillness import Stillness

WHEN = "When the node runs in a program of its own, which calls shutdown() in a drive,"
SETTLES = 2 * drive_goal.ABORT  # s: here nothing has to be punctual


def require_shutdown(bench: Bench, still: Stillness) -> None:
    """Fail unless the robot then stands, and the drive is aborted; nothing where there are none."""
    if bench.programs is None:
        return
    drives: list[Drives] = []
    nodes = [(Dispatcher.SERVER, ())]
    with bench.programs.program(nodes, threads=THREADS, sim_time=True, shut_down=True) as program:
        if not program.up:  # though it was made when the harness asked for it
            raise NotExaminable(
                f"{Dispatcher.SERVER} could not be made in a program of its own. After a hand-in a "
                "person looks at it."
            )

        def on_the_way(dispatcher: Dispatcher, run: Run) -> Act:
            drive = dispatcher.send(drive_goal.LONGEST)
            yield from wait_until(lambda: any(dispatcher.speeds), SETTLES)
            if any(dispatcher.speeds):
                drives.append(drive)
                program.interrupt()
                Patience(still).wait(
                    program.session, lambda: not dispatcher.speeds[-1] or program.ended()
                )
                yield from wait_until(lambda: drive.status is not None, SETTLES)

        stage = Stage(
            program, still, [Part(Dispatcher.SERVER, Dispatcher, {"shutdown": on_the_way})]
        )
        stage.play()
        ended, dispatcher = program.ended(), stage.players[Dispatcher.SERVER]
    if not drives:
        return  # that it drives is another check's
    if ended:
        raise Failed(
            expected=f"{WHEN} shutdown() raises nothing.",
            actual="The program was gone: an exception left shutdown() or a callback.",
        )
    if dispatcher.speeds[-1]:
        raise Failed(
            expected=f"{WHEN} it stops the robot.",
            actual="The last Twist on cmd_vel told the robot to drive.",
        )
    if (how := drive_goal.WORDS.get(drives[0].status or 0, "not over")) != "aborted":
        raise Failed(
            expected=f"{WHEN} the drive is aborted.",
            actual=f"{SETTLES:g} s later it was {how}.",
        )
