"""One thread a session that keeps its live views up to date, and ends with the session."""

from __future__ import annotations

import contextlib
import threading
import time
import weakref
from typing import Protocol

from course.runtime.core_session import CoreSession
from course.views.shared.per_session import PerSession

LONGEST_REST_S = 1.0
"""Seconds that the thread sleeps at most, so that it notices views that nobody has any more."""


class Refreshed(Protocol):
    """What a refresher keeps up to date."""

    def tick(self, now: float) -> float:
        """Do what is due at monotonic time ``now`` (s); return when something is due next."""

    def end(self, why: str) -> None:
        """Say that nothing will come any more, and ``why``."""


class Refresher:
    """Calls ``tick`` of each of its views when it is due.

    Its thread ends when it has no view left, and starts again with the next.
    """

    def __init__(self, session: CoreSession) -> None:
        """Serve views of ``session`` until it closes."""
        self._views: weakref.WeakSet[Refreshed] = weakref.WeakSet()
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._why = ""
        session.on_close(lambda: self.stop("The session has been closed."))

    def add(self, view: Refreshed) -> None:
        """Keep ``view`` up to date from now on."""
        with self._changed:
            if self._why:
                view.end(self._why)
                return
            self._views.add(view)
            if self._thread is None:
                self._thread = threading.Thread(
                    target=self._run_loop, name="ROS session views", daemon=True
                )
                self._thread.start()
            self._changed.notify_all()

    def forget(self, view: Refreshed) -> None:
        """Keep ``view`` up to date no more. Idempotent."""
        with self._changed:
            self._views.discard(view)

    def stop(self, why: str) -> None:
        """End every view, saying ``why``, and the thread. Idempotent."""
        with self._changed:
            self._why = self._why or why
            views, thread = list(self._views), self._thread
            self._views.clear()
            self._changed.notify_all()
        for view in views:
            view.end(why)
        if thread is not None and thread is not threading.current_thread():
            thread.join(LONGEST_REST_S)

    def _run_loop(self) -> None:
        while True:
            due = time.monotonic() + LONGEST_REST_S
            views = list(self._views)
            for view in views:
                due = min(due, self._tick_view(view, due))
            del views
            with self._changed:
                if not self._views:
                    self._thread = None
                    return
                self._changed.wait(max(0.0, due - time.monotonic()))

    def _tick_view(self, view: Refreshed, due: float) -> float:
        """Return when the view is due next; ``due``, if it failed, and with it only this view."""
        try:
            return view.tick(time.monotonic())
        except Exception as error:  # noqa: BLE001 - the others go on, and later ones begin
            self.forget(view)
            with contextlib.suppress(Exception):  # what failed may well fail at this, too
                view.end(f"This view has stopped ({type(error).__name__}: {error}).")
            return due


ticker_of = PerSession(Refresher)
"""Returns the refresher of a session."""
