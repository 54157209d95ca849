"""How long the nodes of exercise 5 take in a plain program, whose clock the examiner itself moves.

In a session the student's process moves time on when it is asked to: one that passes twice as much
makes a time-out of 4 s look like one of 2 s. Nobody in a plain program is asked. What takes too
long or not long enough there, by far, fails the check of that time; what is within the bounds of a
session's checks never does.

Time moves in strides, and who waits ten times for 0.05 s may take as many of them. So what is out
of bounds is timed once more, in strides as small as a session's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import NamedTuple

from rclpy.action.server import ServerGoalHandle

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import Failed, NotExaminable
from autograder.exercises.safety.gripper import GripUser
from autograder.exercises.safety.navigation import Dispatcher, NavigatorUser
from autograder.exercises.safety.plain_program_stage import (
    FINE_S,
    THREADS,
    TIMED,
    Act,
    Part,
    Run,
    Stage,
)
from autograder.observe.stillness import Stillness

FINEST_S = 0.01
"""Seconds in a stride where something has been out of bounds: the step of a session's time."""
SLOW_S, LATE_S = 0.7, 1.5
"""Seconds after which a try is answered, in time and too late."""
BEATS = 2
"""Heartbeats after the first, over which they are timed."""
METRES = 3
"""Of the drive that is timed: a second more or less is allowed a drive, whatever its length."""


class Timed(NamedTuple):
    """What is timed, the task's word on it, and how far off a session's check lets it be.

    Bounds are those of the session's checks or wider, and closer than half and twice what is right.
    """

    rule: str
    least: float
    most: float
    told: str
    """What was found, as a sentence, with a place for the number."""


SLOW, LATE, PAUSE, BEAT = "slow answer", "late answer", "first pause", "heartbeat"
STALL, GOAL, CANCEL = "silence", "goal without answer", "cancel without answer"
DRIVE, COMMANDS, CANCELED, ABORTED = "drive", "commands", "canceled drive", "jammed drive"

TIMES: Mapping[str, Timed] = {
    SLOW: Timed(
        f"An answer after {SLOW_S:g} s is in time: one try is enough.", 1, 1,
        "the gripper was called {:.0f} times",
    ),
    LATE: Timed(
        f"A try has 1 s. The answer to the first try comes {LATE_S:g} s after it, and is ignored.",
        2, math.inf, "it was taken for a present answer",
    ),
    PAUSE: Timed(
        "The second try comes 1.5 s after the first, or later.", 1.05, math.inf,
        "it came {:.2g} s after the first",
    ),
    BEAT: Timed("There is a heartbeat every 0.5 s.", 0.27, 0.85, "there was one every {:.2g} s"),
    STALL: Timed(
        "The goal is canceled 2 s after its acceptance, with no feedback since then.", 1.5, 3.0,
        "the request to cancel came after {:.1f} s",
    ),
    GOAL: Timed(
        "When the navigator has not answered the goal for 1 s, the outcome is “lost”.", 0.7, 1.6,
        "it came after {:.1f} s",
    ),
    CANCEL: Timed(
        "When the navigator has not answered the request to cancel for 1 s, the outcome is “lost”.",
        0.7, 1.6, "it came after {:.1f} s",
    ),
    DRIVE: Timed(
        f"A goal of {METRES} m takes {METRES} s, at 1 m/s.", METRES - 1.1, METRES + 1.8,
        "it took {:.1f} s",
    ),
    COMMANDS: Timed(
        "On the way the wheels get a command at least every 0.5 s.", 0.0, 0.9,
        "for {:.1f} s nothing came on cmd_vel",
    ),
    CANCELED: Timed(
        "A canceled goal is over within 0.5 s.", 0.0, 0.9, "it took {:.1f} s",
    ),
    ABORTED: Timed(
        "A goal whose wheels jam is over 1 s after the next command, which comes within 0.5 s.",
        0.0, 1.9, "it took {:.1f} s",
    ),
}  # fmt: skip


class Timing(NamedTuple):
    """How long things took in a program; ``sure`` is whether nothing can have come later."""

    took: Mapping[str, float]
    sure: bool

    def far_off(self, what: str) -> bool:
        """Whether a time is out of its bounds, or not known."""
        took = self.took.get(what, math.nan)
        return not TIMES[what].least <= took <= TIMES[what].most


def require_timing(
    name: str, what: str, bench: CheckContext, still: Stillness, timing: Timing
) -> None:
    """Fail if something takes a node of a class far too long or far too short.

    Args:
        name: the class.
        what: a name in `TIMES`.
        bench: gives a program to time it in once more, and remembers.
        still: tells when all that was sent has been dealt with.
        timing: what has been found of the class.

    Raises:
        NotExaminable: it cannot be told.
    """
    if timing.far_off(what):
        key = f"{__name__}.{name}"
        if key not in bench.memory:
            stride = FINEST_S if timing.sure else FINE_S  # each lasts long where nothing rests
            bench.memory[key] = _once_more(name, bench, still, stride)
        timing = bench.memory[key]
    if not timing.far_off(what):
        return
    if not timing.sure or what not in timing.took:
        raise NotExaminable(
            f"It could not be timed in a plain program of your nodes: {TIMES[what].rule} After a "
            "hand-in a person looks at it."
        )
    raise Failed(
        expected=TIMES[what].rule,
        actual="What was seen in a session was right, but where the node runs in a plain program "
        f"of rclpy, by the time on /clock, {TIMES[what].told.format(timing.took[what])}.",
    )


def _once_more(name: str, bench: CheckContext, still: Stillness, stride: float) -> Timing:
    assert bench.programs is not None
    parts = [part for part in PARTS if part.name == name]
    with bench.programs.program([(name, ())], threads=THREADS, sim_time=True) as program:
        if not program.up:
            return Timing({}, False)
        stage = Stage(program, still, parts, stride)
        stage.play()
        if name not in stage.there:
            return Timing({}, False)
        return Timing(stage.players[name].took, stage.rested)


def wait_within(
    player: GripUser | NavigatorUser | Dispatcher, most: float, what: Callable[[], object],
) -> Act:  # fmt: skip
    """Wait until something happened, stride by stride, for so many s at most."""
    end = player.now + most - 1e-3  # else sums of floats decide
    while not what() and player.now < end:
        yield 0.0


def _never_happens() -> bool:
    return False


def _times_of_a_grip(user: GripUser, run: Run) -> Act:
    yield from wait_within(user, 1.5 * BEATS, lambda: len(user.beats) > BEATS)
    if len(user.beats) > 1:
        user.took[BEAT] = (user.beats[-1] - user.beats[0]) / (len(user.beats) - 1)
    user.request(True)
    yield from wait_within(user, 1.0, lambda: user.tries)
    yield from wait_within(user, SLOW_S, _never_happens)
    user.tries[0].reply(True)
    yield from wait_within(user, 2.0, lambda: user.outcomes or len(user.tries) > 1)
    user.took[SLOW] = len(user.tries)
    if len(user.tries) > 1:
        user.tries[1].reply(True)
        yield from wait_within(user, 2.0, lambda: user.outcomes)

    user.request(False)
    yield from wait_within(user, 1.0, lambda: user.tries)
    yield from wait_within(user, LATE_S, _never_happens)
    user.tries[0].reply(True)
    yield from wait_within(user, 6.0, lambda: user.outcomes or len(user.tries) > 1)
    user.took[LATE] = len(user.tries)
    tried = [attempt.at for attempt in user.tries]
    user.took[PAUSE] = tried[1] - tried[0] if len(tried) > 1 else math.inf
    if len(tried) > 1:
        user.tries[1].reply(True)
        yield from wait_within(user, 1.0, lambda: user.outcomes)


def _times_of_a_navigator(user: NavigatorUser, run: Run) -> Act:
    asked = user.now
    user.request(3, ponders=True)
    yield from wait_within(user, 5.0, lambda: user.cancels)
    user.took[STALL] = user.cancels[0] - asked
    yield from wait_within(user, 3.0, lambda: user.outcomes)
    user.took[CANCEL] = user.now - user.cancels[0]
    user.decide()
    yield 0.0
    user.end_goal(ServerGoalHandle.canceled)
    yield 0.0
    asked = user.now
    user.request(3, hesitates=True)
    yield from wait_within(user, 3.0, lambda: user.outcomes)
    user.took[GOAL] = user.now - asked
    user.decide()
    yield 0.0


def _times_of_a_drive(dispatcher: Dispatcher, run: Run) -> Act:
    began = dispatcher.now
    drive = dispatcher.send(METRES)
    yield from wait_within(dispatcher, 3.0 * METRES, lambda: drive.status)
    dispatcher.took[DRIVE] = dispatcher.now - began
    told = [*dispatcher.told, dispatcher.now]
    dispatcher.took[COMMANDS] = max(after - before for before, after in pairwise(told))

    drive = dispatcher.send(2 * METRES)
    yield from wait_within(dispatcher, 1.0, lambda: any(dispatcher.speeds))
    dispatcher.cancel(drive)
    began = dispatcher.now
    yield from wait_within(dispatcher, 2.0, lambda: drive.status)
    dispatcher.took[CANCELED] = dispatcher.now - began

    drive = dispatcher.send(2 * METRES)
    yield from wait_within(dispatcher, 1.0, lambda: any(dispatcher.speeds))
    dispatcher.jam_wheels(True)
    began = dispatcher.now
    yield from wait_within(dispatcher, 4.0, lambda: drive.status)
    dispatcher.took[ABORTED] = dispatcher.now - began
    dispatcher.jam_wheels(False)
    yield 0.0


PARTS = (
    Part(GripUser.CLIENT, GripUser, {TIMED: _times_of_a_grip}, GripUser.make_gripper),
    Part(
        NavigatorUser.CLIENT,
        NavigatorUser,
        {TIMED: _times_of_a_navigator},
        NavigatorUser.make_navigator,
    ),
    Part(Dispatcher.SERVER, Dispatcher, {TIMED: _times_of_a_drive}),
)
