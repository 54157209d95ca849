"""How a message names several things at once."""

from __future__ import annotations


def phrase(items: list[str]) -> str:
    """Return a list as a phrase: "a, b and c"."""
    return " and ".join(part for part in (", ".join(items[:-1]), *items[-1:]) if part)
