"""Why DDS does not connect two endpoints, in the words of the two profiles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from rclpy.duration import Duration
from rclpy.qos import QoSCompatibility, QoSProfile, qos_check_compatible

_ENDLESS_NS = 10**17  # ns, three years: what rmw calls unlimited is longer


class Refusal(NamedTuple):
    """What one end offers, and what the other one requests beyond that: phrases."""

    offered: str
    requested: str

    def as_sentence(self, publisher: str, subscription: str, topic: str) -> str:
        """Return it as a sentence about two ends of a topic."""
        return (
            f"{publisher} offers {self.offered} on {topic}, and {subscription} requests "
            f"{self.requested}, so DDS never connects them."
        )


def find_refusal(offered: QoSProfile, requested: QoSProfile) -> Refusal | None:
    """Return why DDS refuses to connect two endpoints, or None if it does connect them.

    Only an ERROR is a refusal: rmw reports a WARNING for two default profiles, too.
    """
    if not _is_refused(offered, requested):
        return None
    pairs = list(_unmet_policies(offered, requested)) or [("less", "more")]
    offers, requests = zip(*pairs, strict=True)
    return Refusal(" and ".join(offers), " and ".join(requests))


def _unmet_policies(offered: QoSProfile, requested: QoSProfile) -> Iterator[tuple[str, str]]:
    """Yield what is offered and requested of each policy of which more is asked than offered.

    These are all policies with a rule for what fits (DDS 1.4, table in 2.2.3).
    """
    for policy in ("reliability", "durability", "liveliness"):
        ends = getattr(offered, policy), getattr(requested, policy)
        if _is_refused(*(QoSProfile(depth=1, **{policy: end}) for end in ends)):
            yield ends[0].name, ends[1].name
    for policy, name in (("deadline", "deadline"), ("liveliness_lease_duration", "lease")):
        ends = getattr(offered, policy), getattr(requested, policy)
        if _is_refused(*(QoSProfile(depth=1, **{policy: end}) for end in ends)):
            yield _describe_span(ends[0], name), _describe_span(ends[1], name)


def _is_refused(offered: QoSProfile, requested: QoSProfile) -> bool:
    return bool(qos_check_compatible(offered, requested)[0] == QoSCompatibility.ERROR)


def _describe_span(span: Duration, name: str) -> str:
    if not 0 < span.nanoseconds < _ENDLESS_NS:
        return f"no {name}"
    return f"a {name} of {span.nanoseconds / 1e9:g} s"
