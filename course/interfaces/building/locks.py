"""Locks between processes, held by file: the kernel lets go of them when a process dies."""

from __future__ import annotations

import contextlib
import errno
import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from course.util.operating_system import try_lock

LOCK_DEADLINE_S = 120.0  # seconds to wait for another process's build before building privately

_locks: set[int] = set()  # descriptors of locks held now


def _forget_locks() -> None:
    # A forked child shares the lock: without this it would hold it for as long as it lives.
    for descriptor in _locks:
        with contextlib.suppress(OSError):
            os.close(descriptor)
    _locks.clear()


os.register_at_fork(after_in_child=_forget_locks)


@contextlib.contextmanager
def locked(file: Path, deadline: float | None = None) -> Iterator[None]:
    """Hold ``file`` locked; the process that holds it may delete it.

    Args:
        file: made if it does not exist.
        deadline: seconds to wait for another process; None takes ``LOCK_DEADLINE_S``.

    Raises ``TimeoutError`` (an ``OSError``) if another process holds it past the deadline.
    """
    end = time.monotonic() + (LOCK_DEADLINE_S if deadline is None else deadline)
    pause = threading.Event()
    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o666)
        _locks.add(descriptor)
        try:
            if try_lock(descriptor) and _is_still(file, descriptor):
                yield
                return
        finally:
            _locks.discard(descriptor)
            os.close(descriptor)
        if time.monotonic() > end:
            raise TimeoutError(errno.ETIMEDOUT, "another process keeps it locked")
        pause.wait(0.05)


def _is_still(file: Path, descriptor: int) -> bool:
    """Return whether ``file`` is what was opened: it may have been deleted in between."""
    try:
        return os.path.samestat(file.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
