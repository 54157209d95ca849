"""Messages of the types on a graph, as far as these are installed where the examiner runs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from autograder.examination.subject.own_interfaces import DEFINITIONS
from course.design import message_tags
from course.design.lifelike import AHEAD_M, lifelike_message
from course.errors import CourseError
from course.interfaces import define
from course.messages import types


class TypeNotInstalledError(Exception):
    """A type on the graph that is not installed where the examiner runs."""


def load_type(name: str) -> Any:
    """Return the class of a type on the graph.

    Raises:
        TypeNotInstalledError: it is not installed.
    """
    if name in DEFINITIONS:
        return define(name, DEFINITIONS[name])
    try:
        return types.load_named(name)
    except (LookupError, CourseError):
        raise TypeNotInstalledError(name) from None


def is_installed(names: Iterable[str]) -> bool:
    """Return whether all of these types are installed."""
    try:
        return bool([load_type(name) for name in names])
    except TypeNotInstalledError:
        return False


def marked_message(msg_type: Any, tag: int, ahead_m: float = AHEAD_M) -> Any:
    """Return a message as a robot would send it, with a mark in it.

    Args:
        msg_type: its class.
        tag: the mark, one of `course.design.message_tags.TAGS`.
        ahead_m: metres straight on to every place that it names.
    """
    message = lifelike_message(msg_type, ahead_m)
    message_tags.mark(message, tag)
    return message


def bears_marks(names: Iterable[str]) -> bool:
    """Return whether messages of these types have room for dye; a type unknown here may have it."""
    return all(_bears_marks(name) for name in names)


def _bears_marks(name: str) -> bool:
    try:
        return message_tags.has_room(load_type(name))
    except TypeNotInstalledError:
        return True
