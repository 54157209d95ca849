"""What the views of one session share, made when the first of them needs it."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable
from typing import Generic, TypeVar

from course.runtime.session import Session

T = TypeVar("T")


class PerSession(Generic[T]):
    """One object of a kind for each session; it goes with the session."""

    def __init__(self, make: Callable[[Session], T]) -> None:
        """Have none yet; ``make`` makes one for a session."""
        self._make = make
        self._made: weakref.WeakKeyDictionary[Session, T] = weakref.WeakKeyDictionary()
        self._lock = threading.Lock()

    def __call__(self, session: Session) -> T:
        """Return the session's own, made on first use."""
        with self._lock:
            if session not in self._made:
                self._made[session] = self._make(session)
            return self._made[session]
