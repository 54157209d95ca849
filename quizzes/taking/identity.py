"""Who takes a quiz."""

from __future__ import annotations

import getpass
import os
from typing import Any

from quizzes.errors import QuizError


def current_login() -> str:
    """Return who is at work: the user of JupyterHub, or of this machine."""
    if name := os.environ.get("JUPYTERHUB_USER", "").strip():
        return name
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # a container may run under a number without a name
        return f"user-{os.getuid()}"


def validate_name(student: Any) -> str:
    """Return a learner's name as it is saved.

    Raises:
        QuizError: it is no text, or none that UTF-8 can hold.
    """
    try:
        str.encode(student)
    except (TypeError, UnicodeError):
        raise QuizError(
            f"student={student!r} is no name that can be saved: give it as plain text, such as "
            "student='ada'."
        ) from None
    return str(student)[:100]
