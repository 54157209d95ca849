"""What was right is seen once more in a plain program, whose time the student's process never has.

A session moves a node's time through functions in the student's process, which may move it by twice
as much as they are asked to: a stream with half its messages then seems to be right. So what was
right there is seen again, in short, in a program that nobody asks. Only what is off by a good part
should count there: nothing in it has to be punctual.

At first all is seen in one program with little patience, as most of it is right. What was not, or
was not to be seen, is looked at by itself with as much patience as ever.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import Failed, NotExaminable
from autograder.examination.plain_programs import Programs
from autograder.observe.patience import IDLE_S, SETTLE_S
from autograder.observe.programs.simulated_clock import SimulatedClock
from autograder.observe.stepped_time.stepped_observer import Host, SteppedObserver
from autograder.observe.stillness import Stillness
from course.runtime.core_session import CoreSession

ObserverT = TypeVar("ObserverT", bound=SteppedObserver)
Trial = Callable[[ObserverT], None]

HASTY_S, HASTY_IDLE_S = 2.0, 0.5
"""Seconds in all, and with nobody at work, in which what is right comes from an idle machine."""
NOT_SEEN = (
    "This was right when the harness moved your node's time on. But in a program of its own, whose "
    "/clock the examiner publishes, it could not be seen. After a hand-in a person looks at it."
)
SO_IN_A_PROGRAM = "So it is in a program of its own, too, whose /clock the examiner publishes."


class ProgramTime:
    """The time of a plain program's nodes: a /clock that only the examiner publishes."""

    def __init__(self, session: CoreSession, still: Stillness) -> None:
        """Publish it in the program's ``session``; ``still`` watches the program."""
        self._clock, self._still = SimulatedClock(session), still

    @property
    def is_followed(self) -> bool:
        """Whether any node has been found to follow it."""
        return self._clock.is_followed

    def advance(self, seconds: float, step: float) -> None:
        """Move it on, and let all come to rest every ``step`` s."""
        stride = min(seconds, step)
        for _ in range(round(seconds / stride)):
            self._clock.move(stride)
            self._still.wait_for_rest()

    def nudge(self) -> None:
        """Tell the nodes that hardly any time has passed."""
        self._clock.move(0.0)


@contextmanager
def as_not_examinable() -> Iterator[None]:
    """Where the block fails, nothing can be told of what comes after it.

    Raises:
        NotExaminable: it failed.
    """
    try:
        yield
    except Failed:
        raise NotExaminable(NOT_SEEN) from None


@dataclass
class _Findings:
    """The trials that were passed and those that were not, and those that had all patience."""

    right: set[str] = field(default_factory=set)
    wrong: dict[str, Failed] = field(default_factory=dict)
    patient: set[str] = field(default_factory=set)

    def note_outcomes(self, outcomes: Mapping[str, Failed | None]) -> None:
        for name, outcome in outcomes.items():
            self.wrong.pop(name, None)
            if outcome is None:
                self.right.add(name)
            else:
                self.wrong[name] = outcome

    def require(self, name: str) -> None:
        if name in self.wrong:
            raise self.wrong[name]
        if name not in self.right:
            raise NotExaminable(NOT_SEEN)


@dataclass(frozen=True)
class SteppedTrials(Generic[ObserverT]):
    """Trials of a node in a plain program.

    Attributes:
        node: the name of its class in the notebook.
        threads: how many run its callbacks.
        observe: gives what a trial takes, for as long as the program runs.
        trials: by name, in the order in which the checks come that they are about. Each raises
            `Failed` as a check does, or `NotExaminable` where nothing can be told.
        await_node: waits until the node is up; returns which of the trials named can be made.
    """

    node: str
    threads: int
    observe: Callable[[CheckContext, Host], AbstractContextManager[ObserverT]]
    trials: Mapping[str, Trial[ObserverT]]
    await_node: Callable[[ObserverT, Iterable[str]], Iterable[str]]

    def require(self, bench: CheckContext, name: str) -> None:
        """Require that a trial is passed; nothing where there are no plain programs.

        Raises:
            Failed: it was not.
            NotExaminable: it could not be seen.
        """
        if bench.programs is None:
            return
        found = bench.memory.get(__name__)
        if found is None:
            found = bench.memory[__name__] = _Findings()
            # What trials before this one are about has failed already.
            names = list(self.trials)[list(self.trials).index(name) :]
            found.note_outcomes(self._run(bench, bench.programs, names, hasty=True))
        if name not in found.right | found.patient:
            found.patient.add(name)
            found.note_outcomes(self._run(bench, bench.programs, [name], hasty=False))
        found.require(name)

    def _run(
        self, bench: CheckContext, programs: Programs, names: Iterable[str], *, hasty: bool
    ) -> dict[str, Failed | None]:
        """Return of each trial how it was failed, or None; what could not be seen is missing."""
        outcomes: dict[str, Failed | None] = {}
        with programs.program(
            [(self.node, ())], threads=self.threads, sim_time=True, goes_on=True
        ) as program:
            if not program.up:
                return outcomes
            settle_s, idle_s = (HASTY_S, HASTY_IDLE_S) if hasty else (SETTLE_S, IDLE_S)
            source = ProgramTime(program.session, Stillness(bench.outside))
            host = Host(
                program.session, source, settle_s=settle_s, idle_s=idle_s, too_slow=NOT_SEEN
            )
            with self.observe(bench, host) as observer:
                observer.wait(lambda: source.is_followed)
                for name in self.await_node(observer, names):
                    if program.has_ended():
                        break  # something in it has: an exit, say
                    with suppress(NotExaminable):
                        outcome = _outcome(self.trials[name], observer)
                        if not program.has_ended():
                            outcomes[name] = outcome
        return outcomes


def _outcome(trial: Trial[ObserverT], observer: ObserverT) -> Failed | None:
    try:
        trial(observer)
    except Failed as failed:
        return Failed(
            expected=f"{failed.expected} {SO_IN_A_PROGRAM}", actual=failed.actual,
            picture=failed.picture,
        )  # fmt: skip
    return None
