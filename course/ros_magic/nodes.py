"""Nodes: list them, and show what each one has."""

from __future__ import annotations

from collections.abc import Iterable

from course.errors import SessionError
from course.graph import reader
from course.graph.model import Endpoint, Exchange, Graph
from course.learner_session import default_session
from course.ros_magic.options import Add

NOUN = "node"


def list_(everything: bool = False, count: bool = False) -> str:
    """List the nodes."""
    nodes = _read_graph(everything).nodes
    return str(len(nodes)) if count else "\n".join(nodes) or "No nodes."


def info(node: str) -> str:
    """Show a node's publishers, subscriptions, services and actions."""
    graph = _read_graph(everything=True)
    name = node if node.startswith("/") else f"/{node}"
    if name not in graph.nodes:
        shown = ", ".join(_read_graph().nodes)
        raise SessionError(f"There is no node {name}: there are {shown or 'none'}.")
    ends = [(t.name, e) for t in graph.topics for e in (*t.publishers, *t.subscriptions)]
    lines = [name]
    lines += _endpoint_lines("Publishers", name, (e for e in ends if e[1].role == "publisher"))
    lines += _endpoint_lines(
        "Subscriptions", name, (e for e in ends if e[1].role == "subscription")
    )
    for what, exchanges in (("Service", graph.services), ("Action", graph.actions)):
        lines += _exchange_lines(what, name, exchanges)
    return "\n".join(lines)


def _endpoint_lines(title: str, node: str, ends: Iterable[tuple[str, Endpoint]]) -> list[str]:
    own = [f"    {topic}: {end.type}" for topic, end in ends if end.node == node]
    return [f"  {title}:", *dict.fromkeys(own)] if own else []


def _exchange_lines(what: str, node: str, exchanges: tuple[Exchange, ...]) -> list[str]:
    lines = []
    for title, side in (("servers", "servers"), ("clients", "clients")):
        own = [x for x in exchanges if node in getattr(x, side)]
        if own:
            lines += [f"  {what} {title}:", *(f"    {x.name}: {x.type}" for x in own)]
    return lines


def _read_graph(everything: bool = False) -> Graph:
    session = default_session.session()
    return reader.read_graph(session.observer, everything=everything)


def _declare_list(add: Add) -> None:
    add("-a", "--all", dest="everything", action="store_true", help="those that ROS hides, too")
    add("-c", "--count-nodes", dest="count", action="store_true", help="only how many there are")


def _declare_info(add: Add) -> None:
    add("node", metavar="NODE")


VERBS = {"list": (list_, _declare_list), "info": (info, _declare_info)}
