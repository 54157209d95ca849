"""Errors that people read: one sentence that says what, where, and what to do next."""

from __future__ import annotations


class CourseError(Exception):
    """Base of every error this package raises for a person to read.

    The message is one clear sentence (two at most): what is wrong, where, and the next thing to
    do. Commands print it and leave with ``exit_code``; a notebook shows it without a traceback.
    """

    exit_code = 1
