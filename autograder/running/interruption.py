"""Ctrl-C and ``kill`` end a run between two steps, never inside one.

nbgrader takes a KeyboardInterrupt for the failure of whatever submission it has in hand, and goes
on with the next; so signals are noted, and looked at where stopping leaves everything whole.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any, Self

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Stopped(BaseException):
    """The run was told to stop by signal number ``signum``; what was graded is kept.

    No KeyboardInterrupt, which typer would end the program with, without a word.
    """

    def __init__(self, signum: int) -> None:
        """Note the signal."""
        super().__init__(f"stopped by {signal.Signals(signum).name}")
        self.signum = signum


class Interruption:
    """Notes signals within its block. A second one ends the process as it always would."""

    def __init__(self, wake: Callable[[], None] = lambda: None) -> None:
        """``wake`` is called when a signal comes, wherever the program is."""
        self._wake = wake
        self._signum = 0
        self._before: dict[int, Any] = {}

    def is_stopped(self) -> bool:
        """Whether a signal came."""
        return self._signum != 0

    def raise_if_stopped(self) -> None:
        """Raise `Stopped` if a signal came."""
        if self._signum:
            raise Stopped(self._signum)

    def __enter__(self) -> Self:
        """Begin; only the main thread can, and in others nothing changes."""
        if threading.current_thread() is threading.main_thread():
            for signum in SIGNALS:
                if signal.getsignal(signum) is not signal.SIG_IGN:  # as nohup wants it
                    self._before[signum] = signal.signal(signum, self._note_signal)
        return self

    def __exit__(self, *_: object) -> None:
        """Restore what was before."""
        for signum, handler in self._before.items():
            signal.signal(signum, handler)
        self._before.clear()

    def _note_signal(self, signum: int, _frame: FrameType | None) -> None:
        if self._signum:
            signal.signal(signum, signal.SIG_DFL)
            os.kill(os.getpid(), signum)
        self._signum = signum
        self._wake()
