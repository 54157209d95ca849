"""The line magic ``%ros``, and what the Tab key offers after it."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable
from typing import Any

from IPython.core.magic import no_var_expand

from course.errors import CourseError
from course.graph import reader
from course.graph.model import Graph
from course.interfaces import installed
from course.learner_session import default_session
from course.ros_magic import arguments

_PATIENCE_S = 1.0  # s that the Tab key waits for a node to answer


def register(shell: Any) -> None:
    """Add ``%ros`` and its completion to an IPython shell. Idempotent."""
    shell.register_magic_function(ros, magic_kind="line", magic_name="ros")
    for key in ("%ros", "ros"):
        shell.set_hook("complete_command", _complete_line, str_key=key)


@no_var_expand  # the braces of YAML are not Python's: {data: 1} is no variable
def ros(line: str) -> None:
    """Look at the ROS graph of this notebook, and use it.

    Usage::

        %ros topic list | info -v /scan | echo /scan | hz /scan
        %ros topic pub /chatter std_msgs/msg/String '{data: hi}'   (the type may be left out)
        %ros node list | info /camera
        %ros service list -t | call /lamp std_srvs/srv/SetBool '{data: true}'
        %ros action list | send_goal /fibonacci example_interfaces/action/Fibonacci '{order: 5}' -f
        %ros param list /camera | get /camera rate | set /camera rate 5.0
        %ros interface show sensor_msgs/msg/Image

    ``%ros topic pub -h`` shows what one of them takes. What has no end on a command line ends here
    by itself, after as many messages or seconds as its usage says.
    """
    arguments.run_line(line)


def find_candidates(words: list[str]) -> list[str]:
    """Return what may follow ``words`` (after ``%ros``), the last of them unfinished."""
    *done, _ = words
    nouns = arguments.noun_modules()
    if not done:
        return list(nouns)
    noun, *rest = done
    if noun not in nouns or not rest:
        return list(nouns[noun].VERBS) if noun in nouns else []
    verb = rest[0]
    valued = arguments.valued_options(noun, verb)
    if done[-1] in valued - {"--type"}:
        return []
    operands = [
        word
        for before, word in itertools.pairwise(done[1:])
        if word and not word.startswith("-") and before not in valued
    ]
    with contextlib.suppress(CourseError):
        return (
            _type_candidates(noun)
            if done[-1] == "--type"
            else _name_candidates(noun, verb, operands)
        )
    return []


_KINDS = {"topic": "msg", "service": "srv", "action": "action"}


def _type_candidates(noun: str, name: str = "") -> list[str]:
    """Return the type that a topic, service or action has, or else all of its kind."""
    start = f"{_KINDS[noun]}/" if noun in _KINDS else ""
    graph = reader.read_graph(default_session.session().observer, everything=True)
    found = {topic.name: topic.types for topic in graph.topics} if noun == "topic" else {}
    found |= {one.name: (one.type,) for one in (*graph.services, *graph.actions) if noun != "topic"}
    return list(found.get(f"/{name.lstrip('/')}", ())) or [
        f"{package}/{interface}"
        for package, interfaces in installed.read_index().items()
        for interface in sorted(interfaces)
        if interface.startswith(start)
    ]


def _name_candidates(noun: str, verb: str, operands: list[str]) -> list[str]:
    if noun == "interface":
        return (
            list(installed.read_index()) if verb in ("package", "list") else _type_candidates(noun)
        )
    if noun == "param" and len(operands) == 1:
        from course.ros_magic.parameters import names_of

        return names_of(operands[0], _PATIENCE_S)
    if verb == "find":
        return _type_candidates(noun)
    if len(operands) == 1 and verb in ("pub", "echo", "call", "send_goal"):
        return _type_candidates(noun, operands[0])
    if operands or verb == "list":
        return []
    graph = reader.read_graph(default_session.session().observer)
    of: dict[str, Callable[[Graph], list[str]]] = {
        "topic": lambda g: [topic.name for topic in g.topics],
        "node": lambda g: list(g.nodes),
        "param": lambda g: list(g.nodes),
        "service": lambda g: [service.name for service in g.services],
        "action": lambda g: [action.name for action in g.actions],
    }
    return of[noun](graph)


def _complete_line(_shell: Any, event: Any) -> list[str]:
    line = event.line.lstrip().removeprefix("%").removeprefix("ros").lstrip()
    words = line.split(" ")
    return [name for name in find_candidates(words) if name.startswith(event.symbol)]
