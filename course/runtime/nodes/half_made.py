"""Nodes whose constructor raised: they stay on the graph, as in every program, and are known.

rclpy calls no ``destroy_node()`` of a node that was never made, and neither does a session: what a
constructor leaves behind is there to be seen until Python collects it, or the next run replaces it.
"""

from __future__ import annotations

import threading
import traceback
import weakref
from collections.abc import Callable, Hashable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from types import FrameType, TracebackType

from rclpy.node import Node

from course.runtime.ros_names import node_name
from course.runtime.teardown import destroy_leftovers, is_alive

_MAX_CHARS = 200  # characters of what a constructor raised


@dataclass(frozen=True)
class Remains:
    """What a constructor that raised has left behind; it is not kept from being collected.

    Attributes:
        name: the fully qualified name of the node.
        problem: what the constructor raised, as in ``OSError: no camera``.
        factory: what was to make the node.
        key: what a second run of the same is known by, or None.
    """

    name: str
    problem: str
    factory: object
    key: Hashable
    reference: weakref.ref[Node]
    threads_begun: tuple[weakref.ref[threading.Thread], ...]

    @property
    def node(self) -> Node | None:
        """The node, if it is still there."""
        node = self.reference()
        return node if node is not None and is_alive(node) else None

    @property
    def threads(self) -> list[str]:
        """The names of the threads that were begun in the constructor and still run."""
        begun = (reference() for reference in self.threads_begun)
        return sorted(thread.name for thread in begun if thread is not None and thread.is_alive())

    @property
    def what_is_left(self) -> str:
        """What is still there, in words; empty if nothing is."""
        words = ["the node on the graph"] if self.node is not None else []
        if names := self.threads:
            words.append(f"{'a thread' if len(names) == 1 else 'threads'} ({', '.join(names)})")
        return " and ".join(words)

    def __str__(self) -> str:
        """Return one sentence: which constructor raised what, and what of it is still there."""
        return (
            f"The constructor of {self.name} raised {self.problem} "
            f"It left {self.what_is_left} behind."
        )


class HalfMade:
    """The half-made nodes of one session. Thread-safe."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        """Know of none; `tell` passes a sentence on to the learner."""
        self._tell = tell
        self._known: list[Remains] = []
        self._lock = threading.Lock()

    def all_remains(self) -> list[Remains]:
        """Return those of which something is still there."""
        with self._lock:
            self._known = [remains for remains in self._known if remains.what_is_left]
            return list(self._known)

    def note_failure(
        self,
        error: BaseException,
        factory: object,
        key: Hashable,
        has_begun: Callable[[threading.Thread], bool],
    ) -> list[str]:
        """Note the nodes that `factory` had begun when it raised; return their names.

        Args:
            error: what it raised.
            factory: what raised it.
            key: what a second run of the same is known by, or None.
            has_begun: whether a thread was begun meanwhile.
        """
        threads = tuple(weakref.ref(one) for one in threading.enumerate() if has_begun(one))
        problem = f"{type(error).__name__}: {error}"[:_MAX_CHARS].rstrip(": .") + "."
        found = [
            Remains(node_name(node), problem, factory, key, weakref.ref(node), threads)
            for node in _half_made(error.__traceback__)
        ]
        with self._lock:
            self._known += [remains for remains in found if remains.what_is_left]
        return [remains.name for remains in found]

    def clear(self, matches: Callable[[Remains], bool], *, replaced: bool = True) -> None:
        """Take nodes off the graph, without their own ``destroy_node()``; say what is left.

        Args:
            matches: which of them.
            replaced: the learner is told of them, as they have come to run the next one.
        """
        for remains in filter(matches, self.all_remains()):
            if replaced:
                self._tell(_make_hint(remains))
            node = remains.node
            if node is not None:
                if node.executor is not None:
                    node.executor.remove_node(node)
                with suppress(Exception):  # half of a node: rclpy has no one error for it
                    destroy_leftovers(node)
            with self._lock:
                self._known = [other for other in self._known if other is not remains]


def _make_hint(remains: Remains) -> str:
    words = [
        str(remains), "Nobody calls destroy_node() of a node that was never made, so a constructor "
        "gives back what it has made before it raises.",
    ]  # fmt: skip
    if remains.node is not None:
        words.append("The session has now taken that node off the graph; in a program it stays.")
    if remains.threads:
        words.append("A thread that does not end by itself ends with the kernel or program.")
    return " ".join(words)


def _half_made(tb: TracebackType | None) -> list[Node]:
    """Return the nodes in the frames of a traceback: nothing else refers to one that is half made.

    They are known even if their constructor has destroyed them: it may have left a thread.
    """
    found: dict[int, Node] = {}
    for frame, _ in traceback.walk_tb(tb):
        for node in _nodes_of(frame):
            found[id(node)] = node
    return list(found.values())


def _nodes_of(frame: FrameType) -> Iterator[Node]:
    # A node with an executor is one that runs, and only happens to be mentioned: unless this is
    # its own constructor.
    own = frame.f_locals.get("self") if frame.f_code.co_name == "__init__" else None
    for value in list(frame.f_locals.values()):
        if not (issubclass(type(value), Node) and _has_begun(value)):
            continue
        if value is own or value.executor is None:
            yield value


def _has_begun(node: Node) -> bool:
    try:
        return bool(node_name(node))
    except Exception:  # noqa: BLE001 - super().__init__() not reached: rclpy has no one error for it
        return False
