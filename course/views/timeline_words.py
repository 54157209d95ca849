"""What a timeline shows, in words."""

from __future__ import annotations

import time

from rclpy.serialization import deserialize_message

from course.messages.yaml_text import format_count
from course.watch import timeline
from course.watch.callbacks import CallbackTap
from course.watch.timeline import Figures, Trace
from course.worlds.messages import describe_message

MAX_READ_BYTES = 100_000
"""Bytes of a message that is read, to say what is in it."""


def describe_figures(figures: Figures) -> str:
    """Return figures in words."""
    if not figures.count:
        return "nothing"
    parts = [format_count(figures.count, "message")]
    if figures.rate is not None:
        parts.append(f"{figures.rate:.1f} Hz")
    if figures.latency_p50 is not None and figures.latency_p95 is not None:
        median, late = figures.latency_p50 * 1e3, figures.latency_p95 * 1e3
        parts.append(f"latency p50 {median:.2f} ms, p95 {late:.2f} ms")
    longest = max((end - begin for begin, end in figures.gaps), default=0.0)
    if figures.gaps:
        count = len(figures.gaps)
        parts.append(f"{format_count(count, 'gap')}, the longest {longest:.2f} s")
    if figures.lost:
        parts.append(f"{figures.lost} lost on the way")
    return ", ".join(parts)


def describe_shortening(trace: Trace, tap: CallbackTap, start: int) -> str:
    """Return, to be added to the figures, that what came since ``start`` (ns) is not all here."""
    begins = max(trace.complete_since, tap.complete_since)
    if begins <= start:
        return ""
    seconds = (time.time_ns() - begins) / 1e9
    return (
        f" (of the last {seconds:.1f} s only: a timeline keeps {timeline.KEPT_MESSAGES} messages "
        "of a topic, and as many runs of callbacks)"
    )


def describe_newest(trace: Trace) -> str:
    """Return the gist of the message that came last; "" before the first."""
    message = trace.newest_message
    if message is None:
        return ""
    if len(message) > MAX_READ_BYTES:
        return f"{len(message) // 1000} kB"
    return describe_message(deserialize_message(message, trace.msg_type))
