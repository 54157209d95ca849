"""What the ROS graph offers on a topic: a QoS that fits it, its type, and why nothing arrives."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.exceptions import NameValidationException
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.qos import (
    DurabilityPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name

from course.errors import SessionError, WaitTimeout
from course.messages import yaml_text
from course.messages.types import load_type, type_name
from course.runtime.ros_names import full_name, node_name
from course.util import argument_checks
from course.util.close_matches import close_match


def full_topic(node: Node, topic: str) -> str:
    """Return `topic` as the graph spells it, seen from `node`.

    Raises:
        SessionError: it is not a topic name.
    """
    return _resolve_name(
        node.resolve_topic_name, argument_checks.check_text(topic, "The topic", "/scan"), "topic"
    )


def full_service(node: Node, name: str) -> str:
    """Return the service `name` as the graph spells it, seen from `node`.

    Raises:
        SessionError: it is not a service name.
    """
    name = argument_checks.check_text(name, "The service", "/reset")
    return _resolve_name(node.resolve_service_name, name, "service")


def full_action(node: Node, name: str) -> str:
    """Return the action `name` as the graph spells it, seen from `node`.

    Raises:
        SessionError: it is not a name of an action.
    """
    name = argument_checks.check_text(name, "The action", "/dock")
    return _resolve_name(node.resolve_service_name, name, "action")


def full_node(node: Node | str) -> str:
    """Return the fully qualified name of a node, or of the node of that name.

    Raises:
        SessionError: it is neither a node nor the name of one.
    """
    if isinstance(node, Node):
        return node_name(node)
    name = argument_checks.check_text(node, "The name of a node", "/camera")
    name = name if name.startswith("/") else f"/{name}"
    space, _, last = name.rpartition("/")
    try:
        validate_namespace(space or "/")
        validate_node_name(last)
    except NameValidationException as error:  # the rule, and then a drawing of where
        reason = str(error).splitlines()[0].partition(": ")[2].rstrip(":")
        raise SessionError(f"{yaml_text.short_repr(node)} is not a node name: {reason}.") from None
    return name


def _resolve_name(resolve: Callable[[str], str], name: str, kind: str) -> str:
    try:
        return str(resolve(name))
    except RuntimeError as error:  # rclpy's RCLError: the reason, and a place in its C source
        reason = str(error).removeprefix("failed to resolve name: ").partition(", at ")[0]
        article = "an" if kind == "action" else "a"
        raise SessionError(f"{name!r} is not {article} {kind} name: {reason}.") from None


def fitting_qos(node: Node, topic: str, depth: int) -> QoSProfile:
    """Return the strongest QoS that every publisher on `topic` can serve.

    RELIABLE and TRANSIENT_LOCAL are requested only if every publisher offers them: a stronger
    request than the offer is not matched at all (DDS 1.4, section 2.2.3: requested/offered).
    """
    offers = [info.qos_profile for info in node.get_publishers_info_by_topic(topic)]
    reliable = offers and all(o.reliability == ReliabilityPolicy.RELIABLE for o in offers)
    durable = offers and all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if durable else DurabilityPolicy.VOLATILE,
    )


def type_on(node: Node, topic: str) -> Any | None:
    """Return the message class of `topic`, or None while nobody publishes or subscribes to it.

    Raises:
        SessionError: its type is not installed here.
    """
    for name, offered in node.get_topic_names_and_types():
        if name == topic:
            return load_type(offered[0], topic)
    return None


def require_type(name: str, ros_type: Any, on_graph: list[tuple[str, list[str]]]) -> None:
    """Check that the topic or service `name`, if it is on the graph, has the type `ros_type`.

    Within one process, DDS refuses an endpoint of another type, and complains on the console;
    between two, it would wait for ever. So this is asked before an endpoint is made.

    Raises:
        WaitTimeout: it has another type: waiting is pointless.
    """
    types = dict(on_graph).get(name)
    wanted = type_name(ros_type)
    if types and wanted not in types:
        raise WaitTimeout(f"{name} is of type {', '.join(sorted(types))}, not {wanted}.")


def why_no_message(node: Node, topic: str, msg_type: Any, qos: QoSProfile) -> str:
    """Return one sentence that says why a subscription got nothing."""
    publishers = node.get_publishers_info_by_topic(topic)
    if not publishers:
        return f"{nobody_publishes(node, topic)}."
    require_type(topic, msg_type, [(topic, [info.topic_type for info in publishers])])
    for info in publishers:
        verdict, reason = qos_check_compatible(info.qos_profile, qos)
        # Two default profiles give WARNING: what is left unsaid may or may not fit.
        if verdict == QoSCompatibility.ERROR:
            reasons = ", ".join(part.strip() for part in _split_reasons(reason))
            return f"The QoS that {info.node_name} offers on {topic} does not fit: {reasons}."
    count = len(publishers)
    return (
        f"{yaml_text.format_count(count, 'publisher')} on {topic} with a QoS that fits, "
        "but nothing was published while we listened."
    )


def nobody_publishes(node: Node, topic: str) -> str:
    """Return that nobody does, and the topic that may have been meant, as part of a sentence."""
    return f"Nobody publishes on {topic}{_suggest_name(topic, _published_topics(node))}"


def why_no_service(node: Node, name: str, srv_type: Any) -> str:
    """Return one sentence that says why the service `name` is not there."""
    services = dict(node.get_service_names_and_types())
    require_type(name, srv_type, list(services.items()))
    others = [service for service in services if node.count_services(service)]
    return f"Nobody offers {name}{_suggest_name(name, others)}."


def who_offers(node: Node, names: Sequence[str]) -> dict[str, list[str]]:
    """Return the nodes that publish these topics or serve these services; see `Session.offered`."""
    found: dict[str, set[str]] = defaultdict(set)
    for name in names:
        for info in node.get_publishers_info_by_topic(name):
            found[name].add(full_name(info.node_name, info.node_namespace))
    for name, namespace in node.get_node_names_and_namespaces():
        try:
            served = dict(node.get_service_names_and_types_by_node(name, namespace))
        except NodeNameNonExistentError:  # it has gone since
            continue
        for service in served.keys() & set(names):
            found[service].add(full_name(name, namespace))
    return {name: sorted(nodes) for name, nodes in found.items()}


def _published_topics(node: Node) -> list[str]:
    topics = [name for name, _ in node.get_topic_names_and_types()]
    return [name for name in topics if node.count_publishers(name)]


def _suggest_name(name: str, names: list[str]) -> str:
    close = close_match(name, names)
    return f" (is it {close}?)" if close else ""


def _split_reasons(reason: str) -> list[str]:
    parts = (part.strip() for part in reason.split(";"))
    return [p.removeprefix("ERROR:") for p in parts if p.startswith("ERROR:")] or [reason]
