"""The report of a check while it runs: it grows in the cell with each result."""

from __future__ import annotations

from typing import Any

from autograder.examination.verdict import Progress, Verdict
from autograder.examination.verdict_text import Report

STARTING = "The examiner starts."
ENDED = "The examination has ended here: run the cell again for the rest."


class LiveReport:
    """What a cell shows of an examination: what is examined now, and each result once it is known.

    Outside a notebook nothing is shown before `finish`.
    """

    def __init__(self, exam: str, part: str, hints: int) -> None:
        """Show that it begins; ``hints`` is how many hints of each failed check are given."""
        self._hints = hints
        self._last = Verdict(exam, part, ())
        self._handle: Any = None
        if _is_notebook():
            from IPython.display import display

            self._handle = display(self._report_on(STARTING), display_id=True)  # type: ignore[no-untyped-call]

    def show_progress(self, data: Any) -> None:
        """Show the results so far, and what is examined now: a `Progress`, as JSON knows it."""
        progress = Progress.from_data(data)
        self._last = progress.so_far
        now = f"Examining {progress.number} of {progress.of}: {progress.title}"
        self._update(self._report_on(now))

    def finish(self, verdict: Verdict) -> None:
        """Show the whole verdict."""
        report = Report(verdict, hints=self._hints)
        if self._handle is not None:
            self._update(report)
        elif _is_shell():
            from IPython.display import display

            display(report)  # type: ignore[no-untyped-call]
        else:
            print(report)  # noqa: T201 - outside a notebook, the terminal is where a report goes

    def stop(self) -> None:
        """Show that nothing comes any more: the examination was interrupted, or has failed."""
        self._update(self._report_on(ENDED))

    def _report_on(self, now: str) -> Report:
        return Report(self._last, hints=self._hints, now=now)

    def _update(self, report: Report) -> None:
        if self._handle is not None:
            self._handle.update(report)


def _shell() -> Any:
    try:
        from IPython.core.getipython import get_ipython
    except ImportError:
        return None
    return get_ipython()


def _is_shell() -> bool:
    return _shell() is not None


def _is_notebook() -> bool:
    """Whether what is displayed can be changed later: in a terminal it would stand there twice."""
    return getattr(_shell(), "kernel", None) is not None
