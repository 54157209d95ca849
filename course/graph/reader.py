"""Read the ROS graph through a node: what DDS discovery has told it, as a `Graph`."""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.topic_endpoint_info import TopicEndpointInfo

from course.graph.model import QOS_POLICIES, Endpoint, Exchange, Graph, Mismatch, Topic
from course.runtime.rclpy_fixes import incompatible_qos_events
from course.runtime.ros_names import full_name

_PLUMBING = ("/rosout", "/parameter_events", "/clock")
_PLUMBING_TYPES = ("rcl_interfaces/", "type_description_interfaces/")


End = tuple[str, str, str]
"""An endpoint of this process: (node, topic, role)."""


class Own(NamedTuple):
    """What only the process itself knows of its endpoints.

    Attributes:
        queues: profiles with history and depth.
        broken: policies that DDS has named in an incompatible-QoS event.
    """

    queues: dict[End, QoSProfile]
    broken: dict[End, set[str]]


def read_graph(
    node: Node,
    *,
    everything: bool = False,
    own: Iterable[Node] = (),
) -> Graph:
    """Return what ``node`` can see now.

    Args:
        node: any node of the context whose graph is wanted.
        everything: keep what the ROS tools hide, too: names that begin with an underscore,
            /rosout, /parameter_events, /clock, parameter services, and the topics of actions.
        own: nodes of this process: their history and depth are shown, too, which DDS never tells,
            and what DDS's own events have reported to them.
    """
    known = _own_endpoints(own)
    names = [
        (name, namespace)
        for name, namespace in node.get_node_names_and_namespaces()
        if everything or not _is_hidden(name)
    ]
    services, actions = _read_exchanges(node, names, everything)
    return Graph(
        nodes=tuple(sorted(full_name(name, namespace) for name, namespace in names)),
        topics=tuple(_read_topics(node, everything, known)),
        services=services,
        actions=actions,
    )


def _own_endpoints(nodes: Iterable[Node]) -> Own:
    own = Own({}, defaultdict(set))
    for node in nodes:
        with contextlib.suppress(InvalidHandle):  # what is destroyed just now has no more to tell
            name = node.get_fully_qualified_name()
            ends: list[tuple[str, Any]] = [("publisher", end) for end in node.publishers]
            ends += [("subscription", end) for end in node.subscriptions]
            for role, end in ends:
                where = (name, end.topic_name, role)
                own.queues[where] = end.qos_profile
                own.broken[where] |= incompatible_qos_events.incompatible_policies(end)
    return own


def _read_topics(node: Node, everything: bool, own: Own) -> Iterable[Topic]:
    for name, _ in sorted(node.get_topic_names_and_types()):
        if not everything and (name in _PLUMBING or _is_hidden(name)):
            continue
        pairs = [
            [
                (info, _make_endpoint(info, role, name, own.queues))
                for info in infos
                if everything or not _is_hidden(info.node_name)
            ]
            for role, infos in (
                ("publisher", node.get_publishers_info_by_topic(name)),
                ("subscription", node.get_subscriptions_info_by_topic(name)),
            )
        ]
        publishers, subscriptions = pairs
        if publishers or subscriptions:
            yield Topic(
                name,
                tuple(sorted(end for _, end in publishers)),
                tuple(sorted(end for _, end in subscriptions)),
                tuple(_find_mismatches(name, publishers, subscriptions, own.broken)),
            )


def _find_mismatches(
    topic: str,
    publishers: list[tuple[TopicEndpointInfo, Endpoint]],
    subscriptions: list[tuple[TopicEndpointInfo, Endpoint]],
    broken: dict[End, set[str]],
) -> Iterable[Mismatch]:
    for offered, writer in publishers:
        for requested, reader in subscriptions:
            if writer.type != reader.type:
                reason = f"carries {writer.type}, reads {reader.type}"
                yield Mismatch(writer.node, reader.node, (reason,), ("TYPE",))
                continue
            reasons = find_incompatibilities(offered.qos_profile, requested.qos_profile)
            if reasons:
                policies = tuple(reasons)
                named = broken.get((writer.node, topic, "publisher"), set()) | broken.get(
                    (reader.node, topic, "subscription"), set()
                )
                yield Mismatch(
                    writer.node, reader.node, tuple(reasons.values()), policies,
                    from_event=not named.isdisjoint(policies),
                )  # fmt: skip


def find_incompatibilities(offered: QoSProfile, requested: QoSProfile) -> dict[str, str]:
    """Return {policy: what does not fit} of a pair of profiles; empty if DDS connects them.

    The rules are DDS 1.4, section 2.2.3, as `qos_check_compatible` applies them.
    """
    verdict, _ = qos_check_compatible(offered, requested)
    if verdict != QoSCompatibility.ERROR:  # what is left unsaid gives a warning, and may well fit
        return {}
    ours, theirs = _describe_profile(offered), _describe_profile(requested)
    found = {
        policy.upper(): f"offers {ours[policy]}, requests {theirs[policy]}"
        for policy, changed in _CHANGES.items()
        if qos_check_compatible(
            *(_keep_policies(profile, changed) for profile in (offered, requested))
        )[0]
        == QoSCompatibility.ERROR
    }
    return found or {"QOS": "offers less than is requested"}


_CHANGES = {
    "reliability": ("reliability",),
    "durability": ("durability",),
    "deadline": ("deadline",),
    "liveliness": ("liveliness", "liveliness_lease_duration"),
}


def _keep_policies(profile: QoSProfile, policies: tuple[str, ...]) -> QoSProfile:
    """Return a default profile with only these policies of ``profile``."""
    return QoSProfile(depth=1, **{policy: getattr(profile, policy) for policy in policies})


def _make_endpoint(
    info: TopicEndpointInfo, role: Any, topic: str, queues: dict[End, QoSProfile]
) -> Endpoint:
    node = full_name(info.node_name, info.node_namespace)
    words = _describe_profile(info.qos_profile) | _describe_queue(
        queues.get((node, topic, role), info.qos_profile)
    )
    qos = {policy: words[policy] for policy in QOS_POLICIES if policy in words}
    return Endpoint(node, role, info.topic_type, qos, bytes(info.endpoint_gid).hex())


def _describe_profile(profile: QoSProfile) -> dict[str, str]:
    """Return a profile in words; what is unknown or not set is left out."""
    return {
        "reliability": profile.reliability.name,
        "durability": profile.durability.name,
        "liveliness": profile.liveliness.name,
        "deadline": _format_duration(profile.deadline),
        "lifespan": _format_duration(profile.lifespan),
    }


def _describe_queue(profile: QoSProfile) -> dict[str, str]:
    if profile.history == HistoryPolicy.KEEP_LAST:
        return {"history": "KEEP_LAST", "depth": str(profile.depth)}
    return {"history": "KEEP_ALL"} if profile.history == HistoryPolicy.KEEP_ALL else {}


def _format_duration(duration: Duration) -> str:
    seconds = duration.nanoseconds / 1e9
    return "none" if seconds <= 0 or seconds > 1e9 else f"{seconds:g} s"


def _read_exchanges(
    node: Node, names: list[tuple[str, str]], everything: bool
) -> tuple[tuple[Exchange, ...], tuple[Exchange, ...]]:
    found: dict[str, dict[tuple[str, str], tuple[set[str], set[str]]]] = {
        kind: defaultdict(lambda: (set(), set())) for kind in ("service", "action")
    }
    readers: tuple[tuple[str, int, Callable[[str, str], Any]], ...] = (
        ("service", 0, node.get_service_names_and_types_by_node),
        ("service", 1, node.get_client_names_and_types_by_node),
        ("action", 0, lambda *of: get_action_server_names_and_types_by_node(node, *of)),
        ("action", 1, lambda *of: get_action_client_names_and_types_by_node(node, *of)),
    )
    for name, namespace in names:
        for kind, side, ask in readers:
            try:
                answers = ask(name, namespace)
            except Exception:  # noqa: BLE001 - the node has gone since: rclpy has no one error
                continue
            for exchange, types in answers:
                if everything or not _is_plumbing(exchange, types[0]):
                    found[kind][exchange, types[0]][side].add(full_name(name, namespace))
    return tuple(
        tuple(
            Exchange(name, type_, tuple(sorted(servers)), tuple(sorted(clients)))
            for (name, type_), (servers, clients) in sorted(found[kind].items())
        )
        for kind in ("service", "action")
    )  # type: ignore[return-value]


def _is_plumbing(exchange: str, type_: str) -> bool:
    return type_.startswith(_PLUMBING_TYPES) or _is_hidden(exchange)


def _is_hidden(name: str) -> bool:
    return any(part.startswith("_") for part in name.split("/"))
