"""Part D, the drive's server when its node is shut down: by a call, and in a plain program.

A session calls ``shutdown()`` through the student's process, which so knows that it is looked at. A
program that is interrupted does it by itself, and what becomes of the robot is seen from outside.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from autograder.examination.exam import Failed, NotExaminable
from autograder.exercises.safety import drive_server
from autograder.exercises.safety.drive_server import (
    ABORT_S,
    AFTERWARDS_M,
    DRIVE,
    DRIVE_SERVER,
    drives_afterwards,
    motions,
)  # fmt: skip
from autograder.observe.examiner.actions import SentGoal
from autograder.observe.several_nodes.multi_node_rig import Nodes
from autograder.observe.several_nodes.plain_programs import ObservedProgram, ProgramEnded

# Seconds of wall time that shutdown() may take where it does not wait, 0.01 s as a rule; and in
# which all sleep in a program, and nothing stops the wheels: something waits.
AT_ONCE_S = 1.0
RETURNS_S = 5.0  # of wall time after which it waits for what does not come
LOOKS = 3  # calls of it, if need be; the fastest counts: any may be held up by the machine
SETTLES_S = 2 * ABORT_S  # of a program's time: there nothing has to be punctual
NO_WAITING = "shutdown() does not wait: it tells the loop, and returns at once."
ONLY_STOPS = "the wheels are told nothing any more but to stop"
UNASKED = "When the node runs in a program of its own, which calls shutdown()"
DROVE = "The last Twist on cmd_vel told the robot to drive."


def require_stop_on_the_way(nodes: Nodes) -> None:
    """Shut the node down in the middle of a drive: the robot stands, and the call does not wait."""
    took_s = [_shut_down_on_the_way(nodes)]
    while took_s[-1] > AT_ONCE_S and len(took_s) < LOOKS:
        took_s.append(_shut_down_on_the_way(nodes))
    if min(took_s) > AT_ONCE_S:
        raise Failed(
            expected=NO_WAITING,
            actual=f"Called {len(took_s)} times, it took {min(took_s):.1f} s or more each time, "
            "by the wall clock.",
        )


def _shut_down_on_the_way(nodes: Nodes) -> float:
    node = nodes.node(DRIVE_SERVER, fresh=True)
    goal = drive_server.start_drive(node, drive_server.LONG_M)
    node.advance(0.5)
    took_s = nodes.call("shutdown", NO_WAITING, "in the middle of a drive", RETURNS_S)
    node.rest()
    node.require_that(
        not motions(node)[-1],
        "shutdown() stops the robot at once.",
        "After the call the last Twist on cmd_vel told the robot to drive.",
    )
    stopped, goal.what = len(motions(node)), "A goal under way at shutdown()"
    goal.require_end("aborted", ABORT_S, drive_server.TOLERANCE_S)
    drive_server.require_stop(node)
    node.require_that(
        not any(motions(node)[stopped:]),
        f"After shutdown() {ONLY_STOPS}.",
        "The goal was aborted, but before that the wheels were told to drive again.",
    )
    _require_no_drive_afterwards(nodes, ", when the one under way had been aborted,")
    return took_s


def require_stop_while_idle(nodes: Nodes) -> None:
    """Shut the node down while no goal is under way: the wheels are stopped all the same."""
    node = nodes.node(DRIVE_SERVER, fresh=True)
    nodes.call("shutdown", NO_WAITING, "while no goal is under way", RETURNS_S)
    node.advance_until(lambda: motions(node), drive_server.STOP_S)
    node.require_that(
        motions(node)[-1:] == [False],
        "shutdown() stops the wheels, also while no goal is under way: a zero Twist on cmd_vel.",
        "Nothing came on cmd_vel.",
    )
    _require_no_drive_afterwards(nodes, "")


def _require_no_drive_afterwards(nodes: Nodes, last: str) -> None:
    """Send a goal to a node that is about to be taken down: whatever it answers, nothing moves.

    ``last`` says what became of the goal before, as the end of a sentence.
    """
    nodes.require_no_errors()
    node = nodes.node(DRIVE_SERVER)
    node.require_that(
        not drives_afterwards(node),
        f"After shutdown() {ONLY_STOPS}, whoever sends a goal then.",
        f"A goal of {AFTERWARDS_M} m that came after shutdown(){last} drove the robot.",
    )


def require_stop_unasked(nodes: Nodes) -> None:
    """Have a plain program shut its node down, in a drive and idle; nothing without programs.

    Raises:
        Failed: the robot does not stand then.
        NotExaminable: it could not be seen.
    """
    with nodes.run_program(DRIVE_SERVER) as program:
        if program is None or not (goal := _start_drive(program)):
            return  # that it drives is another check's
        late = [_shut_down(program, "in a drive", lambda: not motions(program)[-1], goal)]
        for is_there in (False, True):
            program.interrupt()  # it is ended, and then made anew
            program.wait(lambda there=is_there: program.is_complete() is there)  # type: ignore[misc]
        program.meet()
        program.forget(drive_server.COMMANDS)
        if program.is_complete():
            late.append(_shut_down(program, "while no goal is under way", lambda: motions(program)))
    if late == [True, True]:
        raise Failed(
            expected=f"{UNASKED}, it stops the wheels at once.",
            actual="In a drive and while no goal is under way, the zero Twist on cmd_vel came more "
            f"than {AT_ONCE_S:g} s later.",
        )
    if late != [False, False]:
        raise NotExaminable(
            "It could not be seen in a program of its own that shutdown() stops the wheels at "
            "once, in a drive and without one. After a hand-in a person looks at it."
        )


def _start_drive(program: ObservedProgram) -> SentGoal | None:
    goal = program.end.action_client(DRIVE).send(order=drive_server.LONGEST_M)
    with suppress(ProgramEnded):
        if program.advance_until(lambda: any(motions(program)), SETTLES_S):
            return goal
    return None


def _shut_down(
    program: ObservedProgram,
    when: str,
    has_stopped: Callable[[], object],
    goal: SentGoal | None = None,
) -> bool:
    """Have it called, and require that the robot stands; return whether the stop came late.

    ``goal`` is the one that is under way, if there is one.
    """

    def require(holds: bool, expected: str, actual: str) -> None:
        if not holds:
            raise Failed(expected=f"{UNASKED} {when}, {expected}.", actual=actual)

    program.interrupt()
    is_late = not program.wait(has_stopped, AT_ONCE_S)
    is_late = is_late and program.wait(has_stopped)  # or a message was lost, and sent again
    stopped = len(motions(program))
    try:
        if goal is not None:
            program.advance_until(lambda: goal.end, SETTLES_S)
        moved = motions(program)
        require(
            moved[-1:] == [False],
            "it stops the wheels: a zero Twist on cmd_vel",
            DROVE if moved else "Nothing came on cmd_vel.",
        )
        drove_on = "Before the goal was aborted they were told to drive again."
        require(not any(moved[stopped:]), ONLY_STOPS, drove_on)
        how = "aborted" if goal is None else goal.end or "not over"
        require(how == "aborted", "the drive is aborted", f"{SETTLES_S:g} s later it was {how}.")
        afterwards = f"A goal of {AFTERWARDS_M} m that came afterwards drove the robot."
        require(not drives_afterwards(program), ONLY_STOPS, afterwards)
    except ProgramEnded:
        ended = "The program was gone: an exception left shutdown() or a callback."
        require(False, "it raises nothing", ended)
    return is_late
