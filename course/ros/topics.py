"""Topics: list them, look at their endpoints, listen, measure their rate, publish."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Callable
from typing import Any

from course import ambient, plain, values
from course.errors import SessionError, WaitTimeout
from course.graph import reader, words
from course.graph.model import Graph, Topic
from course.ros.arguments import timeout as add_timeout
from course.runtime.arguments import seconds, whole
from course.runtime.offers import full_topic, load_type, type_on
from course.runtime.waiting import Deadline

NOUN = "topic"
_ENOUGH = 20  # messages for a rate that one late message does not spoil


def list_(show_types: bool = False, everything: bool = False) -> str:
    """List the topics."""
    topics = _graph(everything).topics
    return (
        "\n".join(
            f"{topic.name} [{', '.join(topic.types)}]" if show_types else topic.name
            for topic in topics
        )
        or "No topics."
    )


def info(topic: str, verbose: bool = False) -> str:
    """Show a topic's type and endpoints; -v with the QoS of each."""
    found = _topic(topic)
    lines = [f"Type: {', '.join(found.types)}"]
    for what, ends in (("Publisher", found.publishers), ("Subscription", found.subscriptions)):
        lines.append(f"{what} count: {len(ends)}")
        for end in ends if verbose else ():
            lines += [f"  Node: {end.node}", f"  Type: {end.type}"]
            lines += [f"    {policy}: {value}" for policy, value in end.qos.items()]
    lines += [f"! {words.mismatch(found.name, pair)}" for pair in found.mismatches]
    return "\n".join(lines)


def echo(topic: str, count: int = 1, timeout: float = 5.0) -> str:
    """Show the next messages of a topic."""
    whole(count, "-n", least=1, example=1)
    deadline = Deadline(seconds(timeout))
    with ambient.record(topic, limit=count, timeout=timeout) as recorder:
        try:
            messages = recorder.wait(count, round(deadline.left, 2))
        except WaitTimeout:
            messages = recorder.messages
            if not messages:
                raise
    return "---\n".join(
        plain.lines(values.to_data(stamped.message)) for stamped in messages[:count]
    )


def hz(topic: str, timeout: float = 5.0) -> str:
    """Measure the rate at which messages are published."""
    deadline = Deadline(seconds(timeout))
    with ambient.record(topic, timeout=timeout) as recorder:
        try:
            recorder.wait(_ENOUGH, round(deadline.left, 2))
        except WaitTimeout as error:
            if recorder.count < 2:
                raise _too_few(error, recorder.count, topic, timeout) from None
        stamps = [stamped.stamp_ns / 1e9 for stamped in recorder.messages]
        rate = recorder.rate()
    gaps = [later - earlier for earlier, later in itertools.pairwise(stamps)]
    return (
        f"average rate: {rate:.3f} Hz over {len(stamps)} messages\n"
        f"  period: min {min(gaps):.4f} s, max {max(gaps):.4f} s, "
        f"standard deviation {statistics.pstdev(gaps):.4f} s"
    )


def _too_few(error: WaitTimeout, count: int, topic: str, timeout: float) -> WaitTimeout:
    """Return what there is to say of a topic on which two messages did not come in time."""
    if not ambient.session().observer.count_publishers(_full(topic)):
        return error  # it says that nobody publishes: listening longer helps nobody
    only = "Only one message" if count else "No message"
    why = "" if count else f" {str(error).partition('. ')[2]}"
    return WaitTimeout(
        f"{only} arrived on {_full(topic)} in {timeout:g} s, and a rate takes two.{why} A slow "
        f"topic takes longer: %ros topic hz {topic} --timeout {4 * timeout:g}."
    )


def pub(topic: str, message: str, type: str = "") -> str:  # noqa: A002 - as the command line says
    """Publish one message, once a subscription is there to get it."""
    session = ambient.session()
    msg_type = (
        load_type(type, kind="msg")
        if type
        else type_on(session.observer, full_topic(session.observer, topic))
    )
    if msg_type is None:
        raise SessionError(
            f"Nobody uses {topic}, so its type is unknown: name it with --type, as in "
            "--type std_msgs/msg/String."
        )
    sent = values.from_text(msg_type, message)
    session.publish(topic, sent)
    return f"Published on {topic}: {values.to_data(sent)}"


def _graph(everything: bool = False) -> Graph:
    session = ambient.session()
    nodes = list(session.nodes.values())
    return reader.read(session.observer, everything=everything, own=nodes)


def _full(topic: str) -> str:
    return topic if topic.startswith("/") else f"/{topic}"


def _topic(name: str) -> Topic:
    topics = {topic.name: topic for topic in _graph(everything=True).topics}
    if _full(name) not in topics:
        shown = ", ".join(topic.name for topic in _graph().topics)
        raise SessionError(f"There is no topic {_full(name)}: there are {shown or 'none'}.")
    return topics[_full(name)]


def _declare_list(add: Callable[..., Any]) -> None:
    add("-t", "--show-types", action="store_true", help="with their types")
    add("-a", "--all", dest="everything", action="store_true", help="those that ROS hides, too")


def _declare_info(add: Callable[..., Any]) -> None:
    add("topic")
    add("-v", "--verbose", action="store_true", help="with the QoS of each endpoint")


def _declare_echo(add: Callable[..., Any]) -> None:
    add("topic")
    add("-n", "--count", type=int, default=1, help="how many messages")
    add_timeout(add)


def _declare_hz(add: Callable[..., Any]) -> None:
    add("topic")
    add_timeout(add)


def _declare_pub(add: Callable[..., Any]) -> None:
    add("topic")
    add("message", help="its fields as YAML, as in '{data: hello}'")
    add("--type", default="", help="its type, if nobody uses the topic yet")


VERBS = {
    "list": (list_, _declare_list),
    "info": (info, _declare_info),
    "echo": (echo, _declare_echo),
    "hz": (hz, _declare_hz),
    "pub": (pub, _declare_pub),
}
