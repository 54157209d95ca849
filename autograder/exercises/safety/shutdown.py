"""Part D, the drive's server when its node is shut down: by a call, and in a plain program.

A session calls ``shutdown()`` through the student's process, which so knows that it is looked at. A
program that is interrupted does it by itself, and what becomes of the robot is seen from outside.
"""

from __future__ import annotations

from collections.abc import Callable

from autograder.examination.exam import Failed, NotExaminable
from autograder.exercises.safety.drive_server import (
    ABORT_S,
    AFTERWARDS_M,
    COMMANDS,
    DRIVE_SERVER,
    LONG_M,
    LONGEST_M,
    STOP_S,
    drives_afterwards,
    motions,
    require_end,
    require_stop,
    send_goal,
    start_drive,
)
from autograder.observe.plain_programs import ObservedProgram, ProgramEnded
from autograder.observe.several_nodes import Nodes

AT_ONCE_S = 1.0
"""Seconds of wall time that shutdown() may take where it does not wait, 0.01 s as a rule; and in
which all sleep in a program, and nothing stops the wheels: something waits."""
RETURNS_S = 5.0
"""Seconds of wall time after which it waits for what does not come."""
LOOKS = 3
"""Calls of it, if need be, of which the fastest counts: any may be held up by the machine."""
SETTLES_S = 2 * ABORT_S
"""Seconds of a program's time for the same as in a session: here nothing has to be punctual."""
NO_WAITING = "shutdown() does not wait: it tells the loop, and returns at once."
ONLY_STOPS = "After shutdown() the wheels are told nothing any more but to stop"
UNASKED = "When the node runs in a program of its own, which calls shutdown()"


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
    goal = start_drive(node, LONG_M)
    node.advance(0.5)
    took_s = nodes.call("shutdown", NO_WAITING, "in the middle of a drive", RETURNS_S)
    node.rest()
    node.require_that(
        not motions(node)[-1],
        "shutdown() stops the robot at once.",
        "After the call the last Twist on cmd_vel told the robot to drive.",
    )
    stopped = len(motions(node))
    require_end(node, goal, "A goal under way at shutdown()", "aborted", ABORT_S)
    require_stop(node, "been aborted")
    node.require_that(
        not any(motions(node)[stopped:]),
        f"{ONLY_STOPS}.",
        "The goal was aborted, but before that the wheels were told to drive again.",
    )
    nodes.require_no_errors()
    node.require_that(
        not drives_afterwards(node),
        f"{ONLY_STOPS}, whoever sends a goal then.",
        f"A goal of {AFTERWARDS_M} m that came after shutdown(), when the one under way had been "
        "aborted, drove the robot.",
    )
    return took_s


def require_stop_while_idle(nodes: Nodes) -> None:
    """Shut the node down while no goal is under way: the wheels are stopped all the same."""
    node = nodes.node(DRIVE_SERVER, fresh=True)
    nodes.call("shutdown", NO_WAITING, "while no goal is under way", RETURNS_S)
    node.advance_until(lambda: motions(node), STOP_S)
    node.require_that(
        motions(node)[-1:] == [False],
        "shutdown() stops the wheels, also while no goal is under way: a zero Twist on cmd_vel.",
        "Nothing came on cmd_vel.",
    )
    nodes.require_no_errors()
    node.require_that(
        not drives_afterwards(node),
        f"{ONLY_STOPS}, whoever sends a goal then.",
        f"A goal of {AFTERWARDS_M} m that came after shutdown() drove the robot.",
    )


def require_stop_unasked(nodes: Nodes) -> None:
    """Have a plain program shut its node down, in a drive and idle; nothing without programs.

    Raises:
        Failed: the robot does not stand then.
        NotExaminable: it could not be seen.
    """
    with nodes.run_program(DRIVE_SERVER) as program:
        if program is None:
            return
        late = _watch(program, "in a drive", _stop_in_drive)
        if late is None:
            return  # that it drives is another check's
        _make_anew(program)
        later = _watch(program, "while no goal is under way", _stop_while_idle)
    if late and later:
        raise Failed(
            expected=f"{UNASKED}, it stops the wheels at once.",
            actual="In a drive and while no goal is under way, the zero Twist on cmd_vel came more "
            f"than {AT_ONCE_S:g} s later.",
        )
    if late or later or later is None:
        raise NotExaminable(
            "It could not be seen in a program of its own that shutdown() stops the wheels at "
            "once, in a drive and without one. After a hand-in a person looks at it."
        )


def _watch(
    program: ObservedProgram,
    when: str,
    watch: Callable[[ObservedProgram, str], bool | None],
) -> bool | None:
    try:
        return watch(program, f"{UNASKED} {when},")
    except ProgramEnded:
        raise Failed(
            expected=f"{UNASKED} {when}, it raises nothing.",
            actual="The program was gone: an exception left shutdown() or a callback.",
        ) from None


def _make_anew(program: ObservedProgram) -> None:
    for is_there in (False, True):
        program.interrupt()  # it is ended, and then made anew
        program.wait(lambda there=is_there: program.is_complete() is there)  # type: ignore[misc]
    program.meet()


def _stop_in_drive(program: ObservedProgram, when: str) -> bool | None:
    """Return whether the stop came late; None if the robot did not drive."""
    goal = send_goal(program, LONGEST_M)
    try:
        if not program.advance_until(lambda: any(motions(program)), SETTLES_S):
            return None
    except ProgramEnded:
        return None
    is_late = _shut_down(program, lambda: not motions(program)[-1])
    stopped = len(motions(program))
    program.advance_until(lambda: goal.end, SETTLES_S)
    _require(not motions(program)[-1], f"{when} it stops the robot.", DROVE)
    _require(
        not any(motions(program)[stopped:]),
        f"{when} the wheels are told nothing any more but to stop.",
        "Before the goal was aborted they were told to drive again.",
    )
    how = goal.end or "not over"
    _require(
        how == "aborted", f"{when} the drive is aborted.", f"{SETTLES_S:g} s later it was {how}."
    )
    _require_no_drive_afterwards(program, when)
    return is_late


DROVE = "The last Twist on cmd_vel told the robot to drive."


def _stop_while_idle(program: ObservedProgram, when: str) -> bool | None:
    """Return whether the stop came late; None if the node is not there."""
    if not program.is_complete():
        return None
    program.forget(COMMANDS)
    is_late = _shut_down(program, lambda: motions(program))
    moved = motions(program)
    _require(
        moved[-1:] == [False],
        f"{when} it stops the wheels: a zero Twist on cmd_vel.",
        DROVE if moved else "Nothing came on cmd_vel.",
    )
    _require_no_drive_afterwards(program, when)
    return is_late


def _shut_down(program: ObservedProgram, has_stopped: Callable[[], object]) -> bool:
    """Have it called, and wait until the wheels are told to stop; return if that came late."""
    program.interrupt()
    if program.wait(has_stopped, AT_ONCE_S):
        return False
    return program.wait(has_stopped)  # or a message was lost, and sent again


def _require_no_drive_afterwards(program: ObservedProgram, when: str) -> None:
    _require(
        not drives_afterwards(program),
        f"{when} the wheels are told nothing any more but to stop.",
        f"A goal of {AFTERWARDS_M} m that came afterwards drove the robot.",
    )


def _require(holds: bool, expected: str, actual: str) -> None:
    if not holds:
        raise Failed(expected=expected, actual=actual)
