"""A graph as Mermaid text: JupyterLab draws it, also from a saved notebook without a kernel."""

from __future__ import annotations

from collections.abc import Iterator

from course.graph import graph_text
from course.graph.model import Exchange, Graph, Mismatch, Topic


def draw_mermaid(graph: Graph) -> str:
    """Return a Mermaid flowchart: nodes as rounded boxes, topics as plain ones, mismatches in red.

    Arrows run from publisher over topic to subscription, and from client to server.
    """
    lines = ["flowchart LR"]
    names = sorted(set(graph.nodes) | _mentioned_nodes(graph))
    ids = {name: f"n{index}" for index, name in enumerate(names)}
    lines += [f"  {ids[name]}([{_quote_text(name)}])" for name in names]
    links = 0
    broken: list[int] = []
    for index, topic in enumerate(graph.topics):
        lines.append(
            f"  t{index}[{_quote_text(f'{topic.name}<br/>{_shorten_types(topic.types)}')}]"
        )
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
    for node in dict.fromkeys(end.node for end in topic.publishers):
        pairs = sent.get(node, [])
        untold = [pair for pair in pairs if pair not in heard.get(pair.subscription, [])]
        yield _format_arrow(ids[node], ident, untold), bool(pairs)
    for node in dict.fromkeys(end.node for end in topic.subscriptions):
        yield _format_arrow(ident, ids[node], heard.get(node, [])), node in heard


def _format_arrow(source: str, target: str, pairs: list[Mismatch]) -> str:
    if not pairs:
        return f"{source} --> {target}"
    return (
        f"{source} -. {_quote_text(f'{graph_text.join_policies(pairs)} does not fit')} .-x {target}"
    )


def _exchange_lines(
    kind: str, ident: str, exchange: Exchange, ids: dict[str, str]
) -> Iterator[str]:
    label = _quote_text(f"{kind} {exchange.name}<br/>{_shorten_types((exchange.type,))}")
    yield f"  {ident}{{{{{label}}}}}"
    yield from (f"  {ids[node]} ==> {ident}" for node in exchange.clients)
    yield from (f"  {ident} ==> {ids[node]}" for node in exchange.servers)


def _mentioned_nodes(graph: Graph) -> set[str]:
    ends = [end.node for t in graph.topics for end in (*t.publishers, *t.subscriptions)]
    sides = [n for x in (*graph.services, *graph.actions) for n in (*x.servers, *x.clients)]
    return {*ends, *sides}


def _shorten_types(types: tuple[str, ...]) -> str:
    return ", ".join(type_.rpartition("/")[2] for type_ in types)


def _quote_text(text: str) -> str:
    return '"' + text.replace('"', "#quot;") + '"'
