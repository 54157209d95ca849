"""Nodes in a plain program: does anything that leaves a callback end it, and how long do they take?

What a student's process says of its own errors can be made up, and it is asked to move a session's
time: one that passes twice as much makes a time-out of 4 s look like one of 2 s. A plain program is
not asked for anything: it goes on, or it ends, and time is on /clock. So what was right in a
session is done once more, in short, to all nodes of a notebook, one after the other. If something
ends their program, each node that a check asks about is tried by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, NamedTuple

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import Failed, NotExaminable
from autograder.observe.nouns import Action, Service, Task
from autograder.observe.several_nodes.clock_bound_node import ServerT
from autograder.observe.several_nodes.plain_programs import ObservedProgram
from autograder.observe.stillness import Stillness
from course.runtime.waiting import Deadline

FINE_S, FINEST_S = 0.1, 0.01
"""Seconds in a stride where something is timed, as between two looks in a session; and where it has
been out of bounds, as who waits ten times for 0.05 s may take ten strides: a session's step."""
MOST_S = 60.0
"""Seconds that it may take to find out what ends programs, once it is known that something does."""
NOT_FOUND_OUT = (
    "Something ends a plain program of your nodes, or keeps one of them from being made there, and "
    "it was not found out what. After a hand-in a person looks at it."
)


class Bounds(NamedTuple):
    """What is timed in a program: the task's word on it, and how far off it may be.

    Bounds are those of the session's checks or wider, and closer than half and twice what is right:
    what is right in a session never fails here.
    """

    rule: str
    least: float
    most: float
    told: str
    """What was found, as a sentence, with a place for the number."""


Trial = Callable[[ObservedProgram], None]


def served(
    trial: Callable[[ObservedProgram, ServerT], None],
    server: Callable[[Any, Callable[[], float]], ServerT],
    what: Service | Action,
) -> Trial:
    """Return a trial during which the examiner plays a server: see `ObservedProgram.served_by`."""

    def run(program: ObservedProgram) -> None:
        with program.served_by(server, what) as made:
            trial(program, made)

    return run


@dataclass(frozen=True)
class NodeTrials:
    """What is done to a node in a program.

    Attributes:
        task: what the node is connected to.
        timed: trials in which it matters how long something takes, by name; what they note in
            `ObservedProgram.times` is judged by ``bounds``.
        untimed: the others, which come after these.
        bounds: of the times, by their names.
    """

    task: Task
    timed: Mapping[str, Trial] = field(default_factory=dict)
    untimed: Mapping[str, Trial] = field(default_factory=dict)
    bounds: Mapping[str, Bounds] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """The names of all trials, in the order in which they come."""
        return [*self.timed, *self.untimed]

    def only(self, names: Collection[str]) -> NodeTrials:
        """Return the same with these trials alone."""
        return replace(
            self,
            timed={name: trial for name, trial in self.timed.items() if name in names},
            untimed={name: trial for name, trial in self.untimed.items() if name in names},
        )


TrialTable = Sequence[NodeTrials]


class Times(NamedTuple):
    """How long things took; ``sure`` is whether nothing can have come later than it seemed."""

    took: Mapping[str, float] = MappingProxyType({})
    sure: bool = True

    def is_far_off(self, what: str, bounds: Bounds) -> bool:
        """Return whether a time is out of its bounds, or not known."""
        return not bounds.least <= self.took.get(what, math.nan) <= bounds.most


@dataclass
class Found:
    """What programs have shown of a node: which trials end one, if known, and its times."""

    ends: dict[str, bool] = field(default_factory=dict)
    times: Times = field(default_factory=Times)
    is_there: bool = True


class Played(NamedTuple):
    """What became of a program: the node and the trial that were under way when it ended, if any.

    ``there`` are the classes whose node was seen.
    """

    ended: tuple[str, str] | None
    there: frozenset[str]
    times: Times


class ProgramTrials:
    """What trials have shown; each is made when a check first asks for it."""

    def __init__(self, bench: CheckContext, still: Stillness, table: TrialTable) -> None:
        """Nothing has been tried yet."""
        self._bench, self._still = bench, still
        self._table = {trials.task.node: trials for trials in table}
        self._all: Played | None = None
        self._found: dict[str, Found] = {}
        self._finer: dict[str, Times] = {}
        self._deadline: Deadline | None = None

    def require_survival(self, node: str, trial: str) -> None:
        """Fail if a node ends a program in a trial; nothing where there are no programs.

        Raises:
            Failed: it does.
            NotExaminable: it was not found out.
        """
        if self._bench.programs is None:
            return
        ends = self._findings_of(node).ends
        if trial not in ends:
            raise NotExaminable(NOT_FOUND_OUT)
        if ends[trial]:
            raise Failed(
                expected="Nothing leaves a callback as an exception.",
                actual="What was seen from outside was right, but where the node runs in a plain "
                "program of rclpy, that ended: an exception left one of its callbacks.",
            )

    def require_times(self, node: str, *names: str) -> None:
        """Fail if a node takes far too long, or far too short, for something in a program.

        Raises:
            Failed: it does.
            NotExaminable: it cannot be told.
        """
        if self._bench.programs is None:
            return
        for what in names:
            bounds, found = self._table[node].bounds[what], self._findings_of(node)
            if not found.is_there:
                raise NotExaminable(NOT_FOUND_OUT)
            if found.times.is_far_off(what, bounds):
                self._require_in_bounds(bounds, what, self._take_again(node, found.times.sure))

    def _require_in_bounds(self, bounds: Bounds, what: str, times: Times) -> None:
        if not times.is_far_off(what, bounds):
            return
        if not times.sure or what not in times.took:
            raise NotExaminable(
                f"It could not be timed in a plain program of your nodes: {bounds.rule} After a "
                "hand-in a person looks at it."
            )
        raise Failed(
            expected=bounds.rule,
            actual="What was seen in a session was right, but where the node runs in a plain "
            f"program of rclpy, by the time on /clock, {bounds.told.format(times.took[what])}.",
        )

    def _take_again(self, node: str, sure: bool) -> Times:
        if node not in self._finer:
            timed = self._table[node].only(self._table[node].timed)
            # Each stride lasts long where nothing rests.
            played = self._play([timed], FINEST_S if sure else FINE_S)
            seen = played is not None and node in played.there
            self._finer[node] = played.times if played and seen else Times(sure=False)
        return self._finer[node]

    def _findings_of(self, node: str) -> Found:
        if self._all is None:
            self._all = self._play([*self._table.values()]) or Played(
                ("", ""), frozenset(), Times(sure=False)
            )
            if self._all.ended is None:
                for name in self._all.there:
                    unharmed = dict.fromkeys(self._table[name].names, False)
                    self._found[name] = Found(unharmed, self._all.times)
        if node not in self._found:
            self._found[node] = self._try_alone(self._table[node])
        return self._found[node]

    def _try_alone(self, trials: NodeTrials) -> Found:
        """Find out which trials end a program of one node."""
        self._deadline = self._deadline or Deadline(MOST_S)
        found, node, left = Found(is_there=False), trials.task.node, trials.names
        assert self._all is not None
        once, is_raising = {self._all.ended}, False
        while left and self._deadline.seconds_left:
            played = self._play([trials.only(left)], waits_for_end=True)
            if played is None or node not in played.there:
                break
            found.is_there, took = True, {**found.times.took, **played.times.took}
            found.times = Times(took, found.times.sure and played.times.sure)
            ended = played.ended[1] if played.ended else ""
            unharmed = left[: left.index(ended)] if ended else left
            found.ends.update(dict.fromkeys(unharmed, False))
            left = left[len(unharmed) :]
            # rclpy's own executor has races, too; but hardly in a node that is known to raise.
            if ended and (is_raising or played.ended in once):
                is_raising = found.ends[ended] = True
                left = left[1:]
            once.add(played.ended)
        return found

    def _play(
        self, table: TrialTable, stride_s: float = FINE_S, *, waits_for_end: bool = False
    ) -> Played | None:
        """Run nodes in a program and try them; None if one cannot be made.

        ``waits_for_end``: after each trial, so that it is known which one it was.
        """
        assert self._bench.programs is not None
        tasks = [trials.task for trials in table]
        with self._bench.programs.program(
            [(task.node, ()) for task in tasks],
            threads=max(task.threads for task in tasks),
            sim_time=True,
        ) as program:
            if not program.up:
                return None
            seen = ObservedProgram(program, self._still, tasks)
            ended = _find_end(seen, table, stride_s, waits_for_end=waits_for_end)
            return Played(ended, seen.there, Times(seen.times, seen.rested))


def _find_end(
    program: ObservedProgram, table: TrialTable, stride_s: float, *, waits_for_end: bool
) -> tuple[str, str] | None:
    """Try nodes, and return the node and the trial in which their program ended, if it did."""
    last = ("", "")
    for trials in table:
        for name, trial in {**trials.timed, **trials.untimed}.items():
            last = trials.task.node, name
            with program.timing(stride_s) if name in trials.timed else nullcontext():
                _try_once(program, trial)
            if program.has_ended() or (waits_for_end and program.ends_soon()):
                return last
    return last if program.ends_soon() else None


def _try_once(program: ObservedProgram, trial: Trial) -> None:
    # A wrong node may leave the examiner's end where a trial cannot go on.
    with suppress(Exception):
        trial(program)
