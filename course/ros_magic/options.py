"""Options that several commands of ``%ros`` have."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from course.messages.types import is_type_name

TIMEOUT_S = 5.0
"""Seconds that a command waits at most; what has no end on a command line ends after them here."""

Add = Callable[..., Any]
"""``argparse.ArgumentParser.add_argument``, with which a command declares what it takes."""


def declare_timeout(add: Add, default: float = TIMEOUT_S) -> None:
    """Declare ``--timeout``."""
    add("--timeout", type=float, default=default, metavar="S", help="seconds to wait at most")


def type_and_values(add: Add, example: str, values: str) -> None:
    """Declare TYPE and VALUES, both of which may be left out; `split_operands` tells them apart."""
    add("asked", nargs="?", default="", metavar="TYPE",
        help=f"as in {example}; may be left out if the graph knows it")  # fmt: skip
    add("text", nargs="?", default="", metavar="VALUES",
        help=f"the fields in quotes, as YAML: {values}")  # fmt: skip
    add("--type", dest="named", default="", metavar="TYPE", help=argparse.SUPPRESS)


def split_operands(asked: str, text: str, named: str) -> tuple[str, str]:
    """Return (type, values) of what was given for `type_and_values`.

    A lone word is the type if it has the form of one: such a text is no YAML of any message.
    """
    if not text and (named or not is_type_name(asked)):
        asked, text = "", asked
    return named or asked, text or "{}"
