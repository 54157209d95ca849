"""A design as a graph (Mermaid, which JupyterLab draws) and as text that says the same."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from typing import Protocol

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from course.design.endpoints import DesignEndpoint
from course.design.findings import Declared, Link, find_links
from course.graph.shapes import MERMAID
from course.messages.yaml_text import format_count

_WORDS = {"msg": "topic", "srv": "service", "action": "action"}


class Drawn(Protocol):
    """What is read of a design."""

    @property
    def nodes(self) -> Mapping[str, Declared]:
        """Its nodes, by label."""

    @property
    def outside(self) -> Container[str]:
        """The names that somebody else provides or uses."""

    def findings(self) -> list[str]:
        """Return what is worth another look, a sentence each."""


def draw_mermaid(design: Drawn) -> str:
    """Return the graph: its shapes are those of `shapes.MERMAID`, its labels the QoS."""
    begin, end = MERMAID["node"]
    nodes = {label: f"n{number}" for number, label in enumerate(design.nodes)}
    lines = ["flowchart LR"]
    lines += [f'  {key}{begin}"<b>{label}</b>"{end}' for label, key in nodes.items()]
    for number, link in enumerate(find_links(design.nodes.values())):
        lines += _draw_link(link, f"l{number}", nodes, link.name in design.outside)
    return "\n".join(lines)


def _draw_link(link: Link, key: str, nodes: dict[str, str], outside: bool) -> Iterator[str]:
    begin, end = MERMAID[_WORDS[link.kind]]
    types = ", ".join(dict.fromkeys(e.type_name.split("/")[-1] for _, e in link.all_ends))
    yield f'  {key}{begin}"{link.name}<br/><small>{types}</small>"{end}'
    arrow = "-->" if link.kind == "msg" else "-.->"
    yield from (f"  {nodes[label]} {_arrow(end)} {key}" for label, end in link.writers)
    yield from (f"  {key} {_arrow(end)} {nodes[label]}" for label, end in link.readers)
    if outside:
        if not link.writers:
            yield f"  o{key}((outside)) {arrow} {key}"
        if not link.readers:
            yield f"  {key} {arrow} o{key}((outside))"


def _arrow(end: DesignEndpoint) -> str:
    """Return an arrow with the QoS of its endpoint: "reliable · volatile · 10"."""
    if end.role.type_kind != "msg":
        return "-.->"
    qos = qos_in_words(end.qos).replace(", ", " · ").replace("keep last ", "")
    return f'-- "{qos}" -->'


def describe_design(design: Drawn) -> str:
    """Return the same as text: nodes, links, and what is worth another look."""
    if not design.nodes:
        return "A design without nodes: begin with design.node('name')."
    connections = find_links(design.nodes.values())
    nodes = format_count(len(design.nodes), "node")
    links = format_count(len(connections), "link")
    lines = [f"A design of {nodes} and {links}", "", "Nodes"]
    for node in design.nodes.values():
        lines += [f"  {line}" for line in node_lines(node)]
    lines += ["", "Links"]
    lines += [f"  {_in_words(link, link.name in design.outside)}" for link in connections]
    if found := design.findings():
        lines += ["", "Look again", *(f"  {sentence}" for sentence in found)]
    return "\n".join(lines)


def node_lines(node: Declared) -> list[str]:
    """Return a node and its endpoints, a line each."""
    own = " (a node of your own)" if node.factory is not None else ""
    return [f"{node.label}{own}", *(f"    {_end_in_words(end)}" for end in node.endpoints)]


def _end_in_words(end: DesignEndpoint) -> str:
    what = f"{end.role.replace('_', ' ')} {end.full_name} ({end.type_name}"
    return f"{what}; {qos_in_words(end.qos)})" if end.role.type_kind == "msg" else f"{what})"


def qos_in_words(qos: QoSProfile) -> str:
    """Return reliability, durability and history of a profile as a phrase."""
    words = [
        "best effort" if qos.reliability == ReliabilityPolicy.BEST_EFFORT else "reliable",
        "transient local" if qos.durability == DurabilityPolicy.TRANSIENT_LOCAL else "volatile",
        "keep all" if qos.history == HistoryPolicy.KEEP_ALL else f"keep last {qos.depth}",
    ]
    return ", ".join(words)


def _in_words(link: Link, outside: bool) -> str:
    nobody = "(outside the design)" if outside else "(nobody)"
    writers = ", ".join(label for label, _ in link.writers) or nobody
    readers = ", ".join(label for label, _ in link.readers) or nobody
    return f"{_WORDS[link.kind]} {link.name}: {writers} -> {readers}"
