"""Recorder: keeps what arrives on a topic, each message with its time."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, Self

from rclpy.qos import QoSProfile

from course.errors import WaitTimeout
from course.messages.types import type_name
from course.messages.yaml_text import format_count
from course.runtime.requests.graph_queries import (
    fitting_qos,
    full_topic,
    nobody_publishes,
    type_on,
    why_no_message,
)
from course.runtime.requests.hidden_node import Probe
from course.runtime.waiting import poll_condition
from course.util import argument_checks


class Stamped(NamedTuple):
    """A message and when it was published.

    Attributes:
        stamp_ns: time of publication (ns): simulated time in a session with `sim_time`, else the
            publisher's system clock since the epoch.
        message: the message.
    """

    stamp_ns: int
    message: Any


class Recorder:
    """Records a topic until `stop()`; the oldest messages go first when `limit` is reached."""

    def __init__(
        self,
        probe: Probe,
        topic: str,
        msg_type: Any | None,
        qos: QoSProfile | None,
        limit: int,
        now_ns: Callable[[], int | None],
        timeout: float,
    ) -> None:
        """Record through `probe`; `now_ns` is simulated time, or None without it.

        Without `msg_type`, wait `timeout` seconds for somebody to give the topic one.
        """
        self._probe = probe
        self._now_ns = now_ns
        self.topic = full_topic(probe.node, topic)
        self.msg_type = msg_type or self._wait_for_type(timeout)
        self.qos = qos or fitting_qos(probe.node, self.topic, limit)
        self._kept: deque[Stamped] = deque(maxlen=limit)
        self._count = 0
        self._lock = threading.Lock()
        self._subscription = probe.subscribe(
            self.msg_type, self.topic, self._keep_message, self.qos
        )

    @property
    def messages(self) -> list[Stamped]:
        """The messages that are kept, oldest first (a snapshot)."""
        with self._lock:
            return list(self._kept)

    @property
    def count(self) -> int:
        """Number of messages that arrived since the start or the last `clear()`."""
        return self._count

    def __len__(self) -> int:
        """Return the number of messages that are kept."""
        return len(self._kept)

    def wait(self, n: int = 1, timeout: float = 5.0) -> list[Stamped]:
        """Return the messages as soon as at least `n` have arrived.

        Raises:
            WaitTimeout: fewer arrived within `timeout` seconds; it says why if none did.
        """
        n, timeout = (
            argument_checks.check_whole_number(n, "n", least=0, example=1),
            argument_checks.check_seconds(timeout),
        )
        with self._probe.explaining():
            if poll_condition(lambda: self._count >= n, timeout, self._probe.pulse):
                return self.messages
            wanted = format_count(n, "message")
            message = f"{self._count} of {wanted} arrived on {self.topic} in {timeout:g} s."
            if not self._count:
                node = self._probe.node
                message += f" {why_no_message(node, self.topic, self.msg_type, self.qos)}"
            raise WaitTimeout(message, self.topic)

    def rate(self) -> float:
        """Return the mean rate of the kept messages in Hz; 0.0 with fewer than two of them."""
        stamps = [stamped.stamp_ns for stamped in self.messages]
        span = stamps[-1] - stamps[0] if stamps else 0
        return (len(stamps) - 1) * 1e9 / span if span > 0 else 0.0

    def clear(self) -> None:
        """Forget what has been recorded, and go on recording."""
        with self._lock:
            self._kept.clear()
            self._count = 0

    def save(self, path: str | Path) -> Path:
        """Write the kept messages to an MCAP file, for Foxglove or `ros2 bag`; return its path.

        Raises:
            RecordingError: the file cannot be written.
        """
        from course.messages import mcap_file

        return mcap_file.write_recordings(path, {self.topic: (self.msg_type, self.messages)})

    def stop(self) -> None:
        """Stop recording; what was recorded stays. Idempotent."""
        self._probe.drop(self._subscription)

    def __enter__(self) -> Self:
        """Return the recorder, which the `with` block stops at its end."""
        return self

    def __exit__(self, *exc: object) -> None:
        """Stop recording."""
        self.stop()

    def __repr__(self) -> str:
        """Return a summary for a notebook."""
        count = format_count(self._count, "message")
        return f"<Recorder of {self.topic} ({type_name(self.msg_type)}): {count}>"

    def _keep_message(self, message: Any, info: dict[str, int]) -> None:
        # The publisher's stamp, not ours: a busy machine delays callbacks, not the clock.
        simulated = self._now_ns()
        stamp = info["source_timestamp"] if simulated is None else simulated
        with self._lock:
            self._kept.append(Stamped(stamp, message))
            self._count += 1

    def _wait_for_type(self, timeout: float) -> Any:
        found = poll_condition(
            lambda: type_on(self._probe.node, self.topic), timeout, self._probe.pulse
        )
        if found is None:
            nobody = nobody_publishes(self._probe.node, self.topic)
            raise WaitTimeout(
                f"{nobody}, so after {timeout:g} s its type is still unknown: name it, as in "
                "record(topic, String).", self.topic,
            )  # fmt: skip
        return found
