"""The drive's server in a plain program of rclpy that calls its ``shutdown()``.

A session calls it through the student's process, which so knows that it is looked at. A program
that is interrupted does it by itself, and what becomes of the robot is seen from outside: in a
drive, and with nothing to do. The latter is seen at the end of the program that shows whether
anything ends it, if nothing has; else in a second life of the node that was shut down in a drive.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import Failed, NotExaminable
from autograder.examination.plain_programs import Program
from autograder.exercises.safety import drive_goal
from autograder.exercises.safety.navigation import Dispatcher, Drives
from autograder.exercises.safety.plain_program_stage import (
    MEET_IDLE_S,
    THREADS,
    Act,
    Part,
    Run,
    Stage,
    wait_until,
)
from autograder.observe.patience import Patience
from autograder.observe.stillness import Stillness

WHEN = "When the node runs in a program of its own, which calls shutdown()"
ON_THE_WAY, IDLE = "in a drive", "while no goal is under way"
SETTLES = 2 * drive_goal.ABORT  # s: here nothing has to be punctual
AT_ONCE_S = 1.0  # of wall time in which all sleep, and nothing stops the wheels: something waits
AFTERWARDS = 2  # m of a goal that comes after shutdown(), and s in which it would drive


class Shutdowns:
    """What became of the robot at the shutdowns that were seen, and of the program."""

    def __init__(self, still: Stillness) -> None:
        """Nothing has been seen yet; ``still`` tells when all have come to rest."""
        self._still = still
        self._when = ""  # the program was told to call it, if it was
        self._late: list[str] = []  # when the stop came late
        self._wrong: dict[str, Failed] = {}  # by when it was told to
        self._seen = set[str]()

    def watch_idle(self, program: Program, stage: Stage) -> None:
        """Have it called with nothing to do, in a program whose nodes have done what they had."""
        stage.play_more(Dispatcher.SERVER, partial(self._while_idle, program))
        self._note_end(program)

    def watch_all(self, program: Program) -> None:
        """Have it called in a drive, and then with nothing to do, unless that has been seen."""
        acts = {
            ON_THE_WAY: partial(self._on_the_way, program),
            IDLE: partial(self._while_idle, program),
        }
        Stage(program, self._still, [Part(Dispatcher.SERVER, Dispatcher, acts)]).play()
        self._note_end(program)

    def _note_end(self, program: Program) -> None:
        if self._when and program.has_ended():
            self._note_fault(
                "it raises nothing.",
                "The program was gone: an exception left shutdown() or a callback.",
            )
        self._when = ""

    def require_right(self) -> None:
        """Fail if something was wrong."""
        for when in (ON_THE_WAY, IDLE):
            if when in self._wrong:
                raise self._wrong[when]
        if len(self._late) > 1:
            raise Failed(
                expected=f"{WHEN}, it stops the wheels at once.",
                actual=f"{' and '.join(self._late).capitalize()}, the zero Twist on cmd_vel came "
                f"more than {AT_ONCE_S:g} s later.",
            )
        if self._late or not self._seen >= {ON_THE_WAY, IDLE}:
            raise NotExaminable(
                "It could not be seen in a program of its own that shutdown() stops the wheels at "
                "once, in a drive and without one. After a hand-in a person looks at it."
            )

    def _on_the_way(self, program: Program, dispatcher: Dispatcher, run: Run) -> Act:
        drive = dispatcher.send(drive_goal.LONGEST)
        yield from wait_until(lambda: any(dispatcher.speeds), SETTLES)
        if not any(dispatcher.speeds):
            self._seen |= {ON_THE_WAY, IDLE}  # that it drives is another check's
            return
        self._shut_down(program, ON_THE_WAY, lambda: not dispatcher.speeds[-1])
        stopped = len(dispatcher.speeds)
        yield from wait_until(lambda: drive.status is not None, SETTLES)
        self._require_aborted(dispatcher, drive, stopped)
        yield from self._goal_afterwards(dispatcher)
        self._seen.add(ON_THE_WAY)
        if IDLE in self._seen:
            return
        self._when = ""
        program.interrupt()  # it is ended, and then made anew
        self._wait_until(program, dispatcher.describe_missing)
        program.interrupt()
        self._wait_until(program, lambda: not dispatcher.describe_missing())
        # It may be known here before it knows of anybody, see `Stage`.
        Patience(self._still, idle=MEET_IDLE_S).wait(program.session, lambda: False)

    def _while_idle(self, program: Program, dispatcher: Dispatcher, run: Run) -> Act:
        if IDLE in self._seen or dispatcher.describe_missing():
            return
        dispatcher.speeds.clear()
        self._shut_down(program, IDLE, lambda: dispatcher.speeds)
        if dispatcher.speeds[-1:] != [False]:
            self._note_fault(
                "it stops the wheels: a zero Twist on cmd_vel.",
                "The last Twist on cmd_vel told the robot to drive."
                if dispatcher.speeds
                else "Nothing came on cmd_vel.",
            )
        yield from self._goal_afterwards(dispatcher)
        self._seen.add(IDLE)

    def _wait_until(
        self, program: Program, condition: Callable[[], object], idle: float | None = None
    ) -> bool:
        patience = Patience(self._still) if idle is None else Patience(self._still, idle=idle)
        return patience.wait(program.session, lambda: condition() or program.has_ended())

    def _shut_down(self, program: Program, when: str, stopped: Callable[[], object]) -> None:
        """Have it called, and wait until the wheels are told to stop."""
        self._when = when
        program.interrupt()
        if not self._wait_until(program, stopped, AT_ONCE_S) and self._wait_until(program, stopped):
            self._late.append(when)  # or a message was lost, and sent again

    def _require_aborted(self, dispatcher: Dispatcher, drive: Drives, stopped: int) -> None:
        if dispatcher.speeds[-1]:
            self._note_fault(
                "it stops the robot.", "The last Twist on cmd_vel told the robot to drive."
            )
        if any(dispatcher.speeds[stopped:]):
            self._note_fault(
                "the wheels are told nothing any more but to stop.",
                "Before the goal was aborted they were told to drive again.",
            )
        if (how := drive_goal.WORDS.get(drive.status or 0, "not over")) != "aborted":
            self._note_fault("the drive is aborted.", f"{SETTLES:g} s later it was {how}.")

    def _goal_afterwards(self, dispatcher: Dispatcher) -> Act:
        """Send a goal: whatever is answered, nothing moves."""
        dispatcher.send(AFTERWARDS)
        yield from wait_until(lambda: any(dispatcher.speeds), AFTERWARDS)
        if any(dispatcher.speeds):
            self._note_fault(
                "the wheels are told nothing any more but to stop.",
                f"A goal of {AFTERWARDS} m that came afterwards drove the robot.",
            )

    def _note_fault(self, expected: str, actual: str) -> None:
        wrong = Failed(expected=f"{WHEN} {self._when}, {expected}", actual=actual)
        self._wrong.setdefault(self._when, wrong)


def require_shutdown(bench: CheckContext, still: Stillness, shutdowns: Shutdowns | None) -> None:
    """Fail unless the robot stands after a shutdown, whenever it comes, and a drive is aborted.

    Nothing where there are no programs. ``shutdowns`` are what has been seen of them by now.
    """
    if bench.programs is None:
        return
    shutdowns = shutdowns or Shutdowns(still)
    nodes = [(Dispatcher.SERVER, ())]
    with bench.programs.program(nodes, threads=THREADS, sim_time=True, shut_down=True) as program:
        if not program.up:  # though it was made when the harness asked for it
            raise NotExaminable(
                f"{Dispatcher.SERVER} could not be made in a program of its own. After a hand-in a "
                "person looks at it."
            )
        shutdowns.watch_all(program)
    shutdowns.require_right()
