"""What nodes of other programs log, as it comes on the topic /rosout."""

from __future__ import annotations

import threading
from collections import deque

from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile

from course.runtime.core_session import CoreSession
from course.runtime.logs.log_store import LogRow, level_name, node_of, store

KEPT_LINES = 1000
"""Lines of other programs that are kept."""

MAX_CHARS = 10_000
"""Characters of one that are kept."""

_QOS = QoSProfile(depth=KEPT_LINES, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # as rcl offers it


class Rosout:
    """Collects the lines of nodes that this process does not run.

    Its own nodes' come on the topic, too; the log store has had them already, in full.
    """

    def __init__(self, session: CoreSession) -> None:
        """Listen on the domain of ``session``, beginning with the last seconds (rcl keeps 10)."""
        self._session = session
        self._rows: deque[LogRow] = deque(maxlen=KEPT_LINES)
        self._lock = threading.Lock()
        self._subscription = session.watch(Log, "/rosout", self._take_line, _QOS)

    @property
    def latest_rows(self) -> list[LogRow]:
        """The latest lines, in the order in which they came (a snapshot)."""
        with self._lock:
            return list(self._rows)

    def stop(self) -> None:
        """Listen no more. Idempotent."""
        self._session.unwatch(self._subscription)

    def _take_line(self, message: Log) -> None:
        if store.has_logger(message.name):
            return
        stamp = message.stamp.sec + message.stamp.nanosec / 1e9
        row = LogRow(
            stamp, level_name(message.level), node_of(message.name), message.msg[:MAX_CHARS]
        )
        with self._lock:
            self._rows.append(row)
