"""A graph as Mermaid text: JupyterLab draws it, also from a saved notebook without a kernel."""

from __future__ import annotations

from collections.abc import Iterator

from course.graph import words
from course.graph.model import Exchange, Graph, Mismatch, Topic


def mermaid(graph: Graph) -> str:
    """Return a Mermaid flowchart: nodes as rounded boxes, topics as plain ones, mismatches in red.

    Arrows run from publisher over topic to subscription, and from client to server.
    """
    lines = ["flowchart LR"]
    names = sorted(set(graph.nodes) | _mentioned(graph))
    ids = {name: f"n{index}" for index, name in enumerate(names)}
    lines += [f"  {ids[name]}([{_quoted(name)}])" for name in names]
    links = 0
    broken: list[int] = []
    for index, topic in enumerate(graph.topics):
        lines.append(f"  t{index}[{_quoted(f'{topic.name}<br/>{_short(topic.types)}')}]")
        for line, red in _arrows(topic, f"t{index}", ids):
            lines.append(f"  {line}")
            broken += [links] if red else []
            links += 1
    for kind, exchanges in (("service", graph.services), ("action", graph.actions)):
        for index, exchange in enumerate(exchanges):
            lines += _exchange(kind, f"{kind[0]}x{index}", exchange, ids)
    if broken:
        lines.append(f"  linkStyle {','.join(map(str, broken))} stroke:#c00,color:#c00")
    return "\n".join(lines)


def _arrows(topic: Topic, ident: str, ids: dict[str, str]) -> Iterator[tuple[str, bool]]:
    """Yield (arrow, whether it is red) for each endpoint, and each pair that does not connect."""
    sent, heard = topic.broken
    for node in dict.fromkeys(end.node for end in topic.publishers):
        pairs = sent.get(node, [])
        untold = [pair for pair in pairs if pair not in heard.get(pair.subscription, [])]
        yield _arrow(ids[node], ident, untold), bool(pairs)
    for node in dict.fromkeys(end.node for end in topic.subscriptions):
        yield _arrow(ident, ids[node], heard.get(node, [])), node in heard


def _arrow(source: str, target: str, pairs: list[Mismatch]) -> str:
    if not pairs:
        return f"{source} --> {target}"
    return f"{source} -. {_quoted(f'{words.policies(pairs)} does not fit')} .-x {target}"


def _exchange(kind: str, ident: str, exchange: Exchange, ids: dict[str, str]) -> Iterator[str]:
    label = _quoted(f"{kind} {exchange.name}<br/>{_short((exchange.type,))}")
    yield f"  {ident}{{{{{label}}}}}"
    yield from (f"  {ids[node]} ==> {ident}" for node in exchange.clients)
    yield from (f"  {ident} ==> {ids[node]}" for node in exchange.servers)


def _mentioned(graph: Graph) -> set[str]:
    ends = [end.node for t in graph.topics for end in (*t.publishers, *t.subscriptions)]
    sides = [n for x in (*graph.services, *graph.actions) for n in (*x.servers, *x.clients)]
    return {*ends, *sides}


def _short(types: tuple[str, ...]) -> str:
    return ", ".join(type_.rpartition("/")[2] for type_ in types)


def _quoted(text: str) -> str:
    return '"' + text.replace('"', "#quot;") + '"'
