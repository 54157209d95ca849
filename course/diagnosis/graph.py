"""What the ROS graph shows: endpoints that do not fit, or that nobody answers."""

from __future__ import annotations

from collections.abc import Iterator

from course.doctor.finding import HealthFinding, make_problem, make_warning
from course.graph import graph_text, reader
from course.graph.model import Graph
from course.runtime.core_session import CoreSession
from course.runtime.requests.actions import SEND_GOAL
from course.util.close_matches import close_match

NEARLY = " (is it "
"""Stands in a message that names another topic, service or action, which may have been meant."""

_MENDS = {
    "RELIABILITY": "Offer RELIABLE, or request BEST_EFFORT.",
    "DURABILITY": "Offer TRANSIENT_LOCAL, or request VOLATILE.",
    "DEADLINE": "Offer a deadline that is no longer than the requested one.",
    "LIVELINESS": "Offer MANUAL_BY_TOPIC or a shorter lease, or request less.",
    "TYPE": "One topic carries one type: correct the type or the name on one side.",
}


def check_graph(session: CoreSession) -> Iterator[HealthFinding]:
    """Find what one look at the graph shows."""
    own = session.nodes
    graph = reader.read_graph(session.observer, own=list(own.values()))
    yield from find_mismatches(graph)
    yield from find_twins(graph, set(own))
    learners = set(own).difference(session.nodes_apart())
    yield from lonely_topics(graph, learners)
    yield from lonely_clients(graph, learners)


def find_mismatches(graph: Graph) -> Iterator[HealthFinding]:
    """Find publishers and subscriptions that DDS does not connect."""
    for topic, pair in graph.mismatches:
        mends = [_MENDS[policy] for policy in pair.policies if policy in _MENDS]
        what = "type" if "TYPE" in pair.policies else "QoS"
        yield make_problem(what, graph_text.describe_mismatch(topic, pair), " ".join(mends))


def find_twins(graph: Graph, own: set[str]) -> Iterator[HealthFinding]:
    """Find names that several nodes bear: one may be a ghost of an earlier run."""
    for name in graph.duplicate_names:
        where = "One is in this session" if name in own else "None is in this session"
        yield make_problem(
            "name", f"Several nodes are called {name}. {where}; another may be left from an "
            "earlier run, of a cell that made it with rclpy or of another program.",
            "Rename one, or end the other: restart the kernel that made it, or destroy_node() it.",
        )  # fmt: skip


def lonely_topics(graph: Graph, own: set[str]) -> Iterator[HealthFinding]:
    """Find endpoints of the session's nodes that have nobody on the other side."""
    published = [topic.name for topic in graph.topics if topic.publishers]
    read = [topic.name for topic in graph.topics if topic.subscriptions]
    for topic in graph.topics:
        readers = sorted({end.node for end in topic.subscriptions} & own)
        writers = sorted({end.node for end in topic.publishers} & own)
        if readers and not topic.publishers:
            yield make_warning(
                "topic", f"{', '.join(readers)} reads {topic.name}, and nobody publishes on it"
                f"{_suggest_name(topic.name, published)}.",
                "Start the publisher, or correct the name.",
            )  # fmt: skip
        elif writers and not topic.subscriptions and (near := _suggest_name(topic.name, read)):
            yield make_warning(
                "topic", f"{', '.join(writers)} publishes on {topic.name}, and nobody reads it"
                f"{near}.", "Correct the name on one side.",
            )  # fmt: skip


def lonely_clients(graph: Graph, own: set[str]) -> Iterator[HealthFinding]:
    """Find clients of the session's nodes that have no server, or one of another type."""
    for kind, exchanges in (("service", graph.services), ("action", graph.actions)):
        offered = {exchange.name: exchange for exchange in exchanges if exchange.servers}
        for exchange in exchanges:
            clients = ", ".join(sorted(set(exchange.clients) & own))
            if not clients or exchange.servers:
                continue
            if (other := offered.get(exchange.name)) is not None:
                yield make_problem(
                    "type", f"{clients} uses the {kind} {exchange.name} as {exchange.type}, and "
                    f"{', '.join(other.servers)} offers it as {other.type}: DDS never connects "
                    "them.", f"One {kind} has one type: correct the type or the name on one side.",
                )  # fmt: skip
            else:
                yield make_warning(
                    kind, f"{clients} uses the {kind} {exchange.name}, and nobody offers it"
                    f"{_suggest_name(exchange.name, list(offered))}.",
                    "Start its server, or correct the name.",
                )  # fmt: skip


def unoffered_names(graph: Graph, own: set[str]) -> list[str]:
    """Return the topics and services that nodes of the session use, and that nobody offers.

    An action is named by the service that takes its goals.
    """
    topics = [
        topic.name
        for topic in graph.topics
        if not topic.publishers and own & {end.node for end in topic.subscriptions}
    ]
    exchanges = [
        exchange.name + ending
        for ending, kind in (("", graph.services), (SEND_GOAL, graph.actions))
        for exchange in kind
        if not exchange.servers and own & set(exchange.clients)
    ]
    return topics + exchanges


def _suggest_name(name: str, names: list[str]) -> str:
    close = close_match(name, [other for other in names if other != name])
    return f"{NEARLY}{close}?)" if close else ""
