"""Which node brought which others to the executor that it runs in."""

from __future__ import annotations

import contextlib
import weakref
from collections.abc import Iterable, Iterator
from contextvars import ContextVar

from rclpy.node import Node

from course.runtime.callbacks.callback_runs import current_job

_arriving: ContextVar[Node | None] = ContextVar("arriving", default=None)


class NodeOwners:
    """Remembers which node brought which others: when it is paused, they are paused, too.

    A parent adds its children from a callback (``self.executor.add_node(child)``), or in the moment
    in which it is given an executor itself.
    """

    def __init__(self) -> None:
        """Begin with nodes that nobody brought."""
        # Weak on both ends: a parent refers to its children, and must not live on for their sake.
        self._parents: weakref.WeakKeyDictionary[Node, weakref.ref[Node]] = (
            weakref.WeakKeyDictionary()
        )

    @contextlib.contextmanager
    def note_arrival(self, node: Node) -> Iterator[None]:
        """Note who brings `node`, and that it brings whatever is added within the block."""
        job = current_job()
        parent = _arriving.get() or (job.node if job is not None else None)
        if parent is not None and parent is not node:
            self._parents.setdefault(node, weakref.ref(parent))
        token = _arriving.set(node)
        try:
            yield
        finally:
            _arriving.reset(token)

    def brought_by(self, parent: Node, among: Iterable[Node]) -> list[Node]:
        """Return those of some nodes that `parent` brought, or one that it brought, and so on."""
        return [
            node for node in among if node is not parent and parent in self._walk_ancestors(node)
        ]

    def _walk_ancestors(self, node: Node) -> Iterator[Node]:
        """Go through who brought `node`, who brought that one, and so on."""
        seen = {node}
        while (found := self._parents.get(node)) is not None:
            parent = found()
            if parent is None or parent in seen:
                return
            seen.add(parent)
            yield parent
            node = parent
