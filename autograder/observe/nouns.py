"""What a task names: its topics, services, actions and parameters, as an exam writes them down.

A noun is a description and nothing more: `autograder.observe.observed_node.ObservedNode` finds what
it describes, waits for it, and speaks of it in the words of the task.

Example:
    >>> from std_msgs.msg import String
    >>> beats = Topic("heartbeat", String, value=lambda message: message.data)
    >>> str(beats), beats.value(String(data="beat 1"))
    ('/heartbeat', 'beat 1')
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


def whole_message(message: Any) -> Any:
    """Return the message itself: all of it counts."""
    return message


@dataclass(frozen=True)
class Topic:
    """A topic of the task.

    Attributes:
        name: as in the task, without a leading slash if it has no namespace.
        type: the message's class.
        value: what of a message counts, such as its ``data``.
    """

    name: str
    type: Any
    value: Callable[[Any], Any] = whole_message

    def __str__(self) -> str:
        """Return its full name, as the graph has it."""
        return _full_name(self.name)


@dataclass(frozen=True)
class Service:
    """A service of the task: its name, and its type, such as ``SetBool``."""

    name: str
    type: Any

    def __str__(self) -> str:
        """Return its full name, as the graph has it."""
        return _full_name(self.name)


@dataclass(frozen=True)
class Action:
    """An action of the task: its name, and its type, such as ``Fibonacci``."""

    name: str
    type: Any

    def __str__(self) -> str:
        """Return its full name, as the graph has it."""
        return _full_name(self.name)


@dataclass(frozen=True)
class Parameter:
    """A parameter of the task's node.

    Attributes:
        name: as it is declared.
        default: its value when nobody has set it; its type is the parameter's.
    """

    name: str
    default: bool | int | float | str

    def __str__(self) -> str:
        """Return its name."""
        return self.name


def _full_name(name: str) -> str:
    return f"/{name.removeprefix('/')}"
