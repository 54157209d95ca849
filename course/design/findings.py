"""What is worth another look in a design: links that cannot work, found before anything runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Protocol

from rclpy.qos import QoSCompatibility, qos_check_compatible

from course.design.endpoints import DesignEndpoint


class Declared(Protocol):
    """What is read of a declared node."""

    endpoints: list[DesignEndpoint]
    factory: Any

    @property
    def label(self) -> str:
        """Its label."""


@dataclass
class Link:
    """A topic, service or action of a design, and who is at its two sides."""

    name: str
    kind: str
    writers: list[tuple[str, DesignEndpoint]] = field(default_factory=list)
    readers: list[tuple[str, DesignEndpoint]] = field(default_factory=list)

    @property
    def all_ends(self) -> list[tuple[str, DesignEndpoint]]:
        """Every (node, endpoint) of it."""
        return [*self.writers, *self.readers]


MISSING = {  # kind: what to say if nobody writes, and if nobody reads
    "msg": ("{names} subscribes to {link}, but nobody publishes on it.",
            "{names} publishes on {link}, but nobody subscribes to it."),
    "srv": ("", "{names} calls {link}, but nobody serves it."),
    "action": ("", "{names} sends goals to {link}, but no node is its action server."),
}  # fmt: skip


def find_links(nodes: Iterable[Declared]) -> list[Link]:
    """Return the topics, services and actions of declared nodes, in order of declaration."""
    found: dict[tuple[str, str], Link] = {}
    for node in nodes:
        for end in node.endpoints:
            link = found.setdefault(
                (end.full_name, end.role.type_kind), Link(end.full_name, end.role.type_kind)
            )
            (link.writers if end.role.is_writer else link.readers).append((node.label, end))
    return list(found.values())


def list_findings(nodes: Iterable[Declared], outside: frozenset[str]) -> list[str]:
    """Return what is worth another look, a sentence each."""
    return [sentence for link in find_links(nodes) for sentence in _check_link(link, outside)]


def type_clash(nodes: Iterable[Declared]) -> str:
    """Return what is wrong if two endpoints of one name have different types, else ""."""
    return next((clash for link in find_links(nodes) if (clash := _describe_clash(link))), "")


def _check_link(link: Link, outside: frozenset[str]) -> Iterator[str]:
    if clash := _describe_clash(link):
        yield clash
        return
    no_writer, no_reader = MISSING[link.kind]
    if link.name not in outside:
        if not link.writers and no_writer:
            yield no_writer.format(names=_join_names(link.readers), link=link.name)
        if not link.readers:
            yield no_reader.format(names=_join_names(link.writers), link=link.name)
    if link.kind != "msg" and len(link.readers) > 1:
        yield (
            f"{link.name} has {len(link.readers)} servers ({_join_names(link.readers)}): one is "
            "right."
        )
    for writer, offered in link.writers:
        for reader, requested in link.readers:
            if link.kind != "action" and (reason := _describe_refusal(offered, requested)):
                yield f"{writer} and {reader} do not connect on {link.name}: {reason}."


def _describe_clash(link: Link) -> str:
    types: dict[str, list[tuple[str, DesignEndpoint]]] = {}
    for label, end in link.all_ends:
        types.setdefault(end.type_name, []).append((label, end))
    if len(types) < 2:
        return ""
    uses = ", ".join(f"{name} in {_join_names(ends)}" for name, ends in types.items())
    return f"{link.name} has more than one type: {uses}."


def _describe_refusal(offered: DesignEndpoint, requested: DesignEndpoint) -> str:
    verdict, reason = qos_check_compatible(offered.qos, requested.qos)
    if verdict != QoSCompatibility.ERROR:  # two default profiles give a warning
        return ""
    parts = [part.strip() for part in str(reason).split(";")]
    return ", ".join(p.removeprefix("ERROR: ") for p in parts if p.startswith("ERROR:")) or reason


def _join_names(ends: list[tuple[str, DesignEndpoint]]) -> str:
    return " and ".join(dict.fromkeys(label for label, _ in ends))
