"""The nodes of exercise 5 in a plain program of rclpy: does anything that leaves a callback end it?

What a student's process says of its own errors can be made up. A plain program is not asked: it
goes on, or it ends. All that the exam provokes is provoked once more, in short, on all four nodes
at a time; how they deal with it is no matter here, but for the times that are taken first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from rclpy.action.server import ServerGoalHandle

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import NotExaminable
from autograder.examination.plain_programs import Programs
from autograder.exercises.safety import plain_program_times
from autograder.exercises.safety.gripper import (
    GripUser,
    Operator,
    double_parameter,
    string_parameter,
)
from autograder.exercises.safety.navigation import Dispatcher, NavigatorUser
from autograder.exercises.safety.plain_program_shutdown import Shutdowns
from autograder.exercises.safety.plain_program_stage import (
    STRIDE_S,
    THREADS,
    TIMED,
    Act,
    Part,
    Run,
    Stage,
    wait_until,
)
from autograder.exercises.safety.plain_program_times import Timing
from autograder.observe.stillness import Stillness
from course.runtime.waiting import Deadline

MOST_S = 60.0
"""Seconds that it may take to find out which acts end a program, once it is known that some do."""

NOT_FOUND_OUT = (
    "Something ends a plain program of your nodes, or keeps one of them from being made there, and "
    "it was not found out what. After a hand-in a person looks at it."
)


class Found(NamedTuple):
    """What programs have shown.

    ``ends`` is of each act, with the class it is done to, whether it ends a program; what was not
    found out is missing. ``timings`` are of each class whose node was seen. ``shutdowns`` has the
    one with nothing to do, if nothing else ends a program.
    """

    ends: Mapping[tuple[str, str], bool]
    timings: dict[str, Timing]
    shutdowns: Shutdowns


def ended_by(name: str, trial: str, bench: CheckContext, still: Stillness) -> bool:
    """Return whether a node ends a plain program when what is done in a trial is done to it.

    It is found out once a notebook; False where there are no such programs.

    Args:
        name: the node's class.
        trial: what is done to it, a name in `PARTS`.
        bench: gives programs, and remembers.
        still: tells when all that was sent has been dealt with.

    Raises:
        NotExaminable: it was not found out.
    """
    if bench.programs is None:
        return False
    ends = _get_findings(bench, bench.programs, still).ends
    if trial and (name, trial) not in ends:
        raise NotExaminable(NOT_FOUND_OUT)
    return bool(trial) and ends[name, trial]


def require_time(name: str, what: str, bench: CheckContext, still: Stillness) -> None:
    """Fail if a node takes far too long for something in a plain program, or far too short.

    Nothing where there are none. See `plain_program_times.require_timing`.
    """
    if bench.programs is None:
        return
    timings = _get_findings(bench, bench.programs, still).timings
    if name not in timings:
        raise NotExaminable(NOT_FOUND_OUT)
    plain_program_times.require_timing(name, what, bench, still, timings[name])


def shutdowns_seen(bench: CheckContext) -> Shutdowns | None:
    """Return what has been seen of shutdowns by now, if programs have been looked at."""
    known = bench.memory.get(f"{__name__}.found")
    return known.shutdowns if known is not None else None


def _get_findings(bench: CheckContext, programs: Programs, still: Stillness) -> Found:
    key = f"{__name__}.found"
    if key not in bench.memory:
        found = Found({}, {}, Shutdowns(still))
        bench.memory[key] = found._replace(ends=_ending_acts(programs, still, found))
    known: Found = bench.memory[key]
    return known


def _ending_acts(programs: Programs, still: Stillness, found: Found) -> dict[tuple[str, str], bool]:
    """Return of each act whether it ends a program; note what else is seen in what is ``found``."""
    ends = {(part.name, act): False for part in PARTS for act in part.acts}
    first = _play_program(programs, still, PARTS, shutdowns=found.shutdowns)
    found.timings.update(first.timings if first else {})
    if first is not None and not first.ended:
        return ends
    once = {*first.ended.items()} if first else set[tuple[str, str]]()
    there = {part.name for part in PARTS} if first else set[str]()
    left, raising, deadline = [*PARTS], set[str](), Deadline(MOST_S)
    while left and deadline.seconds_left:
        played = _play_program(programs, still, left, apart=True)
        found.timings.update(played.timings if played else {})
        ended = played.ended if played else {}
        there |= played.there if played else set()
        for name, act in ended.items():
            # rclpy's own executor has races, too; but hardly in a class that is known to raise.
            if (name, act) in once or name in raising:
                raising.add(name)
                ends[name, act] = True
            once.add((name, act))
        left = [
            _remaining_part(part, ended[part.name], ends) for part in left if part.name in ended
        ]
        left = [part for part in left if part.acts]
    if first and not raising and not left:
        again = _play_program(programs, still, PARTS)
        left = [*PARTS] if again and again.ended else []
    # Of a class whose node was made when the harness asked, and in no program, nothing is known.
    for part in (*left, *(part for part in PARTS if part.name not in there)):
        for act in part.acts:
            ends.pop((part.name, act), None)
    return ends


def _remaining_part(part: Part, act: str, ends: Mapping[tuple[str, str], bool]) -> Part:
    """Return what is left to do to a class: an act, unless that is settled, and those after it."""
    names = [*part.acts]
    first = names.index(act) + (1 if ends[part.name, act] else 0)
    return part._replace(acts={name: part.acts[name] for name in names[first:]})


class Played(NamedTuple):
    """What became of a program's nodes.

    Where they were apart, ``ended`` are the classes whose node ended, each with the act that was
    under way. Else there are none, or if the program ended all: it may have been any of them.
    ``there`` are the classes whose node was seen, ``timings`` of those that were timed.
    """

    ended: dict[str, str]
    there: frozenset[str]
    timings: Mapping[str, Timing]


def _play_program(
    programs: Programs,
    still: Stillness,
    parts: Sequence[Part],
    *,
    apart: bool = False,
    shutdowns: Shutdowns | None = None,
) -> Played | None:
    """Act on the nodes of a program, each class by itself at the same time.

    None if a node cannot be made; of nodes that are ``apart``, it is left out. ``shutdowns`` sees
    one at the end, if nothing has ended the program.
    """
    nodes = [(part.name, ()) for part in parts]
    with programs.program(
        nodes, threads=THREADS, sim_time=True, apart=apart, shut_down=shutdowns is not None
    ) as program:
        if not program.up:
            return None
        stage = Stage(program, still, parts)
        stage.play()
        ended = stage.ended if apart else stage.under_way if program.has_ended() else {}
        if shutdowns is not None and not ended:
            shutdowns.watch_idle(program, stage)
        timings = {
            part.name: Timing(stage.players[part.name].took, stage.rested)
            for part in parts
            if TIMED in part.acts and part.name in stage.there
        }
        return Played(ended, frozenset(stage.there), timings)


def _grip_without_gripper(user: GripUser, run: Run) -> Act:
    user.request(True)
    yield from wait_until(lambda: user.outcomes, 8.0)


def _grips_refused(user: GripUser, run: Run) -> Act:
    run(user.make_gripper)
    for success in (True, False):
        user.request(success)
        yield from wait_until(lambda: user.tries, 1.0)
        user.tries[0].reply(success)
        yield from wait_until(lambda: user.outcomes, 1.0)


def _grip_unanswered(user: GripUser, run: Run) -> Act:
    run(user.make_gripper)
    user.request(True)
    yield from wait_until(lambda: len(user.tries) > 1, 3.0)
    user.tries[1].crash()
    yield from wait_until(lambda: user.outcomes, 6.0)
    user.tries[2].reply(True)
    yield STRIDE_S


def _grip_answered_late(user: GripUser, run: Run) -> Act:
    run(user.make_gripper)
    user.request(True)
    yield from wait_until(lambda: len(user.tries) > 1, 3.0)
    user.tries[0].reply(True)
    yield STRIDE_S
    user.tries[1].reply(True)
    yield from wait_until(lambda: user.outcomes, 1.0)


def _limits_that_are_bad(operator: Operator, run: Run) -> Act:
    good = [double_parameter("linear", 0.3), double_parameter("angular", 0.6)]
    for parameters in (
        good, [double_parameter("linear", math.nan)], [double_parameter("angular", math.inf)],
        [double_parameter("linear", -0.5)], [double_parameter("angular", 7.0)],
        [string_parameter("linear", "fast")], [double_parameter("warp", 0.5)], [], good,
    ):  # fmt: skip
        yield from wait_until(operator.request_limits(parameters).done, 0.5)


def _limits_for_jammed_wheels(operator: Operator, run: Run) -> Act:
    half = [double_parameter("linear", 0.3), double_parameter("angular", math.nan)]
    yield from wait_until(operator.request_limits(half).done, 0.5)
    operator.jam_wheels(True)
    yield STRIDE_S
    yield from wait_until(operator.request_limits([double_parameter("linear", 0.9)]).done, 0.5)
    operator.jam_wheels(False)
    yield STRIDE_S
    yield from wait_until(operator.request_limits([double_parameter("linear", 0.4)]).done, 0.5)


def _goals_that_are_lost(user: NavigatorUser, run: Run) -> Act:
    user.request(3)
    yield from wait_until(lambda: user.outcomes, 3.0)  # there may be no navigator yet
    run(user.make_navigator)
    user.request(3, obeys=False)
    yield from wait_until(lambda: user.outcomes, 5.0)
    user.request(3, hesitates=True)
    yield from wait_until(lambda: user.outcomes, 2.5)
    user.decide()
    yield STRIDE_S


def _goals_that_end(user: NavigatorUser, run: Run) -> Act:
    run(user.make_navigator)
    for how in (ServerGoalHandle.succeed, ServerGoalHandle.abort):
        user.request(3)
        yield from wait_until(lambda: user.goals, 1.0)
        user.send_feedback(1)
        yield STRIDE_S
        user.end_goal(how)
        yield from wait_until(lambda: user.outcomes, 1.0)
    user.request(3, accepts=False)
    yield from wait_until(lambda: user.outcomes, 1.0)


def _goal_that_stalls(user: NavigatorUser, run: Run) -> Act:
    run(user.make_navigator)
    user.request(3)
    yield from wait_until(lambda: user.cancels, 4.0)
    user.end_goal(ServerGoalHandle.canceled)
    yield from wait_until(lambda: user.outcomes, 1.0)


def _drives_that_are_canceled(dispatcher: Dispatcher, run: Run) -> Act:
    rejected = dispatcher.send(0)
    yield from wait_until(lambda: rejected.handle, 0.5)
    drive = dispatcher.send(5)
    yield from wait_until(lambda: any(dispatcher.speeds), 1.0)
    dispatcher.cancel(drive)
    yield from wait_until(lambda: drive.status, 1.0)


def _drives_with_jammed_wheels(dispatcher: Dispatcher, run: Run) -> Act:
    drive = dispatcher.send(3)
    yield from wait_until(lambda: any(dispatcher.speeds), 1.0)
    dispatcher.jam_wheels(True)
    yield from wait_until(lambda: drive.status, 2.0)
    dispatcher.jam_wheels(False)
    yield STRIDE_S
    again = dispatcher.send(1)
    yield from wait_until(lambda: again.status, 3.0)


def _timed_part(name: str, acts: Mapping[str, Callable[[Any, Run], Act]]) -> Part:
    """Return the part of a class that is timed before these acts."""
    part = next(part for part in plain_program_times.PARTS if part.name == name)
    return part._replace(acts={**part.acts, **acts})


PARTS = (
    _timed_part(GripUser.CLIENT, {
        "absent": _grip_without_gripper, "refused": _grips_refused,
        "unanswered": _grip_unanswered, "stale": _grip_answered_late,
    }),
    Part(Operator.SERVER, Operator, {
        "bad": _limits_that_are_bad, "atomic": _limits_for_jammed_wheels,
    }),
    _timed_part(NavigatorUser.CLIENT, {
        "lost": _goals_that_are_lost, "ended": _goals_that_end, "stalled": _goal_that_stalls,
    }),
    _timed_part(Dispatcher.SERVER, {
        "canceled": _drives_that_are_canceled, "aborted": _drives_with_jammed_wheels,
    }),
)  # fmt: skip
