"""What ``%ros`` takes: one parser for all commands, whose complaints are sentences."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Callable
from typing import Any, NoReturn

from course.errors import CourseError

TIMEOUT = 5.0

Command = Callable[..., str | None]


class UsageError(CourseError):
    """A ``%ros`` line that says nothing; the message has the usage."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        usage = " ".join(self.format_usage().removeprefix("usage: ").split())
        raise UsageError(f"{message[0].upper()}{message[1:]}. Usage: {usage}")

    def print_help(self, file: Any = None) -> None:
        print(self.format_help())  # noqa: T201 - the answer to `%ros -h`

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        raise _Done


class _Done(Exception):  # noqa: N818 - the help has been shown
    pass


def run(line: str) -> None:
    """Run one line, such as ``topic info -v /scan``.

    Raises:
        UsageError: the line is not well formed.
        CourseError: what the command has to say.
    """
    try:
        words = shlex.split(line)
    except ValueError as error:
        raise UsageError(f"%ros {line}: {error}.") from None
    try:
        options = vars(parser().parse_args(words))
    except _Done:
        return
    answer = options.pop("command")(**options)
    if answer:
        print(answer)  # noqa: T201 - the answer to the learner's line


def parser() -> argparse.ArgumentParser:
    """Return the parser of everything that ``%ros`` can do."""
    from course.ros import actions, interfaces, nodes, parameters, services, topics

    top = _Parser(prog="%ros", description="Look at the ROS graph of this notebook, and use it.")
    nouns = top.add_subparsers(required=True, metavar="topic|node|service|action|param|interface")
    for module in (topics, nodes, services, actions, parameters, interfaces):
        verbs = nouns.add_parser(
            module.NOUN, help=(module.__doc__ or "").partition("\n")[0]
        ).add_subparsers(required=True, metavar="|".join(module.VERBS))
        for verb, (command, declare) in module.VERBS.items():
            line = (command.__doc__ or "").partition("\n")[0]
            declared = verbs.add_parser(verb, help=line, description=line)
            declare(declared.add_argument)
            declared.set_defaults(command=command)
    return top


def timeout(add: Callable[..., Any], default: float = TIMEOUT) -> None:
    """Declare ``--timeout``."""
    add("--timeout", type=float, default=default, help="seconds to wait at most")
