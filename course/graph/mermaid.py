"""A graph as Mermaid text: JupyterLab draws it, also from a saved notebook without a kernel."""

from __future__ import annotations

from collections.abc import Iterator

from course.graph import graph_text
from course.graph.model import Endpoint, Exchange, Graph, Mismatch, Topic
from course.graph.shapes import MERMAID


def draw_mermaid(graph: Graph) -> str:
    """Return a Mermaid flowchart: its shapes are those of `shapes.MERMAID`, mismatches are red.

    Arrows run from publisher over topic to subscription, with their QoS, and from client to server.
    """
    lines = ["flowchart LR"]
    names = sorted(set(graph.nodes) | _mentioned_nodes(graph))
    ids = {name: f"n{index}" for index, name in enumerate(names)}
    lines += [f"  {ids[name]}{_enclose('node', _quote_text(name))}" for name in names]
    links = 0
    broken: list[int] = []
    for index, topic in enumerate(graph.topics):
        text = _quote_text(f"{topic.name}<br/>{_shorten_types(topic.types)}")
        lines.append(f"  t{index}{_enclose('topic', text)}")
        for line, red in _topic_arrows(topic, f"t{index}", ids):
            lines.append(f"  {line}")
            broken += [links] if red else []
            links += 1
    for kind, exchanges in (("service", graph.services), ("action", graph.actions)):
        for index, exchange in enumerate(exchanges):
            lines += _exchange_lines(kind, f"{kind[0]}x{index}", exchange, ids)
    if broken:
        lines.append(f"  linkStyle {','.join(map(str, broken))} stroke:#c00,color:#c00")
    return "\n".join(lines)


def _topic_arrows(topic: Topic, ident: str, ids: dict[str, str]) -> Iterator[tuple[str, bool]]:
    """Yield (arrow, whether it is red) for each endpoint, and each pair that does not connect."""
    sent, heard = topic.broken_pairs
    for node, ends in _by_node(topic.publishers):
        pairs = sent.get(node, [])
        untold = [pair for pair in pairs if pair not in heard.get(pair.subscription, [])]
        yield _format_arrow(ids[node], ident, ends, untold), bool(pairs)
    for node, ends in _by_node(topic.subscriptions):
        yield _format_arrow(ident, ids[node], ends, heard.get(node, [])), node in heard


def _by_node(ends: tuple[Endpoint, ...]) -> Iterator[tuple[str, list[Endpoint]]]:
    for node in dict.fromkeys(end.node for end in ends):
        yield node, [end for end in ends if end.node == node]


def _format_arrow(source: str, target: str, ends: list[Endpoint], pairs: list[Mismatch]) -> str:
    qos = graph_text.shorten_qos(ends)
    if not pairs:
        return f"{source} -- {_quote_text(qos)} --> {target}" if qos else f"{source} --> {target}"
    lines = [*([qos] if qos else []), f"{graph_text.join_policies(pairs)} does not fit"]
    return f"{source} -. {_quote_text('<br/>'.join(lines))} .-x {target}"


def _exchange_lines(
    kind: str, ident: str, exchange: Exchange, ids: dict[str, str]
) -> Iterator[str]:
    label = _quote_text(f"{kind} {exchange.name}<br/>{_shorten_types((exchange.type,))}")
    yield f"  {ident}{_enclose(kind, label)}"
    yield from (f"  {ids[node]} ==> {ident}" for node in exchange.clients)
    yield from (f"  {ident} ==> {ids[node]}" for node in exchange.servers)


def _enclose(kind: str, text: str) -> str:
    begin, end = MERMAID[kind]
    return f"{begin}{text}{end}"


def _mentioned_nodes(graph: Graph) -> set[str]:
    ends = [end.node for t in graph.topics for end in (*t.publishers, *t.subscriptions)]
    sides = [n for x in (*graph.services, *graph.actions) for n in (*x.servers, *x.clients)]
    return {*ends, *sides}


def _shorten_types(types: tuple[str, ...]) -> str:
    return ", ".join(type_.rpartition("/")[2] for type_ in types)


def _quote_text(text: str) -> str:
    return '"' + text.replace('"', "#quot;") + '"'
