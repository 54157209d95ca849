"""When a message was published: its writer says so, and is believed as far as that can be true."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

TRANSIT_NS = 500_000_000
"""For how long a message may be on its way: 0.1 ms as a rule, longer on a busy machine."""


def published_at(info: Mapping[str, Any], settled: int = 0) -> int:
    """Return when the message of ``info`` (rclpy's) was published, in ns of this machine's time.

    It is the source timestamp, which the writer's process sets, but never a time after the message
    was received here, nor one long before, nor one before ``settled`` if it was received later:
    that is a moment at which writer and reader were at rest, so that nothing was on its way.
    """
    received = received_at(info)
    earliest = received - TRANSIT_NS
    if received > settled:
        earliest = max(earliest, settled)
    return max(earliest, min(int(info["source_timestamp"]), received))


def received_at(info: Mapping[str, Any]) -> int:
    """Return when the message of ``info`` was received here, which its writer has no say in."""
    return int(info["received_timestamp"]) or time.time_ns()
