"""What ``%ros`` takes: a parser for each command, which answers a mistake with its usage."""

from __future__ import annotations

import argparse
import functools
import shlex
from collections.abc import Mapping
from types import ModuleType
from typing import Any, NoReturn

from course.errors import CourseError
from course.messages import yaml_text


class UsageError(CourseError):
    """A ``%ros`` line that says nothing; the message has a sentence, and the usage below it."""


class _Parser(argparse.ArgumentParser):
    block = ""  # made before parsing: while it parses, argparse holds another usage

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message[0].upper()}{message[1:]}.\n{self.block}")

    def print_help(self, file: Any = None) -> None:
        print(self.block)  # noqa: T201 - the answer to `%ros topic pub -h`

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        raise _Done


class _Done(Exception):  # noqa: N818 - the help has been shown
    pass


def run_line(line: str) -> None:
    """Run one line, such as ``topic info -v /scan``.

    Raises:
        UsageError: the line is not well formed.
        CourseError: what the command has to say.
    """
    try:
        words = shlex.split(line)
    except ValueError as error:
        raise UsageError(f"%ros {line}: {error}.") from None
    noun = _one_of(noun_modules(), words[:1], "%ros", "NOUN VERB ...")
    verb = noun and _one_of(noun_modules()[noun].VERBS, words[1:2], f"%ros {noun}", "VERB ...")
    if not (noun and verb):
        return
    try:
        # Intermixed: people write options before, between and after what a command is about.
        options = vars(make_parser(noun, verb).parse_intermixed_args(words[2:]))
    except _Done:
        return
    command, _ = noun_modules()[noun].VERBS[verb]
    if answer := command(**options):
        print(answer)  # noqa: T201 - the answer to the learner's line


@functools.cache
def noun_modules() -> Mapping[str, ModuleType]:
    """Return the modules of all commands, by noun; each has ``VERBS``."""
    from course.ros_magic import actions, interfaces, nodes, parameters, services, topics

    return {one.NOUN: one for one in (topics, nodes, services, actions, parameters, interfaces)}


def make_parser(noun: str, verb: str) -> _Parser:
    """Return the parser of one command; its ``block`` is the usage, a line an argument."""
    command, declare = noun_modules()[noun].VERBS[verb]
    made = _Parser(
        prog=f"%ros {noun} {verb}",
        description=(command.__doc__ or "").partition("\n")[0],
        formatter_class=functools.partial(argparse.HelpFormatter, max_help_position=30, width=98),
    )
    declare(made.add_argument)
    lines = made.format_help().replace("[-h] ", "").splitlines()
    left_out = ("", "positional arguments:", "options:")
    made.block = "\n".join(line for line in lines if line not in left_out and "-h," not in line)
    return made


def valued_options(noun: str, verb: str) -> set[str]:
    """Return the options of a command that a value follows."""
    found: set[str] = set()

    def add(*names: str, action: str = "", **_: Any) -> None:
        found.update(name for name in names if name.startswith("-") and not action)

    if noun in noun_modules() and verb in noun_modules()[noun].VERBS:
        noun_modules()[noun].VERBS[verb][1](add)
    return found


def _one_of(known: Mapping[str, Any], words: list[str], so_far: str, rest: str) -> str:
    """Return the word, if it is known; "" if it has asked for help, which is then shown."""
    lines = [f"usage: {so_far} {rest}", ""]
    lines += [f"  {name:<12}{_doc_summary(thing)}" for name, thing in known.items()]
    block = "\n".join(line for line in lines if line)
    word = words[0] if words else ""
    if word in known:
        return word
    if word in ("-h", "--help"):
        print(block)  # noqa: T201 - the answer to `%ros -h`
        return ""
    missing = f"{yaml_text.short_repr(word)} is none of its words" if word else "A word is missing"
    raise UsageError(f"{missing} after {so_far}.\n{block}")


def _doc_summary(thing: Any) -> str:
    """Return the first line about a noun's module or a verb's function."""
    about = thing[0] if isinstance(thing, tuple) else thing
    return (about.__doc__ or "").partition("\n")[0]
