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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar


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
    kind: ClassVar[str] = "service"

    @property
    def services(self) -> list[str]:
        """The full names of the services that it is made of: its own."""
        return [str(self)]

    @property
    def topics(self) -> list[str]:
        """The full names of the topics that it is made of: none."""
        return []

    def __str__(self) -> str:
        """Return its full name, as the graph has it."""
        return _full_name(self.name)


@dataclass(frozen=True)
class Action:
    """An action of the task: its name, and its type, such as ``Fibonacci``.

    Example:
        >>> from test_msgs.action import Fibonacci
        >>> Action("drive", Fibonacci).services[0]
        '/drive/_action/send_goal'
    """

    name: str
    type: Any
    kind: ClassVar[str] = "action"

    @property
    def services(self) -> list[str]:
        """The full names of the services that it is made of (ROS 2 design, "Actions")."""
        return [f"{self}/_action/{part}" for part in ("send_goal", "cancel_goal", "get_result")]

    @property
    def topics(self) -> list[str]:
        """The full names of the topics that it is made of; its server publishes on them."""
        return [f"{self}/_action/{part}" for part in ("feedback", "status")]

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


@dataclass(frozen=True)
class Task:
    """What the node of a task is connected to.

    Attributes:
        node: the name of its class in the notebook.
        publishes: topics that it publishes on.
        subscribes: topics that it listens to.
        serves: its services and actions.
        calls: services that it is a client of, which the examiner plays.
        uses: services and actions that it is a client of, whose servers come and go.
        parameters: those that it declares.
        threads: how many run its callbacks.
    """

    node: str
    publishes: Sequence[Topic] = ()
    subscribes: Sequence[Topic] = ()
    serves: Sequence[Service | Action] = ()
    calls: Sequence[Service] = ()
    uses: Sequence[Service | Action] = ()
    parameters: Sequence[Parameter] = ()
    threads: int = 1


def _full_name(name: str) -> str:
    return f"/{name.removeprefix('/')}"
