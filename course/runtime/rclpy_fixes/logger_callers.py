"""Make logging from a cell cheap: spare rclpy the search for the module that logs.

For each line rclpy's Python loggers ask `inspect` about the caller, which looks for the module that
the caller's file belongs to and remembers it. Code of a cell belongs to none: all modules that are
loaded, some thousands, are searched again for each line. In a notebook that takes milliseconds,
which is a good part of the time of a driver with an IMU at 100 Hz.
"""

from __future__ import annotations

import inspect
import sys
from types import FrameType

_LOGGING = ("rclpy.impl.rcutils_logger", "rclpy.logging")
_NOBODY = ""
"""A name that no module has: once it is noted for a file, `inspect` does not search again."""


def spare_the_next_search() -> None:
    """Have `inspect` remember that the file that logs now belongs to no module, if that is so.

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
