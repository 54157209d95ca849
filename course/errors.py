"""Errors that people read: one sentence that says what, where, and what to do next."""

from __future__ import annotations


class CourseError(Exception):
    """Base of every error this package raises for a person to read.

    The message is one clear sentence (two at most): what is wrong, where, and the next thing to
    do. Commands print it and leave with ``exit_code``; a notebook shows it without a traceback.
    """

    exit_code = 1

    def _render_traceback_(self) -> list[str]:
        """Return what IPython shows: the sentence alone. The cell still fails."""
        return [f"{type(self).__name__}: {self}"]


class DomainError(CourseError):
    """A ROS domain id is out of range, or no free one is left on this machine."""


class SessionError(CourseError):
    """A session was asked for something that it cannot do (closed, wrong kind of node, ...)."""


class WaitTimeout(CourseError):  # noqa: N818 - a wait that ended, named as ROS users say it
    """A wait reached its deadline; the message names what was waited for.

    Attributes:
        sought: the topic or service that it was about, as the graph spells it, or "".
    """

    def __init__(self, message: str = "", sought: str = "") -> None:
        """Say ``message``, of a wait for ``sought``."""
        super().__init__(message)
        self.sought = sought
