"""What a drawing of a graph consists of: its parts, and the links between them with their QoS."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from course.graph import graph_text
from course.graph.model import Endpoint, Exchange, Graph, Mismatch, Topic

_REASON_CHARS, _REASON_LINES = 24, 5

Key = tuple[str, str]
"""Kind and name of a part: "node", "topic", "service" or "action"."""


@dataclass(frozen=True)
class Part:
    """A node, topic, service or action, with a note below its name and what a pointer tells."""

    kind: str
    name: str
    note: str
    tip: str
    bad: bool = False


@dataclass(frozen=True)
class Link:
    """An arrow between two parts.

    ``qos`` is what stands at it ("reliable · volatile · 10"), ``reasons`` are the lines that say
    why nothing passes.
    """

    source: Key
    target: Key
    kind: str
    tip: str
    bad: bool = False
    qos: str = ""
    reasons: tuple[str, ...] = ()


def list_parts(graph: Graph) -> Iterator[Part]:
    """Yield the parts of ``graph``: nodes first."""
    mentioned = {end.node for t in graph.topics for end in (*t.publishers, *t.subscriptions)}
    mentioned |= {n for x in (*graph.services, *graph.actions) for n in (*x.servers, *x.clients)}
    for name in sorted(mentioned | set(graph.nodes)):
        twins = name in graph.duplicate_names
        tip = f"Two nodes are called {name}: rename one." if twins else f"node {name}"
        yield Part("node", name, "", tip, twins)
    for topic in graph.topics:
        ends = [
            f"published by {end.node} [{graph_text.describe_qos(end)}]" for end in topic.publishers
        ]
        ends += [
            f"read by {end.node} [{graph_text.describe_qos(end)}]" for end in topic.subscriptions
        ]
        note = ", ".join(_short_type(type_) for type_ in topic.types)
        yield Part(
            "topic", topic.name, note, "\n".join([f"topic {topic.name}", *topic.types, *ends]),
            bad=bool(topic.mismatches),
        )  # fmt: skip
    for kind, exchanges in (("service", graph.services), ("action", graph.actions)):
        for exchange in exchanges:
            tip = f"{kind} {exchange.name}\n{exchange.type}"
            yield Part(kind, exchange.name, f"{kind} {_short_type(exchange.type)}", tip)


def list_links(graph: Graph) -> Iterator[Link]:
    """Yield the links of ``graph``: publisher to topic to subscription, client to server."""
    for topic in graph.topics:
        yield from _topic_links(topic)
    for kind, exchanges in (("service", graph.services), ("action", graph.actions)):
        for exchange in exchanges:
            yield from _exchange_links(kind, exchange)


def _topic_links(topic: Topic) -> Iterator[Link]:
    here = ("topic", topic.name)
    sent, heard = topic.broken_pairs
    for node, ends in _by_node(topic.publishers).items():
        pairs = sent.get(node, [])
        # What both arrows of a pair would say is said once, where it arrives.
        untold = [pair for pair in pairs if pair not in heard.get(pair.subscription, [])]
        yield Link(
            ("node", node), here, "topic", _endpoint_tip(topic, ends, "offers", sent),
            bool(pairs), graph_text.shorten_qos(ends), _explain_pairs(untold),
        )  # fmt: skip
    for node, ends in _by_node(topic.subscriptions).items():
        pairs = heard.get(node, [])
        yield Link(
            here, ("node", node), "topic", _endpoint_tip(topic, ends, "requests", heard),
            bool(pairs), graph_text.shorten_qos(ends), _explain_pairs(pairs),
        )  # fmt: skip


def _by_node(ends: Iterable[Endpoint]) -> dict[str, list[Endpoint]]:
    found: dict[str, list[Endpoint]] = {}
    for end in ends:
        found.setdefault(end.node, []).append(end)
    return found


def _endpoint_tip(
    topic: Topic, ends: list[Endpoint], does: str, broken: Mapping[str, list[Mismatch]]
) -> str:
    """Return what a node's endpoints on a topic offer or request, and what breaks them."""
    node = ends[0].node
    said = [f"{node} {does} {graph_text.describe_qos(end)}" for end in ends]
    said += [graph_text.describe_mismatch(topic.name, pair) for pair in broken.get(node, [])]
    return "\n".join(dict.fromkeys(said))


def _explain_pairs(pairs: list[Mismatch]) -> tuple[str, ...]:
    """Return why pairs do not connect, in short lines."""
    texts = dict.fromkeys(
        f"{graph_text.join_policies([pair])}: {graph_text.plain_words('; '.join(pair.reasons))}"
        for pair in pairs
    )
    lines = [
        line for text in texts for line in textwrap.wrap(text.rstrip(": "), _REASON_CHARS)
    ]  # fmt: skip
    more = lines[_REASON_LINES:]
    return (*lines[:_REASON_LINES], *(["…"] if more else []))


def _exchange_links(kind: str, exchange: Exchange) -> Iterator[Link]:
    here = (kind, exchange.name)
    for node in exchange.clients:
        yield Link(("node", node), here, kind, f"{node} uses {exchange.name}")
    for node in exchange.servers:
        yield Link(here, ("node", node), kind, f"{node} serves {exchange.name}")


def _short_type(type_: str) -> str:
    return type_.rpartition("/")[2]
