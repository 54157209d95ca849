"""The type of a topic, service or action, as asked for or as on the graph, and its messages."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from rosidl_parser.definition import NamespacedType

from course.errors import SessionError
from course.learner_session import default_session
from course.messages import values
from course.messages.types import load_type, type_name
from course.runtime.core_session import CoreSession
from course.runtime.requests.graph_queries import full_topic


def agreed_type(kind: str, name: str, asked: str, on_graph: Sequence[str]) -> Any:
    """Return the class of the type that was asked for, or that the graph has.

    Args:
        kind: "msg", "srv" or "action".
        name: the topic, service or action.
        asked: the type as it was typed, or "".
        on_graph: the types that it has; none if nobody uses it.

    Raises:
        SessionError: there is no such type, or it is not the one on the graph.
    """
    found = load_type(asked or on_graph[0], "" if asked else name, kind)
    if on_graph and type_name(found) not in on_graph:
        raise SessionError(
            f"{name} is of type {', '.join(on_graph)}, not {type_name(found)}: DDS connects equal "
            "types only, so leave the type out or correct it."
        )
    return found


def build_message(msg_type: Any, text: str, session: CoreSession) -> Any:
    """Return a message of what was typed, where ``auto`` is a header and ``now`` a time of now.

    Raises:
        MisfitError: it is no YAML, or a value does not fit its field.
    """
    now_ns = session.sim.now_ns if session.options["sim_time"] else time.time_ns()
    stamp = {"sec": now_ns // 10**9, "nanosec": now_ns % 10**9}
    return values.from_data(
        msg_type, _fill_stamps(msg_type, values.parse_text(msg_type, text), stamp)
    )


def _fill_stamps(msg_type: Any, data: Any, stamp: Mapping[str, int]) -> Any:
    if not isinstance(data, Mapping):
        return data
    filled = dict(data)
    for name, slot in values.message_fields(msg_type):
        if name not in data or not isinstance(slot, NamespacedType):
            continue
        given, kind = data[name], (slot.namespaces[0], slot.name)
        if given == "auto" and kind == ("std_msgs", "Header"):
            filled[name] = {"stamp": stamp}
        elif given == "now" and kind == ("builtin_interfaces", "Time"):
            filled[name] = stamp
        elif isinstance(given, Mapping):
            filled[name] = _fill_stamps(values.class_of(slot), given, stamp)
    return filled


def message_type(topic: str, asked: str) -> Any:
    """Return the class of a topic's type: as asked for, or as on the graph.

    Raises:
        SessionError: see `agreed_type`; or nobody uses the topic, and no type was asked for.
    """
    observer = default_session.session().observer
    name = full_topic(observer, topic)
    types = dict(observer.get_topic_names_and_types()).get(name, [])
    if not (asked or types):
        raise SessionError(
            f"Nobody uses {topic}, so its type is unknown: name it behind the topic, as in %ros "
            f'topic pub {topic} std_msgs/msg/String "data: hello".'
        )
    return agreed_type("msg", name, asked, types)
