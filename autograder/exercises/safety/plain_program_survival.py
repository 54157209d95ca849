"""The nodes of exercise 5 in a plain program of rclpy: does anything that leaves a callback end it?

What a student's process says of its own errors can be made up. A plain program is not asked: it
goes on, or it ends. All that the exam provokes is provoked once more, in short, on all four nodes
at a time; how they deal with it is no matter here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from autograder.examination.check_context import Bench
from autograder.examination.exam import NotExaminable
from autograder.examination.plain_programs import Program, Programs
from autograder.exercises.safety.counterpart import Player
from autograder.exercises.safety.gripper import GripUser, Operator, double, text
from autograder.exercises.safety.navigation import Dispatcher, NavigatorUser
from autograder.observe.patience import Patience
from autograder.observe.quiet_node import QuietNode
from autograder.observe.stillness import Stillness
from course.runtime.waiting import Deadline

THREADS = 4
STRIDE_S = 0.5
"""Seconds of simulated time between two messages on /clock: nothing here has to be punctual."""
MEET_S = 3.0
"""Seconds in which nodes and counterparts find each other, if they are all there."""
MEET_IDLE_S = 0.5
"""Seconds, with nobody at work, after which they know each other on both sides."""
END_S = 0.3
"""Seconds, with nobody at work, in which a program ends if something in it ends it."""
MOST_S = 60.0
"""Seconds that it may take to find out which acts end a program, once it is known that some do."""

Act = Iterator[float]
"""What is done to a node; it yields for how many s of simulated time to wait before it goes on."""
Run = Callable[[Callable[[], Node]], None]
"""Makes a node of the examiner's, unless it has done so before, and spins it."""


class Part(NamedTuple):
    """A class of the task, who is at its other end, and what they do, by the trial that does it."""

    name: str
    player: type[Player]
    acts: Mapping[str, Callable[[Any, Run], Act]]


def ended_by(name: str, trial: str, bench: Bench, still: Stillness) -> bool:
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
    key = f"{__name__}.ends"
    if key not in bench.memory:
        bench.memory[key] = _ending_acts(bench.programs, still)
    ends: Mapping[tuple[str, str], bool] = bench.memory[key]
    if trial and (name, trial) not in ends:
        raise NotExaminable(
            "Something ends a plain program of your nodes, or keeps one of them from being made "
            "there, and it was not found out what. After a hand-in a person looks at it."
        )
    return bool(trial) and ends[name, trial]


def _ending_acts(programs: Programs, still: Stillness) -> dict[tuple[str, str], bool]:
    """Return of each act, with the class it is done to, whether it ends a program.

    What was not found out is missing.
    """
    ends = {(part.name, act): False for part in PARTS for act in part.acts}
    first = _play(programs, still, PARTS)
    if first is not None and not first.ended:
        return ends
    once = {*first.ended.items()} if first else set[tuple[str, str]]()
    there = {part.name for part in PARTS} if first else set[str]()
    left, raising, deadline = [*PARTS], set[str](), Deadline(MOST_S)
    while left and deadline.left:
        played = _play(programs, still, left, apart=True)
        ended = played.ended if played else {}
        there |= played.there if played else set()
        for name, act in ended.items():
            # rclpy's own executor has races, too; but hardly in a class that is known to raise.
            if (name, act) in once or name in raising:
                raising.add(name)
                ends[name, act] = True
            once.add((name, act))
        left = [_from(part, ended[part.name], ends) for part in left if part.name in ended]
        left = [part for part in left if part.acts]
    if first and not raising and not left:
        again = _play(programs, still, PARTS)
        left = [*PARTS] if again and again.ended else []
    # Of a class whose node was made when the harness asked, and in no program, nothing is known.
    for part in (*left, *(part for part in PARTS if part.name not in there)):
        for act in part.acts:
            ends.pop((part.name, act), None)
    return ends


def _from(part: Part, act: str, ends: Mapping[tuple[str, str], bool]) -> Part:
    """Return what is left to do to a class: an act, unless that is settled, and those after it."""
    names = [*part.acts]
    first = names.index(act) + (1 if ends[part.name, act] else 0)
    return part._replace(acts={name: part.acts[name] for name in names[first:]})


class Played(NamedTuple):
    """What became of a program's nodes.

    Where they were apart, ``ended`` are the classes whose node ended, each with the act that was
    under way. Else there are none, or if the program ended all: it may have been any of them.
    ``there`` are the classes whose node was seen.
    """

    ended: dict[str, str]
    there: frozenset[str]


def _play(
    programs: Programs, still: Stillness, parts: Sequence[Part], *, apart: bool = False
) -> Played | None:
    """Act on the nodes of a program, each class by itself at the same time.

    None if a node cannot be made; of nodes that are ``apart``, it is left out.
    """
    nodes = [(part.name, ()) for part in parts]
    with programs.program(nodes, threads=THREADS, sim_time=True, apart=apart) as program:
        if not program.up:
            return None
        stage = Stage(program, still, parts)
        stage.play()
        ended = stage.ended if apart else stage.under_way if program.ended() else {}
        return Played(ended, frozenset(stage.there))


class Stage:
    """Nodes in a program, their counterparts, and the clock of both.

    ``there`` are the classes whose node was seen. ``under_way`` is of each class the act that was
    begun last, ``ended`` the same of those whose node has ended.
    """

    def __init__(self, program: Program, still: Stillness, parts: Sequence[Part]) -> None:
        """Make the counterparts of ``parts``, and wait until they and the nodes have met."""
        self._program, self._still, self._made = program, still, set[str]()
        node = program.session.run(lambda: QuietNode("clock"))
        assert isinstance(node, QuietNode)
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._clock, self._now_ns = node.create_publisher(Clock, "/clock", qos), 0
        self.players: dict[str, Any] = {
            part.name: program.session.run(part.player) for part in parts
        }
        players = self.players.values()
        program.wait(lambda: not any(player.missing() for player in players), MEET_S)
        for player in players:
            player.attend()
        # They may be known here before they know of anybody: a request would then be lost.
        Patience(still, idle=MEET_IDLE_S).wait(program.session, lambda: False)
        self.there = {name for name, player in self.players.items() if not player.missing()}
        self.under_way = {part.name: next(iter(part.acts)) for part in parts}
        self.ended = dict[str, str]()
        self._due: dict[str, tuple[float, Act]] = {
            part.name: (0.0, self._acts(part)) for part in parts
        }

    def _acts(self, part: Part) -> Act:
        for name, act in part.acts.items():
            self.under_way[part.name] = name
            # A wrong node may leave its counterpart where that cannot go on.
            with suppress(Exception):
                yield from act(self.players[part.name], self._run)
            # What a callback raised ends rclpy's executor when it has the next one to run.
            yield STRIDE_S
            yield STRIDE_S

    def _run(self, make: Callable[[], Node]) -> None:
        if make.__name__ not in self._made:
            self._made.add(make.__name__)
            self._program.session.run(make)
            self._rest()

    def play(self) -> None:
        """Move time on until every act is over, or nothing is left to act on."""
        self._rest()
        while self._due and not self._program.ended():
            now = self._now_ns / 1e9
            for name, (due, acts) in [*self._due.items()]:
                if due <= now:
                    if (seconds := next(acts, None)) is None:
                        del self._due[name]
                    else:
                        self._due[name] = (now + seconds, acts)
            self._rest()
            self._note_ended()
            self._move()
        # On a busy machine it takes a while until something ends.
        Patience(self._still, idle=END_S).wait(self._program.session, self._program.ended)
        self._note_ended()

    def _note_ended(self) -> None:
        for name in self.there - {*self.ended}:
            if self.players[name].missing():
                self.ended[name] = self.under_way[name]
                self._due.pop(name, None)

    def _rest(self) -> None:
        self._still.reached()
        for player in self.players.values():
            if player.resume():
                self._still.reached()

    def _move(self) -> None:
        # The second message gives executors something to do: what has come by then goes on.
        for more_ns in (round(STRIDE_S * 1e9), 1):
            self._now_ns += more_ns
            self._clock.publish(Clock(clock=Time(nanoseconds=self._now_ns).to_msg()))
        for player in self.players.values():
            player.now = self._now_ns / 1e9
        self._rest()


def wait_until(happened: Callable[[], Any], most: float) -> Act:
    """Wait until something happened, for so many s at most."""
    for _ in range(round(most / STRIDE_S)):
        if happened():
            return
        yield STRIDE_S


def _grip_without_gripper(user: GripUser, run: Run) -> Act:
    user.request(True)
    yield from wait_until(lambda: user.outcomes, 8.0)


def _grips_refused(user: GripUser, run: Run) -> Act:
    run(user.gripper)
    for success in (True, False):
        user.request(success)
        yield from wait_until(lambda: user.tries, 1.0)
        user.tries[0].reply(success)
        yield from wait_until(lambda: user.outcomes, 1.0)


def _grip_unanswered(user: GripUser, run: Run) -> Act:
    run(user.gripper)
    user.request(True)
    yield from wait_until(lambda: len(user.tries) > 1, 3.0)
    user.tries[1].crash()
    yield from wait_until(lambda: user.outcomes, 6.0)
    user.tries[2].reply(True)
    yield STRIDE_S


def _grip_answered_late(user: GripUser, run: Run) -> Act:
    run(user.gripper)
    user.request(True)
    yield from wait_until(lambda: len(user.tries) > 1, 3.0)
    user.tries[0].reply(True)
    yield STRIDE_S
    user.tries[1].reply(True)
    yield from wait_until(lambda: user.outcomes, 1.0)


def _limits_that_are_bad(operator: Operator, run: Run) -> Act:
    good = [double("linear", 0.3), double("angular", 0.6)]
    for parameters in (
        good, [double("linear", math.nan)], [double("angular", math.inf)], [double("linear", -0.5)],
        [double("angular", 7.0)], [text("linear", "fast")], [double("warp", 0.5)], [], good,
    ):  # fmt: skip
        yield from wait_until(operator.ask(parameters).done, 0.5)


def _limits_for_jammed_wheels(operator: Operator, run: Run) -> Act:
    half = [double("linear", 0.3), double("angular", math.nan)]
    yield from wait_until(operator.ask(half).done, 0.5)
    operator.jam(True)
    yield STRIDE_S
    yield from wait_until(operator.ask([double("linear", 0.9)]).done, 0.5)
    operator.jam(False)
    yield STRIDE_S
    yield from wait_until(operator.ask([double("linear", 0.4)]).done, 0.5)


def _goals_that_are_lost(user: NavigatorUser, run: Run) -> Act:
    user.request(3)
    yield from wait_until(lambda: user.outcomes, 3.0)  # there may be no navigator yet
    run(user.navigator)
    user.request(3, obeys=False)
    yield from wait_until(lambda: user.outcomes, 5.0)
    user.request(3, hesitates=True)
    yield from wait_until(lambda: user.outcomes, 2.5)
    user.decide()
    yield STRIDE_S


def _goals_that_end(user: NavigatorUser, run: Run) -> Act:
    run(user.navigator)
    for how in (ServerGoalHandle.succeed, ServerGoalHandle.abort):
        user.request(3)
        yield from wait_until(lambda: user.goals, 1.0)
        user.feedback(1)
        yield STRIDE_S
        user.end(how)
        yield from wait_until(lambda: user.outcomes, 1.0)
    user.request(3, accepts=False)
    yield from wait_until(lambda: user.outcomes, 1.0)


def _goal_that_stalls(user: NavigatorUser, run: Run) -> Act:
    run(user.navigator)
    user.request(3)
    yield from wait_until(lambda: user.cancels, 4.0)
    user.end(ServerGoalHandle.canceled)
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
    dispatcher.jam(True)
    yield from wait_until(lambda: drive.status, 2.0)
    dispatcher.jam(False)
    yield STRIDE_S
    again = dispatcher.send(1)
    yield from wait_until(lambda: again.status, 3.0)


PARTS = (
    Part(GripUser.CLIENT, GripUser, {
        "absent": _grip_without_gripper, "refused": _grips_refused,
        "unanswered": _grip_unanswered, "stale": _grip_answered_late,
    }),
    Part(Operator.SERVER, Operator, {
        "bad": _limits_that_are_bad, "atomic": _limits_for_jammed_wheels,
    }),
    Part(NavigatorUser.CLIENT, NavigatorUser, {
        "lost": _goals_that_are_lost, "ended": _goals_that_end, "stalled": _goal_that_stalls,
    }),
    Part(Dispatcher.SERVER, Dispatcher, {
        "canceled": _drives_that_are_canceled, "aborted": _drives_with_jammed_wheels,
    }),
)  # fmt: skip
