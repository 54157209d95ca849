"""What the views of one session share, made when the first of them needs it."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable
from typing import Generic, TypeVar

from course.runtime.core_session import CoreSession

T = TypeVar("T")


class PerSession(Generic[T]):
    """One object of a kind for each session; it goes with the session."""

    def __init__(self, make: Callable[[CoreSession], T]) -> None:
        """Have none yet; ``make`` makes one for a session."""
        self._make = make
        self._made: weakref.WeakKeyDictionary[CoreSession, T] = weakref.WeakKeyDictionary()
        self._lock = threading.Lock()

    def __call__(self, session: CoreSession) -> T:
        """Return the session's own, made on first use."""
        with self._lock:
            if session not in self._made:
                self._made[session] = self._make(session)
            return self._made[session]
