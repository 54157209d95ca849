"""What a pause has left tells what a consumer's queues hold."""

from __future__ import annotations

import pytest

from autograder.observe.relays.message_stream import UNLIMITED
from autograder.observe.relays.slow_reader import Backlog, Traffic

MOST, RATE_HZ = 5, 10.0
NEVER_OUT = "Of 15 messages in a pause the newest never came out"


def left(**seen: object) -> Backlog:
    """Return what a right consumer of 15 messages leaves, but for what was ``seen``."""
    right = {"count": 15, "published": 15, "kept": [14], "replayed": 1, "oldest_s": 0.1}
    return Backlog(**{**right, **seen})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("found", "fault"),
    [
        (left(), ""),
        (left(kept=[14, 15, 16]), ""),
        # A bound may be kept by number or by age.
        (left(replayed=10, oldest_s=0.4), ""),
        (left(replayed=5, oldest_s=1.0), ""),
        (left(replayed=10, oldest_s=1.0), "It then worked through the last 10 of 15 messages."),
        (left(kept=[14, 13]), "It passed them on out of order: messages 15, 14."),
        (left(kept=[3, 2]), f"{NEVER_OUT}: it got messages 4, 3."),
        (left(kept=[]), f"{NEVER_OUT}: it got nothing at all."),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_backlog_is_told(found: Backlog, fault: str) -> None:
    assert found.describe_fault(MOST, RATE_HZ) == fault


def test_so_much_traffic_comes_in_as_the_rate_or_a_limit_says() -> None:
    assert Traffic(seconds=1.5).count_at(RATE_HZ) == 15
    assert Traffic(seconds=1.5, limit=100).count_at(RATE_HZ) == 100
    assert Traffic(seconds=1.5).limit == UNLIMITED
