"""Keeps what nodes log and print: bounded, per logger, at every level."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict, deque
from typing import NamedTuple

_KEPT_ROWS = 1000  # rows of one logger, and as many of its warnings and errors
_MOST_LOGGERS = 200
_MOST_BYTES = 16 * 2**20  # of all messages together

SEVERITIES = {
    "DEBUG": 10,
    "INFO": 20,
    "PRINT": 20,
    "WARN": 30,
    "STDERR": 30,
    "ERROR": 40,
    "FATAL": 50,
}
"""rcutils' severities, and where output of callbacks ranks among them."""

_NAMES = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}


class LogRow(NamedTuple):
    """One line of a log.

    Attributes:
        stamp: wall-clock time (s since the epoch).
        level: DEBUG, INFO, WARN, ERROR, FATAL; PRINT and STDERR for what a callback printed.
        node: fully qualified name of the node; the logger's name if it is no node's.
        message: the text.
    """

    stamp: float
    level: str
    node: str
    message: str


class _Entry(NamedTuple):
    stamp: float
    severity: int
    level: str
    logger: str
    message: str
    home: object | None


class LogStore:
    """What the loggers of this process said. Thread-safe."""

    def __init__(self) -> None:
        """Start empty."""
        # A flood of information does not push out the errors, which have a ring of their own. The
        # ring that nothing came into for the longest time is the first.
        self._rings: OrderedDict[tuple[str, bool], deque[_Entry]] = OrderedDict()
        self._bytes = 0
        self._owners: dict[str, set[int]] = {}
        self._lock = threading.Lock()

    def add(self, stamp: float, level: str | int, logger: str, message: str, home: object) -> None:
        """Add a line.

        Args:
            stamp: wall-clock time (s since the epoch).
            level: a name of `SEVERITIES`, or its number.
            logger: the logger's name, which is a node's with dots for slashes.
            message: the text.
            home: whose thread said it, or None if that is unknown.
        """
        name = level if isinstance(level, str) else level_name(level)
        severity = SEVERITIES.get(name, level if isinstance(level, int) else 0)
        entry = _Entry(stamp, severity, name, logger, message, home)
        key = (logger, severity >= SEVERITIES["WARN"])
        with self._lock:
            ring = self._rings.setdefault(key, deque())
            self._rings.move_to_end(key)
            ring.append(entry)
            self._bytes += len(message)
            if len(ring) > _KEPT_ROWS:
                self._drop_first(ring)
            while len(self._rings) > 2 * _MOST_LOGGERS or self._bytes > _MOST_BYTES:
                if not self._make_room(key):
                    break

    def claim_node(self, node: str, home: object) -> None:
        """Note that `home` runs the node of this fully qualified name."""
        with self._lock:
            self._owners.setdefault(logger_of(node), set()).add(id(home))

    def disclaim_nodes(self, home: object) -> None:
        """Forget whatever `home` claimed."""
        with self._lock:
            for owners in self._owners.values():
                owners.discard(id(home))

    def has_logger(self, logger: str) -> bool:
        """Whether a logger of this name has said something in this process, or is a node's here."""
        with self._lock:
            return (
                logger in self._owners
                or (logger, False) in self._rings
                or (logger, True) in self._rings
            )

    def rows_of(self, home: object, since: float) -> list[tuple[int, LogRow]]:
        """Return severity and row of what `home`'s nodes and threads said, oldest first.

        What nobody's node said (rcl itself, for instance) is everybody's.
        """
        with self._lock:
            entries = [entry for ring in self._rings.values() for entry in ring]
            owners = {logger: ids for logger, ids in self._owners.items() if ids}
        rows = []
        for entry in sorted(entries, key=lambda entry: entry.stamp):
            owner = _find_owner(entry.logger, owners)
            mine = entry.home is home or (
                entry.home is None and (owner is None or id(home) in owners[owner])
            )
            if mine and entry.stamp >= since:
                node = node_of(owner) if owner is not None else entry.logger
                row = LogRow(entry.stamp, entry.level, node, entry.message)
                rows.append((entry.severity, row))
        return rows

    def _make_room(self, key: tuple[str, bool]) -> bool:
        """Drop other information, then what is older in the ring of ``key``, then other errors."""
        ring = self._rings[key]
        others = [other for other in self._rings if other != key]
        rested = next((other for other in others if not other[1]), None)
        if rested is None and len(ring) > 1:
            for _ in range(len(ring) // 2):
                self._drop_first(ring)
            return True
        if not others:
            return False  # one message, however long, is kept
        dropped = self._rings.pop(rested or others[0])
        self._bytes -= sum(len(entry.message) for entry in dropped)
        return True

    def _drop_first(self, ring: deque[_Entry]) -> None:
        self._bytes -= len(ring.popleft().message)


store = LogStore()
"""The one store of this process: rcutils has one output handler for all of it."""


def add_line(level: str, node: str, message: str, home: object) -> None:
    """Add a line said just now by a callback of `node`."""
    store.add(time.time(), level, logger_of(node), message, home)


def level_name(severity: int) -> str:
    """Return the name of one of rcutils' severities; the number itself if it has none."""
    return _NAMES.get(severity, str(severity))


def logger_of(node: str) -> str:
    """Return the logger name of a fully qualified node name."""
    return node.strip("/").replace("/", ".")


def node_of(logger: str) -> str:
    """Return the fully qualified node name of a node's logger."""
    return "/" + logger.replace(".", "/")


def _find_owner(logger: str, owners: dict[str, set[int]]) -> str | None:
    """Return the node's logger that `logger` is, or is a child of."""
    while logger:
        if logger in owners:
            return logger
        logger = logger.rpartition(".")[0]
    return None
