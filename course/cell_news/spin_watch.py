"""Say what is going on while a cell blocks in rclpy's own spinning, which shows nothing."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import Any

import rclpy

from course.cell_news.news import News

PATIENCE_S = 2.0
"""Seconds that a cell may spin before it is told: a short spin_once() is no news."""

_BLOCKING = ("spin", "spin_until_future_complete")


class SpinWatch:
    """Looks once, some time after a cell has begun, whether it spins."""

    def __init__(self) -> None:
        """Watch nothing yet."""
        self._timer: threading.Timer | None = None

    def begin_cell(self, _info: Any = None) -> None:
        """Look at the cell that begins now, once `PATIENCE_S` have passed."""
        self.end_cell()
        self._timer = threading.Timer(PATIENCE_S, _tell_if_spinning)
        self._timer.name, self._timer.daemon = "ROS cell watch", True
        self._timer.start()

    def end_cell(self) -> None:
        """Look no more. Idempotent."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = None


def _tell_if_spinning() -> None:
    from IPython.display import display

    frame = sys._current_frames().get(threading.main_thread().ident or 0)
    name = next((name for name in map(_spinning_name, _callers(frame)) if name), "")
    if name:
        display(  # type: ignore[no-untyped-call]
            News(
                f"{name}() blocks this cell until you interrupt it (the ■ button above). The "
                "session spins its nodes in the background: run them with course.run(...), and "
                "leave this line out."
            )
        )


def _callers(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back


def _spinning_name(frame: FrameType) -> str:
    """Return what blocks, as the learner has written it; empty if this frame does not."""
    module, name = frame.f_globals.get("__name__", ""), frame.f_code.co_name
    if name not in _BLOCKING:
        return ""
    if module == rclpy.__name__:
        return f"rclpy.{name}"
    return f"executor.{name}" if module == "rclpy.executors" else ""
