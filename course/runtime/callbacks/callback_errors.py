"""What callbacks raised, recorded with node and callback, for the learner to read."""

from __future__ import annotations

import inspect
import threading
import time
import traceback
from dataclasses import dataclass, field
from types import FunctionType, TracebackType
from typing import Any

from rclpy.service import Service

from course.runtime.callbacks.callback_runs import CallbackRun
from course.runtime.ros_names import node_name

_KEPT_ERRORS = 200  # different errors; a repeated one only counts up


@dataclass
class CallbackError:
    """An exception that left a callback; the node goes on spinning.

    Attributes:
        node: fully qualified name of the node, or "" if it belongs to none.
        callback: qualified name of the callback, such as ``SensorNode.read_imu``.
        exception: the exception itself, from the latest occurrence.
        traceback: its text, from the learner's own code on.
        problem: what happened, in words: ``raised ValueError: ...``.
        stamp: wall-clock time of the latest occurrence (s since the epoch).
        count: how often it was raised from the same line.
    """

    node: str
    callback: str
    exception: BaseException
    traceback: str
    problem: str
    stamp: float = field(default_factory=time.time)
    count: int = 1

    def __str__(self) -> str:
        """Return one sentence: which callback of which node raised what, and how often."""
        where = f" of {self.node}" if self.node else ""
        often = f" ({self.count} times)" if self.count > 1 else ""
        return f"{self.callback}{where} {self.problem}{often}"


class ErrorLog:
    """The callback errors of one session, in order of first occurrence. Thread-safe."""

    def __init__(self) -> None:
        """Start empty."""
        self.items: list[CallbackError] = []
        self._known: dict[tuple[object, ...], CallbackError] = {}
        self._lock = threading.Lock()

    def record(self, job: CallbackRun, exception: BaseException) -> None:
        """Add what `job` raised, or count it up if the same line raised it before."""
        frames = learner_frames(exception.__traceback__)
        error = CallbackError(
            node=node_name(job.node),
            callback=callback_name(job, frames),
            exception=exception,
            traceback="".join(
                traceback.format_exception(type(exception), exception, frames)
            ).rstrip(),
            problem=_describe_problem(job, exception),
        )
        last = traceback.extract_tb(frames)[-1:] if frames else []
        place = [(frame.filename, frame.lineno) for frame in last]
        key = (error.node, error.callback, type(exception), *place)
        with self._lock:
            before = self._known.get(key)
            if before is not None:
                before.__dict__.update(error.__dict__ | {"count": before.count + 1})
            elif len(self.items) < _KEPT_ERRORS:
                self._known[key] = error
                self.items.append(error)


def callback_name(job: CallbackRun, frames: TracebackType | None = None) -> str:
    """Return the qualified name of the callback that `job` runs, or the outermost of `frames`."""
    callback: Any = job.callback
    if isinstance(callback, FunctionType):  # a timeline's wrapper, say: what it wraps is meant
        callback = inspect.unwrap(callback, stop=lambda f: not isinstance(f, FunctionType))
    callback = getattr(callback, "func", callback)  # functools.partial
    name = getattr(callback, "__qualname__", None)
    if name is None and frames is not None:
        name = frames.tb_frame.f_code.co_qualname
    return str(name or "a callback").replace("<locals>.", "")


def _describe_problem(job: CallbackRun, exception: BaseException) -> str:
    thrown_by_rclpy = _first_learner_frame(exception.__traceback__) is None
    if thrown_by_rclpy and isinstance(exception, TypeError) and isinstance(job.entity, Service):
        return "did not return its response, so the client gets no answer"
    return f"raised {type(exception).__name__}: {exception}".rstrip(": ")


def learner_frames(tb: TracebackType | None) -> TracebackType | None:
    """Return the traceback from the first frame that is neither rclpy's nor ours.

    Where there is none (rclpy itself rejects what a callback returned), nothing is cut.
    """
    return _first_learner_frame(tb) or tb


def _first_learner_frame(tb: TracebackType | None) -> TracebackType | None:
    inner = tb
    while inner is not None:
        module = inner.tb_frame.f_globals.get("__name__", "")
        if module.partition(".")[0] not in ("rclpy", "course"):
            return inner
        inner = inner.tb_next
    return None
