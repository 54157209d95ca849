"""Which communication pattern a name stands for: topic, service or action, by the ROS graph."""

from __future__ import annotations

from collections.abc import Container
from typing import Any, Protocol

from autograder.observe.participants import of_others

SEND_GOAL = "/_action/send_goal"
"""Follows an action's name in that of the service that takes its goals (ROS 2 design: Actions)."""

Patterns = dict[str, str]
"""{pattern: type} of one name: ``{"topic": "std_msgs/msg/String"}``."""


class Graph(Protocol):
    """A node, as far as it sees the graph."""

    def get_publishers_info_by_topic(self, topic_name: str) -> list[Any]:
        """Return the publishers on a topic."""

    def get_subscriptions_info_by_topic(self, topic_name: str) -> list[Any]:
        """Return the subscriptions to a topic."""

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return all topics."""

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return all services."""

    def count_services(self, service_name: str) -> int:
        """Return how many serve one: a client alone puts a service on the graph, too."""


def find_patterns(graph: Graph, name: str) -> Patterns:
    """Return what others than the examiner offer under a full ``name``, with the types.

    A topic counts whoever is at which end of it.
    """
    found = {}
    ends = of_others(
        [*graph.get_publishers_info_by_topic(name), *graph.get_subscriptions_info_by_topic(name)]
    )
    if ends:
        found["topic"] = str(ends[0].topic_type)
    services = dict(graph.get_service_names_and_types())
    for pattern, service in (("service", name), ("action", f"{name}{SEND_GOAL}")):
        if service in services and graph.count_services(service):
            found[pattern] = str(services[service][0]).removesuffix("_SendGoal")
    return found


def find_near_miss(graph: Graph, name: str, known: Container[str] = ()) -> str:
    """Return a name on the graph that somebody may have meant to be ``name``; empty without one.

    One with the same ending, such as a private name has, or with something added.

    Args:
        graph: a node of the examiner's.
        name: the full name that is missed.
        known: full names that belong there.
    """
    seen = [*graph.get_topic_names_and_types(), *graph.get_service_names_and_types()]
    last = name.rsplit("/", 1)[-1]
    for other in sorted(str(found).partition("/_action/")[0] for found, _ in seen):
        is_near = f"{name}/" in f"{other}/" or other.endswith(f"/{last}")
        if is_near and other != name and other not in known:
            return other
    return ""


def with_article(pattern: str) -> str:
    """Return a pattern with its article: "an action", "a topic".

    >>> with_article("action"), with_article("topic")
    ('an action', 'a topic')
    """
    return f"an {pattern}" if pattern == "action" else f"a {pattern}"
