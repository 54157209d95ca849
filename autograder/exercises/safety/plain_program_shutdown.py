"""The drive's server in a plain program of rclpy that calls its ``shutdown()``.

A session calls it through the student's process, which so knows that it is looked at. A program
that is interrupted does it by itself, and what becomes of the robot is seen from outside: in the
first life of the node in a drive, in the second with nothing to do.
"""

from __future__ import annotations

from collections.abc import Callable

from autograder.examination.check_context import Bench
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


def require_shutdown(bench: Bench, still: Stillness) -> None:
    """Fail unless the robot then stands, and the drive is aborted; nothing where there are none."""
    if bench.programs is None:
        return
    nodes = [(Dispatcher.SERVER, ())]
    with bench.programs.program(nodes, threads=THREADS, sim_time=True, shut_down=True) as program:
        if not program.up:  # though it was made when the harness asked for it
            raise NotExaminable(
                f"{Dispatcher.SERVER} could not be made in a program of its own. After a hand-in a "
                "person looks at it."
            )
        watched = _Watched(program, still)
        acts = {ON_THE_WAY: watched.on_the_way, IDLE: watched.idle}
        Stage(program, still, [Part(Dispatcher.SERVER, Dispatcher, acts)]).play()
        watched.require_right(program.ended())


class _Watched:
    """What becomes of the robot, in the two lives of a node in a program."""

    def __init__(self, program: Program, still: Stillness) -> None:
        """Nothing has been seen yet."""
        self._program, self._still = program, still
        self._when = ""  # the program was told to call it, if it was
        self._late: list[str] = []  # when the stop came late
        self._wrong: Failed | None = None
        self._known = False  # whether all was seen that there is to see

    def require_right(self, ended: bool) -> None:
        """Fail if something was wrong; ``ended`` is whether the program has."""
        if self._wrong:
            raise self._wrong
        if ended and self._when:
            raise Failed(
                expected=f"{WHEN} {self._when}, it raises nothing.",
                actual="The program was gone: an exception left shutdown() or a callback.",
            )
        if len(self._late) > 1:
            raise Failed(
                expected=f"{WHEN}, it stops the wheels at once.",
                actual=f"{' and '.join(self._late).capitalize()}, the zero Twist on cmd_vel came "
                f"more than {AT_ONCE_S:g} s later.",
            )
        if self._late or not self._known:
            raise NotExaminable(
                "It could not be seen in a program of its own that shutdown() stops the wheels at "
                "once, in a drive and without one. After a hand-in a person looks at it."
            )

    def on_the_way(self, dispatcher: Dispatcher, run: Run) -> Act:
        """Have it called in a drive; then end the node, and have it made anew."""
        drive = dispatcher.send(drive_goal.LONGEST)
        yield from wait_until(lambda: any(dispatcher.speeds), SETTLES)
        if not any(dispatcher.speeds):
            self._known = True  # that it drives is another check's
            return
        self._shut_down(ON_THE_WAY, lambda: not dispatcher.speeds[-1])
        stopped = len(dispatcher.speeds)
        yield from wait_until(lambda: drive.status is not None, SETTLES)
        self._require_aborted(dispatcher, drive, stopped)
        yield from self._goal_afterwards(dispatcher)
        self._when = ""
        self._program.interrupt()
        self._comes(dispatcher.missing)
        self._program.interrupt()
        self._comes(lambda: not dispatcher.missing())
        # It may be known here before it knows of anybody, see `Stage`.
        Patience(self._still, idle=MEET_IDLE_S).wait(self._program.session, lambda: False)

    def idle(self, dispatcher: Dispatcher, run: Run) -> Act:
        """Have it called with nothing to do."""
        if self._known or dispatcher.missing():
            return
        dispatcher.speeds.clear()
        self._shut_down(IDLE, lambda: dispatcher.speeds)
        if dispatcher.speeds[-1:] != [False]:
            self._note(
                "it stops the wheels: a zero Twist on cmd_vel.",
                "The last Twist on cmd_vel told the robot to drive."
                if dispatcher.speeds
                else "Nothing came on cmd_vel.",
            )
        yield from self._goal_afterwards(dispatcher)
        self._known = True

    def _comes(self, condition: Callable[[], object], idle: float | None = None) -> bool:
        patience = Patience(self._still) if idle is None else Patience(self._still, idle=idle)
        return patience.wait(self._program.session, lambda: condition() or self._program.ended())

    def _shut_down(self, when: str, stopped: Callable[[], object]) -> None:
        """Have it called, and wait until the wheels are told to stop."""
        self._when = when
        self._program.interrupt()
        if not self._comes(stopped, AT_ONCE_S) and self._comes(stopped):
            self._late.append(when)  # or a message was lost, and sent again

    def _require_aborted(self, dispatcher: Dispatcher, drive: Drives, stopped: int) -> None:
        if dispatcher.speeds[-1]:
            self._note("it stops the robot.", "The last Twist on cmd_vel told the robot to drive.")
        if any(dispatcher.speeds[stopped:]):
            self._note(
                "the wheels are told nothing any more but to stop.",
                "Before the goal was aborted they were told to drive again.",
            )
        if (how := drive_goal.WORDS.get(drive.status or 0, "not over")) != "aborted":
            self._note("the drive is aborted.", f"{SETTLES:g} s later it was {how}.")

    def _goal_afterwards(self, dispatcher: Dispatcher) -> Act:
        """Send a goal: whatever is answered, nothing moves."""
        dispatcher.send(AFTERWARDS)
        yield from wait_until(lambda: any(dispatcher.speeds), AFTERWARDS)
        if any(dispatcher.speeds):
            self._note(
                "the wheels are told nothing any more but to stop.",
                f"A goal of {AFTERWARDS} m that came afterwards drove the robot.",
            )

    def _note(self, expected: str, actual: str) -> None:
        self._wrong = self._wrong or Failed(
            expected=f"{WHEN} {self._when}, {expected}", actual=actual
        )
