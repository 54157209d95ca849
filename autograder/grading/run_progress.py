"""How far a run has got: a line that moves on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from autograder.grading.graded import Graded
from autograder.util.terminal import visible_text


class RunProgress:
    """Is told how a run goes; this one says nothing. Called in one thread only."""

    def begin(self, submissions: int, notebooks: int, unchanged: int) -> None:
        """Note what there is to do, and how many submissions need nothing."""

    def notebook_ran(self, waited: bool) -> None:
        """Note that a notebook has its outcome; ``waited`` is False if it was kept from before."""

    def submission_done(self, graded: Graded) -> None:
        """Note that a submission is in the gradebook, or cannot be."""

    def say(self, line: str) -> None:
        """Pass on a sentence."""

    def end(self) -> None:
        """Note that the run is over, done or not."""


@dataclass
class Clock:
    """Estimates the time left from the notebooks that were really run."""

    now: Callable[[], float] = time.monotonic
    left: int = 0
    run: int = 0
    started: float = field(default=0.0, init=False)

    def begin(self, notebooks: int) -> None:
        """Start with so many notebooks to go."""
        self.left, self.run, self.started = notebooks, 0, self.now()

    def count_notebook(self, waited: bool) -> None:
        """Count one notebook; one that was kept takes no time and tells nothing of the others."""
        self.left = max(0, self.left - 1)
        self.run += waited

    def time_left(self) -> str:
        """Return the time left in words, or an empty string while there is nothing to go by."""
        if not self.run or not self.left:
            return ""
        return f"{in_words((self.now() - self.started) / self.run * self.left)} left"


MOST_REASONS = 5
"""Reasons for checks that were not examined that a run tells; `autograder report` has them all."""


class Lines(RunProgress):
    """One line a submission: for log files, and whatever is no terminal."""

    def __init__(self, out: Console) -> None:
        """Print on ``out``."""
        self._out = out
        self._clock = Clock()
        self._done = self._all = 0
        self._unexamined: dict[str, None] = {}

    def begin(self, submissions: int, notebooks: int, unchanged: int) -> None:
        """Say what needs nothing."""
        self._clock.begin(notebooks)
        self._all = submissions
        if unchanged:
            self.say(_describe_unchanged(unchanged))

    def notebook_ran(self, waited: bool) -> None:
        """Count a notebook."""
        self._clock.count_notebook(waited)

    def submission_done(self, graded: Graded) -> None:
        """Say what a submission got."""
        self._done += 1
        left = self._clock.time_left()
        self._tell_result(graded, f"; {left}" if left else "")

    def end(self) -> None:
        """Say which checks were not examined, and why."""
        for reason in list(self._unexamined)[:MOST_REASONS]:
            self.say(f"Left to a person: {reason}")
        if len(self._unexamined) > MOST_REASONS:
            self.say("Left to a person, too: what `autograder report` lists.")

    def _tell_result(self, graded: Graded, more: str = "") -> None:
        """Say what a submission got, and remember what was not examined in it."""
        number = f"{self._done:>{len(str(self._all))}} of {self._all}"
        self.say(f"  {number}  {_describe_graded(graded)}{more}")
        if len(self._unexamined) <= MOST_REASONS:
            self._unexamined.update(dict.fromkeys(_unexamined_checks(graded)))

    def say(self, line: str) -> None:
        """Print a line."""
        self._out.print(visible_text(line), markup=False, highlight=False, soft_wrap=True)


class Live(Lines):
    """A bar with the time left under the lines that stay."""

    def __init__(self, out: Console) -> None:
        """Draw on ``out``, which is a terminal."""
        super().__init__(out)
        self._bar = Bar(
            TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
            TextColumn("notebooks,"), TimeElapsedColumn(), TextColumn("{task.fields[left]}"),
            console=out, transient=True,
        )  # fmt: skip
        self._task = self._bar.add_task("Grading", total=None, left="")

    def begin(self, submissions: int, notebooks: int, unchanged: int) -> None:
        """Show the bar."""
        super().begin(submissions, notebooks, unchanged)
        self._bar.update(self._task, total=notebooks)
        self._bar.start()

    def notebook_ran(self, waited: bool) -> None:
        """Move the bar."""
        super().notebook_ran(waited)
        self._bar.update(self._task, advance=1, left=self._clock.time_left())

    def submission_done(self, graded: Graded) -> None:
        """Say what a submission got, above the bar."""
        self._done += 1
        self._tell_result(graded)

    def end(self) -> None:
        """Take the bar away, and say which checks were not examined."""
        self._bar.stop()
        super().end()


def for_console(out: Console, err: Console, *, machine: bool) -> RunProgress:
    """Return what suits: for a machine's standard output nothing but a bar on standard error."""
    if machine:
        return Live(err) if err.is_terminal else RunProgress()
    return Live(out) if out.is_terminal else Lines(out)


def in_words(seconds: float) -> str:
    """Return a duration as people say it, no finer than it is known."""
    if seconds < 5:
        return "a few seconds"
    if seconds < 90:
        return f"about {round(seconds / 5) * 5} s"
    minutes = round(seconds / 60)
    if minutes < 90:
        return f"about {minutes} min"
    return f"about {minutes // 60} h {minutes % 60:02} min"


def _describe_unchanged(count: int) -> str:
    if count == 1:
        return "1 submission has not changed since it was graded, so it is left as it is."
    return (
        f"{count} submissions have not changed since they were graded: they are left as they are."
    )


def _describe_graded(graded: Graded) -> str:
    problem = f"  {graded.problem}" if graded.problem else ""
    verdicts = [v for outcome in graded.outcomes.values() for v in outcome.verdicts.values()]
    unexamined = sum(verdict.unexamined_points for verdict in verdicts)
    open_points = f" ({unexamined:g} not examined)" if unexamined else ""
    return (
        f"{graded.student}: {graded.points:g} of {graded.max_points:g} automatic points"
        f"{open_points}, {graded.seconds:.1f} s{problem}"
    )


def _unexamined_checks(graded: Graded) -> Iterator[str]:
    """Yield which checks could not be examined, and why; students whose reasons agree share one."""
    for notebook, outcome in graded.outcomes.items():
        for verdict in outcome.verdicts.values():
            for check in verdict.checks:
                if check.status == "not_examined":
                    yield f"{notebook}, “{check.title}”: {check.actual}"


class Collecting(RunProgress):
    """Keeps every submission with its outcomes, for small classes, and passes everything on."""

    def __init__(self, graded: dict[str, Graded], then: RunProgress) -> None:
        """Collect in ``graded``; ``then`` is told, too."""
        self._graded = graded
        self._then = then

    def begin(self, submissions: int, notebooks: int, unchanged: int) -> None:
        """Pass it on."""
        self._then.begin(submissions, notebooks, unchanged)

    def notebook_ran(self, waited: bool) -> None:
        """Pass it on."""
        self._then.notebook_ran(waited)

    def say(self, line: str) -> None:
        """Pass it on."""
        self._then.say(line)

    def end(self) -> None:
        """Pass it on."""
        self._then.end()

    def submission_done(self, graded: Graded) -> None:
        """Keep a submission."""
        self._graded[graded.student] = graded
        self._then.submission_done(graded)
