"""Lives of a node, one after the other, and what this process holds after each of them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from rclpy.node import Node

from course.graph.reader import read_graph
from course.runtime.core_session import CoreSession
from course.runtime.requests.graph_queries import full_topic, type_on
from course.runtime.teardown import destroy_leftovers
from course.runtime.waiting import Pulse, poll_condition

SETTLE_S = 1.0
"""Seconds that the end of a life may take: what is then still there was left."""


class Held(NamedTuple):
    """What a process holds: threads, open files, and nodes with their endpoints on the graph."""

    threads: int
    files: int
    endpoints: int

    def without(self, before: Held) -> Held:
        """Return how much more this is than before."""
        return Held(*(now - then for now, then in zip(self, before, strict=True)))


def count_held(session: CoreSession) -> Held:
    """Return what this process holds now; of the graph, all that the session sees."""
    graph = read_graph(session.observer, everything=True)
    ends = sum(len(topic.publishers) + len(topic.subscriptions) for topic in graph.topics)
    ends += sum(len(each.servers) + len(each.clients) for each in graph.services + graph.actions)
    # As the examiner counts: the kernel's threads, and descriptors but for the one that lists them.
    threads, files = (len(list(Path("/proc/self", what).iterdir())) for what in ("task", "fd"))
    return Held(threads, files - 1, len(graph.nodes) + ends)


def live_repeatedly(
    session: CoreSession, make: Callable[[int], Node], topic: str, times: int, timeout: float
) -> list[Held]:
    """Make a node, wait until it publishes, and have it destroy itself, again and again.

    Nobody tidies up after ``destroy_node()`` until all has been counted.

    Args:
        session: runs the node.
        make: makes the node of a life, given its number: 0, 1 and so on.
        topic: a life lasts until a message comes here.
        times: how many lives are counted. One comes before them: it starts what the session needs.
        timeout: seconds that a message may take.

    Returns:
        What was held after that first life, and after each of the others.

    Raises:
        SessionError: ``make`` made no node.
        WaitTimeout: no message came.
    """
    held: list[Held] = []
    nodes: list[Node] = []
    try:
        for life in range(times + 1):
            node = session.run(lambda life=life: make(life))
            nodes.append(node)
            try:
                _await_message(session, topic, timeout)
            except BaseException:
                session.stop(node)
                raise
            session.let_go(node)
            node.destroy_node()
            held.append(_settle(session, held[-1] if held else None))
    finally:
        for node in nodes:
            session.let_go(node)
            destroy_leftovers(node)
    return held


def left_each(held: list[Held]) -> list[Held]:
    """Return what each life has left, from what was held before and after it.

    >>> left_each([Held(9, 20, 5), Held(10, 22, 5)])
    [Held(threads=1, files=2, endpoints=0)]
    """
    return [after.without(before) for before, after in pairwise(held)]


def _await_message(session: CoreSession, topic: str, timeout: float) -> None:
    name = full_topic(session.observer, topic)
    msg_type = session.until(
        lambda: type_on(session.observer, name), timeout, f"the node to use {name}"
    )
    session.next_message(msg_type, name, timeout=timeout)


def _settle(session: CoreSession, before: Held | None) -> Held:
    """Return what is held once that is no more than before, or after `SETTLE_S`."""

    def is_back() -> bool:
        return before is not None and max(count_held(session).without(before)) <= 0

    poll_condition(is_back, SETTLE_S, Pulse())
    return count_held(session)
