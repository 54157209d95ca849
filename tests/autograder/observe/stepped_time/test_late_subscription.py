"""Who joins late asks for what was kept, if every publisher keeps it and can hand it out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from autograder.observe import Topic
from autograder.observe.stepped_time.late_subscription import LateSubscription

LEVELS = Topic("level", object, value=lambda message: message * 2)
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
VOLATILE = QoSProfile(depth=1)
KEPT_IN_VAIN = QoSProfile(
    depth=1,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    reliability=ReliabilityPolicy.BEST_EFFORT,
)


class FakeNode:
    """A node that sees publishers with these profiles."""

    def __init__(self, *offers: QoSProfile) -> None:
        self.offers = offers

    def get_publishers_info_by_topic(self, _: str) -> list[Any]:
        return [SimpleNamespace(qos_profile=qos, endpoint_gid=bytes(24)) for qos in self.offers]

    def create_subscription(self, _: Any, __: str, callback: Any, qos: QoSProfile) -> None:
        self.callback, self.qos = callback, qos


@pytest.mark.parametrize(
    ("offers", "durable", "unkept", "reliable"),
    [
        ([KEPT], True, "VOLATILE", True),
        ([VOLATILE], False, "VOLATILE", True),
        ([KEPT, VOLATILE], False, "VOLATILE", True),
        ([KEPT_IN_VAIN], False, "TRANSIENT_LOCAL, but BEST_EFFORT", False),
        ([], False, "VOLATILE", False),
    ],
)
def test_it_asks_for_no_more_than_all_publishers_offer(
    offers: list[QoSProfile], durable: bool, unkept: str, reliable: bool
) -> None:
    node = FakeNode(*offers)
    late = LateSubscription(node, LEVELS)  # type: ignore[arg-type]
    assert late.is_durable is durable
    assert (node.qos.durability == DurabilityPolicy.TRANSIENT_LOCAL) is durable
    assert (node.qos.reliability == ReliabilityPolicy.RELIABLE) is reliable
    if not durable:
        assert late.unkept == unkept


def test_the_newest_counts() -> None:
    node = FakeNode(KEPT)
    late = LateSubscription(node, LEVELS)  # type: ignore[arg-type]
    assert late.last is None
    node.callback(1)
    node.callback(3)
    assert late.last == 6
