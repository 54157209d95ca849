"""Close sessions in the one order that leaves no abort, no ghost node and no core dump.

A daemon thread that still spins when the interpreter ends takes the whole process down with
SIGABRT. So: wake and join the threads, destroy the nodes, shut the context down; for every open
session at exit, with a deadline.
"""

from __future__ import annotations

import atexit
import os
import threading
import time
import weakref
from dataclasses import dataclass, field
from typing import Protocol

from course.runtime.output import callback_output, rcutils_tap

_EXIT_TIMEOUT_S = 2.0  # s that all sessions together may take at interpreter exit


@dataclass
class CloseReport:
    """What closing a session left behind.

    Attributes:
        leaked: names of threads whose callback did not end in time, with the callback's node, and
            nodes whose own cleanup raised.
        duration: seconds that closing took.
    """

    leaked: list[str] = field(default_factory=list)
    duration: float = 0.0

    def __bool__(self) -> bool:
        """Return True if nothing leaked."""
        return not self.leaked


class Closable(Protocol):
    """What this module needs to know of a session."""

    def dismantle(self, deadline: float) -> list[str]:
        """Take everything down by `deadline` (monotonic, s); return what did not end."""

    def close(self, timeout: float = ...) -> CloseReport:
        """Close the session."""


_open: dict[int, Closable] = {}
_known: weakref.WeakSet[Closable] = weakref.WeakSet()
_lock = threading.Lock()


def register_session(session: Closable) -> None:
    """Remember `session`, to close it at interpreter exit at the latest."""
    with _lock:
        _open[id(session)] = session
        _known.add(session)


def known_sessions() -> list[Closable]:
    """Return the sessions of this process that are open, or closed and still referred to."""
    return list(_known)


def close_session(session: Closable, report: CloseReport, timeout: float) -> CloseReport:
    """Dismantle `session` within `timeout` seconds and fill in `report`."""
    start = time.monotonic()
    leaked = session.dismantle(start + timeout)
    with _lock:
        _open.pop(id(session), None)
    report.leaked[:] = leaked
    if not _open and not leaked:
        callback_output.uninstall_streams()
    report.duration = time.monotonic() - start
    return report


def _close_all() -> None:
    deadline = time.monotonic() + _EXIT_TIMEOUT_S
    for session in list(_open.values()):
        session.close(max(0.1, deadline - time.monotonic()))
    rcutils_tap.uninstall_handler()


def _forget_in_child() -> None:
    # Threads and DDS do not survive a fork: the child must neither use nor close them.
    _open.clear()


atexit.register(_close_all)
os.register_at_fork(after_in_child=_forget_in_child)
