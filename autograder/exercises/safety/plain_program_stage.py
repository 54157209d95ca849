"""A plain program's nodes, the examiner's ends, and a clock that only the examiner moves.

Nobody asks the program for anything: what is done to its nodes comes over DDS, and so does time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

from rclpy.node import Node

from autograder.examination.plain_programs import Program
from autograder.exercises.safety.counterpart import Player
from autograder.observe.patience import Patience
from autograder.observe.simulated_clock import SimulatedClock
from autograder.observe.stillness import Stillness

THREADS = 4
TIMED = "timed"
"""The act in which it matters how long something takes; there time passes in small strides."""
FINE_S = 0.1
"""Seconds of simulated time in a stride while something is timed, as in a session."""
STRIDE_S = 0.5
"""Seconds of simulated time between two messages on /clock, where nothing has to be punctual."""
MEET_S = 3.0
"""Seconds in which nodes and counterparts find each other, if they are all there."""
MEET_IDLE_S = 0.25
"""Seconds, with nobody at work, after which they know each other on both sides: DDS says who is
there every 0.1 s at first."""
END_S = 0.3
"""Seconds, with nobody at work, in which a program ends if something in it ends it."""

Act = Iterator[float]
"""What is done to a node; it yields for how many s of simulated time to wait before it goes on."""
Run = Callable[[Callable[[], Node]], None]
"""Makes a node of the examiner's, unless it has done so before, and spins it."""


class Part(NamedTuple):
    """A class of the task, who is at its other end, and what they do, by the trial that does it.

    ``serves`` makes the server of a player's that is there from the beginning, while it is timed.
    """

    name: str
    player: type[Player]
    acts: Mapping[str, Callable[[Any, Run], Act]]
    serves: Callable[[Any], Node] | None = None


class Stage:
    """Nodes in a program, their counterparts, and the clock of both.

    ``there`` are the classes whose node was seen. ``under_way`` is of each class the act that was
    begun last, ``ended`` the same of those whose node has ended. ``rested`` is whether all came to
    rest after each stride in which something was timed: else it may have come later than it seems.
    """

    def __init__(
        self, program: Program, still: Stillness, parts: Sequence[Part], fine: float = FINE_S
    ) -> None:
        """Make the counterparts of ``parts``, and wait until they and the nodes have met.

        While something is timed, a stride has ``fine`` s.
        """
        self._program, self._still, self._made = program, still, set[str]()
        self._fine, self.rested = fine, True
        self._clock = SimulatedClock(program.session)
        self.players: dict[str, Any] = {
            part.name: program.session.run(part.player) for part in parts
        }
        self._servers = {
            part.name: program.session.run(partial(part.serves, self.players[part.name]))
            for part in parts
            if part.serves is not None and TIMED in part.acts
        }
        players = self.players.values()
        program.wait(lambda: not any(player.describe_missing() for player in players), MEET_S)
        for player in players:
            player.subscribe_all()
        # They may be known here before they know of anybody: a request would then be lost.
        Patience(still, idle=MEET_IDLE_S).wait(program.session, lambda: False)
        self.there = {
            name for name, player in self.players.items() if not player.describe_missing()
        }
        self.under_way = {part.name: next(iter(part.acts)) for part in parts}
        self.ended = dict[str, str]()
        self._due: dict[str, tuple[float, Act]] = {
            part.name: (0.0, self._run_acts(part)) for part in parts
        }

    def _run_acts(self, part: Part) -> Act:
        for name, act in part.acts.items():
            self.under_way[part.name] = name
            # A wrong node may leave its counterpart where that cannot go on.
            with suppress(Exception):
                yield from act(self.players[part.name], self._run_node)
            if name == TIMED and part.name in self._servers:
                self._program.session.stop(self._servers.pop(part.name))
            # What a callback raised ends rclpy's executor when it has the next one to run.
            for _ in range(2):
                yield 0.0 if name == TIMED else STRIDE_S

    def _run_node(self, make: Callable[[], Node]) -> None:
        if make.__name__ not in self._made:
            self._made.add(make.__name__)
            self._program.session.run(make)
            self._wait_for_rest()

    def play(self) -> None:
        """Move time on until every act is over, or nothing is left to act on."""
        self._play_on()
        # On a busy machine it takes a while until something ends.
        Patience(self._still, idle=END_S).wait(self._program.session, self._all_ended)
        self._note_ended()

    def _all_ended(self) -> bool:
        return self._program.has_ended() or self.there <= {*self.ended}

    def play_more(self, name: str, act: Callable[[Any, Run], Act]) -> None:
        """Do one thing more to a class when all else is over."""

        def acts() -> Act:
            with suppress(Exception):  # as in `_run_acts`
                yield from act(self.players[name], self._run_node)

        self._due[name] = (self._clock.now, acts())
        self._play_on()

    def _play_on(self) -> None:
        self._wait_for_rest()
        while self._due and not self._program.has_ended():
            now = self._clock.now
            for name, (due, acts) in [*self._due.items()]:
                if due <= now:
                    if (seconds := next(acts, None)) is None:
                        del self._due[name]
                    else:
                        self._due[name] = (now + seconds, acts)
            self._wait_for_rest()
            self._note_ended()
            self._move_clock()

    def _note_ended(self) -> None:
        for name in self.there - {*self.ended}:
            if self.players[name].describe_missing():
                self.ended[name] = self.under_way[name]
                if name in self._due:
                    _, acts = self._due.pop(name)
                    next(acts, None)  # it may note what came before the end

    @property
    def _is_timing(self) -> bool:
        """Whether something is being timed."""
        return any(self.under_way[name] == TIMED for name in self._due)

    def _wait_for_rest(self) -> None:
        rested = self._still.wait_for_rest()
        for player in self.players.values():
            if player.resume():
                rested = self._still.wait_for_rest() and rested
        self.rested = self.rested and (rested or not self._is_timing)

    def _move_clock(self) -> None:
        seconds = self._fine if self._is_timing else STRIDE_S
        for player in self.players.values():  # before: what comes in on the way bears its end
            player.now = self._clock.now + seconds
        self._clock.move(seconds)
        self._wait_for_rest()


def wait_until(happened: Callable[[], Any], most: float) -> Act:
    """Wait until something happened, for so many s at most."""
    for _ in range(round(most / STRIDE_S)):
        if happened():
            return
        yield STRIDE_S
