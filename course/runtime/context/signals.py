"""Turn Ctrl-C and SIGTERM into an ordinary event, for as long as a script spins."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def wake_on_signals(wake: Callable[[], None]) -> Iterator[None]:
    """Call `wake` on SIGINT and SIGTERM inside the block; the handlers before are put back.

    The main thread calls it between two steps of whatever it does: it must take no lock that this
    thread may hold just then. Python lets only the main thread handle signals: elsewhere this does
    nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {
        number: signal.signal(number, lambda *_: wake())
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
