"""The line magic ``%ros``, and what the Tab key offers after it."""

# mypy: allow-untyped-calls

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable
from typing import Any

from course import ambient
from course.errors import CourseError
from course.graph import reader
from course.graph.model import Graph
from course.interfaces import installed
from course.ros import arguments

_NOUNS = {
    "topic": ("list", "info", "echo", "hz", "pub"),
    "node": ("list", "info"),
    "service": ("list", "call"),
    "action": ("list", "send_goal"),
    "param": ("list", "get", "set"),
    "interface": ("show", "list"),
}

_VALUED = ("-n", "--count", "--timeout", "--type")  # options that a value follows
_PATIENCE = 1.0  # s that the Tab key waits for a node to answer


def register(shell: Any) -> None:
    """Add ``%ros`` and its completion to an IPython shell. Idempotent."""
    shell.register_magic_function(ros, magic_kind="line", magic_name="ros")
    for key in ("%ros", "ros"):
        shell.set_hook("complete_command", _complete, str_key=key)


def ros(line: str) -> None:
    """Look at the ROS graph of this notebook, and use it.

    Usage::

        %ros topic list | info -v /scan | echo /scan | hz /scan | pub /chatter '{data: hi}'
        %ros node list | info /camera
        %ros service list | call /lamp '{data: true}'
        %ros action list | send_goal /fibonacci '{order: 5}' -f
        %ros param list /camera | get /camera rate | set /camera rate 5.0
        %ros interface show sensor_msgs/msg/Image
    """
    arguments.run(line)


def candidates(words: list[str]) -> list[str]:
    """Return what may follow ``words`` (after ``%ros``), the last of them unfinished."""
    *done, _ = words
    if not done:
        return list(_NOUNS)
    noun, *rest = done
    if not rest:
        return list(_NOUNS.get(noun, ()))
    verb = rest[0]
    if done[-1] == "--type":
        noun, operands = "interface", []
    elif done[-1] in _VALUED:
        return []
    else:
        operands = [
            word
            for before, word in itertools.pairwise(done[1:])
            if word and not word.startswith("-") and before not in _VALUED
        ]
    with contextlib.suppress(CourseError):
        return _names(noun, verb, operands)
    return []


def _names(noun: str, verb: str, operands: list[str]) -> list[str]:
    if noun == "interface":
        return [f"{p}/{i}" for p, names in installed.interfaces().items() for i in sorted(names)]
    if noun == "param" and len(operands) == 1:
        from course.ros.parameters import names_of

        return names_of(operands[0], _PATIENCE)
    if operands or verb == "list":
        return []
    graph = reader.read(ambient.session().observer)
    of: dict[str, Callable[[Graph], list[str]]] = {
        "topic": lambda g: [topic.name for topic in g.topics],
        "node": lambda g: list(g.nodes),
        "param": lambda g: list(g.nodes),
        "service": lambda g: [service.name for service in g.services],
        "action": lambda g: [action.name for action in g.actions],
    }
    return of[noun](graph) if noun in of else []


def _complete(_shell: Any, event: Any) -> list[str]:
    line = event.line.lstrip().removeprefix("%").removeprefix("ros").lstrip()
    words = line.split(" ")
    return [name for name in candidates(words) if name.startswith(event.symbol)]
