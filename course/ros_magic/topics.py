"""Topics: list them, look at their endpoints, listen, measure their rate, publish."""

from __future__ import annotations

import contextlib
from typing import Any

from rclpy.qos import QoSProfile

from course.errors import SessionError
from course.graph import graph_text, reader
from course.graph.model import Graph, Topic
from course.learner_session import default_session
from course.messages import yaml_text
from course.messages.types import load_type, type_name
from course.messages.values import to_data
from course.ros_magic import listening
from course.ros_magic.options import Add, split_operands, type_and_values
from course.ros_magic.options import declare_timeout as add_timeout
from course.ros_magic.qos import declare_options as declare_qos
from course.ros_magic.qos import profile_from_options
from course.ros_magic.repetitions import declare_repetitions as add_repetitions
from course.ros_magic.repetitions import parse_repetitions
from course.ros_magic.topic_types import build_message, message_type
from course.util.argument_checks import check_whole_number

NOUN = "topic"


def list_(
    show_types: bool = False, everything: bool = False, count: bool = False, verbose: bool = False
) -> str:
    """List the topics."""
    topics = _read_graph(everything).topics
    if count:
        return str(len(topics))
    if not verbose:
        return "\n".join(_topic_line(topic, show_types) for topic in topics) or "No topics."
    lines = []
    for what, side in (("Published", "publishers"), ("Subscribed", "subscriptions")):
        lines.append(f"{what} topics:")
        for topic in topics:
            if ends := getattr(topic, side):
                counted = yaml_text.format_count(len(ends), side.removesuffix("s"))
                lines.append(f" * {_topic_line(topic, True)} {counted}")
    return "\n".join(lines)


def _topic_line(topic: Topic, show_types: bool) -> str:
    return f"{topic.name} [{', '.join(topic.types)}]" if show_types else topic.name


def show_type(topic: str) -> str:
    """Show a topic's type."""
    return "\n".join(_find_topic(topic).types)


def find(asked: str) -> str:
    """List the topics of a type."""
    wanted = type_name(load_type(asked, kind="msg"))
    found = [topic.name for topic in _read_graph(everything=True).topics if wanted in topic.types]
    return "\n".join(found) or f"No topic is of type {wanted}."


def info(topic: str, verbose: bool = False) -> str:
    """Show a topic's type and endpoints; -v with the QoS of each."""
    found = _find_topic(topic)
    lines = [f"Type: {', '.join(found.types)}"]
    for what, ends in (("Publisher", found.publishers), ("Subscription", found.subscriptions)):
        lines.append(f"{what} count: {len(ends)}")
        for end in ends if verbose else ():
            lines += [f"  Node: {end.node}", f"  Type: {end.type}"]
            lines += [f"    {policy}: {value}" for policy, value in end.qos.items()]
    lines += [f"! {graph_text.describe_mismatch(found.name, pair)}" for pair in found.mismatches]
    return "\n".join(lines)


def pub(
    topic: str, asked: str, text: str, named: str, once: bool, times: int | None,
    rate: float | None, subscriptions: int | None, timeout: float, **qos: Any,
) -> str:  # fmt: skip
    """Publish one message, once a subscription is there to get it; -r and -t for more."""
    session = default_session.session()
    asked, text = split_operands(asked, text, named)
    msg_type = message_type(topic, asked)
    number, rate = parse_repetitions(once, times, rate)
    endless = number > 1 and times is None
    least = subscriptions if subscriptions is not None else 0 if endless else 1
    check_whole_number(least, "-w", least=0, example=1)
    offered = profile_from_options(qos, "default") or QoSProfile(depth=10)
    sent = build_message(msg_type, text, session)
    if number == least == 1:
        session.publish(topic, sent, qos=offered, timeout=timeout)
        return f"Published on {topic}: {to_data(sent)}"
    done, others = 0, 0
    with session.publisher(msg_type, topic, qos=offered, timeout=timeout) as publisher:
        waited = f"{yaml_text.format_count(least, 'subscription')} of {topic} with a QoS that fits"
        session.until(lambda: publisher.get_subscription_count() >= least, timeout, waited)
        with contextlib.suppress(KeyboardInterrupt):
            for number_sent in session.paced(number, rate):
                sent = build_message(msg_type, text, session)
                publisher.publish(sent)
                done, others = number_sent, max(others, publisher.get_subscription_count())
    heard = (
        yaml_text.format_count(others, "subscription") if others else "nobody: no subscription fits"
    )
    return (
        f"Published {yaml_text.format_count(done, 'message')} on {topic}, to {heard}: "
        f"{to_data(sent)}"
    )


def _read_graph(everything: bool = False) -> Graph:
    session = default_session.session()
    nodes = list(session.nodes.values())
    return reader.read_graph(session.observer, everything=everything, own=nodes)


def _full_name(topic: str) -> str:
    return topic if topic.startswith("/") else f"/{topic}"


def _find_topic(name: str) -> Topic:
    topics = {topic.name: topic for topic in _read_graph(everything=True).topics}
    if _full_name(name) not in topics:
        shown = ", ".join(topic.name for topic in _read_graph().topics)
        raise SessionError(f"There is no topic {_full_name(name)}: there are {shown or 'none'}.")
    return topics[_full_name(name)]


def _declare_list(add: Add) -> None:
    add("-t", "--show-types", action="store_true", help="with their types")
    add("-c", "--count-topics", dest="count", action="store_true", help="only how many there are")
    add("-v", "--verbose", action="store_true", help="who publishes and who subscribes, counted")
    add("-a", "--all", "--include-hidden-topics", dest="everything", action="store_true",
        help="those that ROS hides, too")  # fmt: skip


def _declare_topic(add: Add) -> None:
    add("topic", metavar="TOPIC")


def _declare_info(add: Add) -> None:
    _declare_topic(add)
    add("-v", "--verbose", action="store_true", help="with the QoS of each endpoint")


def _declare_find(add: Add) -> None:
    add("asked", metavar="TYPE", help="as in std_msgs/msg/String")


def _declare_pub(add: Add) -> None:
    _declare_topic(add)
    type_and_values(add, "std_msgs/msg/String", "'{data: hello}'")
    add_repetitions(add, "publish")
    add("-w", "--wait-matching-subscriptions", dest="subscriptions", type=int, metavar="N",
        help="wait for so many (1; 0 with -r)")  # fmt: skip
    add_timeout(add)
    declare_qos(add)


VERBS = {
    "list": (list_, _declare_list),
    "info": (info, _declare_info),
    "echo": (listening.echo, listening.declare_echo),
    "hz": (listening.hz, listening.declare_hz),
    "pub": (pub, _declare_pub),
    "type": (show_type, _declare_topic),
    "find": (find, _declare_find),
}
