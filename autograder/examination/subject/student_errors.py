"""What a student's callbacks and threads raised: in which line, and whether by their own doing."""

from __future__ import annotations

import os
import re
import sysconfig
import threading
import time
import traceback
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

import rclpy

MUST_NOT_SPIN = " (a callback must not spin: it runs because somebody spins already; await instead)"
"""What rclpy does not say where a callback calls ``rclpy.spin_until_future_complete``."""

SUBJECT_ENV = "AUTOGRADER_SUBJECT"
"""Set in a subject: `autograder.check` in a student's own cell then has nothing to do."""

TRACE_LINES = 6
_KEPT_ERRORS = 50  # errors of threads: one that is started again and again must not fill the memory

_STDLIB = str(sysconfig.get_path("stdlib"))
_INSTALLED = tuple({sysconfig.get_path(name) for name in ("purelib", "platlib")})
_OURS = tuple(str(Path(__file__).parents[3] / part) for part in ("autograder", "course"))
_BUILT_AT = re.compile(r",? at /\S+\.(?:c|cpp|h|hpp):\d+")
"""Where rcl and rmw were compiled, which they add to their messages."""


def describe_error(error: BaseException) -> str:
    """Return what was raised, and its message if it has one."""
    name, message = type(error).__name__, _BUILT_AT.sub("", str(error))
    if isinstance(error, SyntaxError) and error.lineno:
        # Its message has the name that IPython gives to the cell.
        message = f"{error.msg}, in line {error.lineno}"
    return f"{name}: {message}" if message else name


def is_spin_error(error: BaseException) -> bool:
    """Return whether ``error`` came out of one of rclpy's own functions that spin."""
    return any(
        frame.filename == rclpy.__file__ and frame.name.startswith("spin")
        for frame in traceback.extract_tb(error.__traceback__)
    )


def student_trace(error: BaseException) -> str:
    """Return the last frames of ``error`` that are the student's: not Python's, rclpy's or ours."""
    frames = _student_frames(error)[-TRACE_LINES:]
    told = (
        f"  {_describe_place(f)}, in {f.name}\n" + (f"    {f.line}\n" if f.line else "")
        for f in frames
    )
    return "".join(told)[:4000]


def student_line(error: BaseException) -> str:
    """Return the last line of the student's on the way to ``error``, or ""."""
    return _describe_line(_student_frames(error)[-1:])


def own_line(error: BaseException) -> str:
    """Return the student's line that raised ``error``, or "" if it was raised further in.

    What rclpy raises in a call of theirs may be a race of its own; what Python's library raises
    there is not.
    """
    frames = traceback.extract_tb(error.__traceback__)
    while frames and _of_python(frames[-1].filename):
        frames.pop()
    return _describe_line([frame for frame in frames[-1:] if is_students(frame.filename)])


def _describe_line(frames: list[traceback.FrameSummary]) -> str:
    return "".join(f"{_describe_place(frame)}: {frame.line}".removesuffix(": ") for frame in frames)


def _describe_place(frame: traceback.FrameSummary) -> str:
    """Return which line of which cell or file a frame is in, without the way to a file.

    A cell has the number that stands beside it. Where a notebook is run to be graded, from top to
    bottom, it is how many code cells there are up to it; what it was at the student's is not known.
    """
    from IPython.core.getipython import get_ipython  # it takes long, and an engine needs it not

    shell = get_ipython()
    cell = shell.compile.format_code_name(frame.filename) if shell is not None else None
    if cell is None:
        return f"line {frame.lineno} of {Path(frame.filename).name}"
    name = " ".join(cell)  # Cell In[3]
    if SUBJECT_ENV in os.environ:
        name = f"code cell {re.sub('[^0-9]', '', name)}"
    return f"line {frame.lineno} of {name}"


def _student_frames(error: BaseException) -> list[traceback.FrameSummary]:
    frames = traceback.extract_tb(error.__traceback__)
    return [frame for frame in frames if is_students(frame.filename)]


def is_students(filename: str) -> bool:
    """Return whether a frame's file is the student's: not Python's, a package's or ours."""
    return not (_of_python(filename) or filename.startswith((*_INSTALLED, *_OURS)))


def _of_python(filename: str) -> bool:
    # On some systems packages are installed within the library's folder.
    installed = filename.startswith(_INSTALLED)
    return filename.startswith((_STDLIB, "<frozen")) and not installed


class ThreadError(NamedTuple):
    """An exception that ended a thread: the thread's name, when (s since the epoch), and what."""

    thread: str
    stamp: float
    exception: BaseException

    def __str__(self) -> str:
        """Return the error, and the student's line where it came from, if it is known."""
        line = student_line(self.exception)
        where = f" (at {line})" if line else ""
        return f"{describe_error(self.exception)}{where}"


class ThreadErrors:
    """Within its block, notes what ends threads; the hook that was set before is still called.

    Python only prints it to standard error, where nobody reads it.
    """

    def __init__(self) -> None:
        """Note nothing yet."""
        self.items: list[ThreadError] = []
        self._before = threading.excepthook

    def __enter__(self) -> ThreadErrors:
        """Begin to listen."""
        self._before, threading.excepthook = threading.excepthook, self._note_error
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop listening; a hook that was set meanwhile stays."""
        if threading.excepthook == self._note_error:
            threading.excepthook = self._before

    def _note_error(self, args: threading.ExceptHookArgs) -> None:
        if args.exc_value is not None and len(self.items) < _KEPT_ERRORS:
            name = args.thread.name if args.thread is not None else ""
            self.items.append(ThreadError(name, time.time(), args.exc_value))
        self._before(args)
