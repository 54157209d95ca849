"""A graph in words: what a screen reader reads, and what a notebook without widgets shows."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from course.graph.model import Endpoint, Exchange, Graph, Mismatch, Topic
from course.messages.yaml_text import format_count

_VALUE = re.compile(r"\b[A-Z][A-Z_]+\b")


def describe_graph(graph: Graph) -> str:
    """Return the whole graph as text, a paragraph a topic, service and action."""
    if not graph.nodes:
        return "No nodes."
    lines = [f"{format_count(len(graph.nodes), 'node')}: {', '.join(graph.nodes)}"]
    lines += [f"  Two nodes are called {name}: rename one." for name in graph.duplicate_names]
    for topic in graph.topics:
        lines += _topic_lines(topic)
    for kind, exchanges in (("service", graph.services), ("action", graph.actions)):
        for exchange in exchanges:
            lines += _exchange_lines(kind, exchange)
    return "\n".join(lines)


def describe_qos(endpoint: Endpoint) -> str:
    """Return an endpoint's QoS in one line, without what is at its default."""
    parts: list[str] = []
    for policy, value in endpoint.qos.items():
        if policy == "depth":
            parts[-1] += f"({value})"
        elif policy in ("deadline", "lifespan"):
            parts += [f"{policy} {value}"] if value != "none" else []
        elif policy != "liveliness" or value != "AUTOMATIC":
            parts.append(value)
    return ", ".join(parts)


def shorten_qos(endpoints: Iterable[Endpoint]) -> str:
    """Return the QoS of one node's endpoints on a topic as it stands in a drawing.

    Example:
        "reliable · volatile · 10"; the last is the depth of the queue, where it is known.
    """
    texts = dict.fromkeys(_shorten_endpoint(endpoint.qos) for endpoint in endpoints)
    return " or ".join(filter(None, texts))


def plain_words(text: str) -> str:
    """Return a text with the names of QoS values as everyday words: "best effort"."""
    return _VALUE.sub(lambda match: match[0].replace("_", " ").lower(), text)


def describe_mismatch(topic: str, pair: Mismatch) -> str:
    """Return one sentence about a pair that DDS does not connect."""
    source = "DDS reports it" if pair.from_event else "DDS does not connect them"
    return (
        f"{pair.publisher} and {pair.subscription} do not connect on {topic}: "
        f"{', '.join(policy.lower() for policy in pair.policies)} ({'; '.join(pair.reasons)}). "
        f"{source}."
    )


def join_policies(pairs: Iterable[Mismatch]) -> str:
    """Return the policies that break pairs, each once."""
    return ", ".join(dict.fromkeys(name.lower() for pair in pairs for name in pair.policies))


def _shorten_endpoint(qos: Mapping[str, str]) -> str:
    parts = [plain_words(qos[name]) for name in ("reliability", "durability") if name in qos]
    queue = "all" if qos.get("history") == "KEEP_ALL" else qos.get("depth", "")
    return " · ".join([*parts, *([queue] if queue else [])])


def _topic_lines(topic: Topic) -> Iterable[str]:
    yield f"topic {topic.name} ({', '.join(topic.types)})"
    for verb, ends in (("published by", topic.publishers), ("read by", topic.subscriptions)):
        for end in ends:
            yield f"  {verb} {end.node} [{describe_qos(end)}]"
        if not ends:
            yield f"  {verb} nobody"
    for pair in topic.mismatches:
        yield f"  ! {describe_mismatch(topic.name, pair)}"


def _exchange_lines(kind: str, exchange: Exchange) -> Iterable[str]:
    yield f"{kind} {exchange.name} ({exchange.type})"
    yield f"  served by {', '.join(exchange.servers) or 'nobody'}"
    if exchange.clients:
        yield f"  used by {', '.join(exchange.clients)}"
