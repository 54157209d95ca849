"""Which views of a session live: running a cell again replaces what its earlier run had made."""

from __future__ import annotations

import sys
import threading
from collections.abc import Hashable
from pathlib import Path
from typing import Any, Protocol

from course.runtime.core_session import CoreSession
from course.views.shared.per_session import PerSession

MAX_VIEWS = 30
"""Views of one session that live at a time: the oldest ends when there are more. As many of closed
sessions stay on the page."""

REPLACED = "This view has been replaced: the cell that made it was run again."
TOO_MANY = f"This view has ended, as its session shows {MAX_VIEWS} at most: run its cell again."

_PACKAGE = str(Path(__file__).parents[2])


class RegisteredView(Protocol):
    """What a view registry keeps."""

    def take_last_look(self) -> None:
        """Show what there is to see now, as it will soon be gone."""

    def end(self, why: str, *, close: bool = False) -> None:
        """Stop whatever it does, and say ``why``; ``close`` takes it off the page. Idempotent."""


_lock = threading.Lock()
_left: dict[RegisteredView, tuple[Hashable, Hashable]] = {}
"""Views that sessions have left on the page when they closed."""


class ViewRegistry:
    """The living views of one session, each with the place in the code that it came from."""

    def __init__(self, session: CoreSession) -> None:
        """Keep views until ``session`` closes."""
        self._views: dict[RegisteredView, tuple[Hashable, Hashable]] = {}
        session.before_close(self.take_last_looks)
        session.on_close(lambda: self.clear("The session has been closed."))

    def put(self, view: RegisteredView, about: Hashable) -> None:
        """Keep a view that is being made now, and end those whose place it takes.

        Args:
            view: what is kept.
            about: what the view shows. Outside notebooks, one call that makes views of different
                things, in a loop, makes as many views.
        """
        place, run = _find_place(about)
        with _lock:
            before = [
                other
                for views in (self._views, _left)
                for other, (where, when) in views.items()
                if where == place and when != run
            ]
            self._views[view] = (place, run)
            alive = [other for other in self._views if other not in before]
        for other in before:
            other.end(REPLACED, close=True)
        for other in alive[:-MAX_VIEWS]:
            other.end(TOO_MANY, close=True)

    def forget(self, view: RegisteredView) -> None:
        """Let go of a view that has ended and has no widget any more. Idempotent."""
        with _lock:
            self._views.pop(view, None)
            _left.pop(view, None)

    def take_last_looks(self) -> None:
        """Have all views show what there is now, before the session takes it down."""
        with _lock:
            views = list(self._views)
        for view in views:
            view.take_last_look()

    def clear(self, why: str) -> None:
        """End all views: they stay on the page, and say why, until their cells are run again."""
        with _lock:
            views = list(self._views)
            _left.update(self._views)
            self._views.clear()
            oldest = list(_left)[:-MAX_VIEWS]
        for view in views:
            view.end(why)
        for view in oldest:
            view.end(why, close=True)


registry_of = PerSession(ViewRegistry)
"""Returns the view registry of a session."""


def _find_place(about: Hashable) -> tuple[Hashable, Hashable]:
    """Return where in a notebook or program this is, and in which run of that place.

    A notebook's front end tells which cell it runs; without that, IPython's kernel names a cell by
    its text. A call in a program that is made again is a new run of its own.
    """
    from IPython.core.getipython import get_ipython

    caller: Any = sys._getframe(1)
    while caller.f_back is not None and caller.f_code.co_filename.startswith(_PACKAGE):
        caller = caller.f_back
    shell: Any = get_ipython()
    parent = shell.get_parent() if hasattr(shell, "get_parent") else None
    if parent:
        run = parent.get("header", {}).get("msg_id")
        cell = parent.get("metadata", {}).get("cellId")
        return cell or caller.f_code.co_filename, run
    return (caller.f_code.co_filename, caller.f_lineno, caller.f_lasti, about), object()
