"""Keep what callbacks print out of the cells: it goes to the log, attributed to its node."""

from __future__ import annotations

import sys
import threading
from typing import Any, TextIO

from course.runtime.callbacks.callback_runs import CallbackRun, current_job

_lock = threading.Lock()


class JobAwareStream:
    """Stands in for sys.stdout or sys.stderr; everything passes through except from callbacks."""

    def __init__(self, stream: TextIO, level: str) -> None:
        """Pass through to `stream`; what callbacks write is logged with `level`."""
        self._stream = stream
        self._level = level

    def write(self, text: str) -> int:
        """Write to the stream, or to the log if a callback runs in this thread."""
        job = current_job()
        if job is None:
            return self._stream.write(text)
        unfinished = job.unfinished = job.unfinished or {}
        *lines, unfinished[self._level] = (unfinished.get(self._level, "") + text).split("\n")
        for line in lines:
            job.log_line(self._level, line)
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write each of `lines`."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Flush the stream, unless a callback asks: it has written nothing there."""
        if current_job() is None:
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        """Be the stream in everything else."""
        return getattr(self._stream, name)

    def __iter__(self) -> Any:
        """Be the stream."""
        return iter(self._stream)


def install_streams() -> None:
    """Stand in for the present sys.stdout and sys.stderr. Cheap if that is so already."""
    if type(sys.stdout) is JobAwareStream and type(sys.stderr) is JobAwareStream:
        return
    with _lock:
        for name, level in (("stdout", "PRINT"), ("stderr", "STDERR")):
            stream = getattr(sys, name)
            if stream is not None and type(stream) is not JobAwareStream:
                setattr(sys, name, JobAwareStream(stream, level))


def uninstall_streams() -> None:
    """Put the streams back that were there, unless somebody has replaced ours. Idempotent."""
    with _lock:
        for name in ("stdout", "stderr"):
            stream = getattr(sys, name)
            if type(stream) is JobAwareStream:
                setattr(sys, name, stream._stream)


def finish_lines(job: CallbackRun) -> None:
    """Log what a callback printed without a line end."""
    for level, rest in (job.unfinished or {}).items():
        if rest:
            job.log_line(level, rest)
