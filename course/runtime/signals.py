"""Turn Ctrl-C and SIGTERM into an ordinary event, for as long as a script spins."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator


@contextlib.contextmanager
def ending(event: threading.Event) -> Iterator[None]:
    """Set `event` on SIGINT and SIGTERM inside the block; the handlers before are put back.

    Python lets only the main thread handle signals: elsewhere this does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {
        number: signal.signal(number, lambda *_: event.set())
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
