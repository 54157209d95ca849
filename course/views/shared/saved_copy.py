"""The output that a saved notebook shows in a view's place, kept in step with the view."""

from __future__ import annotations

import contextlib
import time
from typing import Any

from course.views.shared.static_fallback import saved_output

PERIOD_S = 10.0
"""Seconds between two copies while a view changes: a copy makes its notebook one to be saved."""


class SavedCopy:
    """A view's second output: shown with the view, and replaced when the view shows other things.

    See `static_fallback` for why there is one.
    """

    def __init__(self, label: str) -> None:
        """Have nothing shown yet; ``label`` is what people call the view."""
        self._label = label
        self._handle: Any = None
        self._kept = ("", "")
        self._due = 0.0

    @property
    def is_due(self) -> bool:
        """Whether there is a copy, and it is old enough to be replaced."""
        return self._handle is not None and time.monotonic() >= self._due

    def show(self, words: str, picture: str) -> None:
        """Show the first copy, under the cell that runs."""
        from IPython.display import display

        self._note(words, picture)
        output = saved_output(self._label, words, picture)
        self._handle = display(output, raw=True, display_id=True)  # type: ignore[no-untyped-call]

    def replace(self, words: str, picture: str) -> None:
        """Put what the view shows now into the copy, if there is one and something has changed."""
        if self._handle is None or self._kept == (words, picture):
            return
        self._note(words, picture)
        with contextlib.suppress(Exception):  # the front end may be gone: the copy stays as it was
            self._handle.update(saved_output(self._label, words, picture), raw=True)

    def _note(self, words: str, picture: str) -> None:
        self._kept = (words, picture)
        self._due = time.monotonic() + PERIOD_S
