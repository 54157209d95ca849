"""What is logged from a cell must not cost what rclpy pays to find out who logs.

For each line rclpy's Python loggers ask `inspect` about the caller, which looks for the module that
the caller's file belongs to and remembers it. Code of a cell belongs to none: all modules that are
loaded, some thousands, are searched for each line anew. In a notebook that takes milliseconds, for
a driver with an IMU at 100 Hz a good part of its time.
"""

from __future__ import annotations

import inspect
import sys
from types import FrameType

_LOGGING = ("rclpy.impl.rcutils_logger", "rclpy.logging")
_NOBODY = ""
"""A name that no module has: what `inspect` found before, that there is none, it finds at once."""


def spare_the_next_search() -> None:
    """Have `inspect` remember that the file of who logs now belongs to no module, if that is so.

    To be called from what rclpy calls to write the line: by then it has made its search. A line of
    the middleware's own, which comes without one, and perhaps on a thread of C++ where no Python
    runs, leaves everything as it is.
    """
    frame: FrameType | None = sys._getframe(1).f_back
    searched = False
    while frame is not None and frame.f_globals.get("__name__") in _LOGGING:
        frame, searched = frame.f_back, True
    if frame is not None and searched:
        inspect.modulesbyfile.setdefault(frame.f_code.co_filename, _NOBODY)
