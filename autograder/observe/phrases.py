"""How a message names several things, counts them, or quotes a reason."""

from __future__ import annotations

from collections.abc import Iterable

ABORTED = (
    "by a call of abort(), or because the execute callback raised, or returned without succeed() "
    "or canceled()"
)


def as_phrase(items: Iterable[str], last: str = "and") -> str:
    """Return several things as a phrase: "a, b and c", or with another word before the ``last``."""
    *first, end = [*items] or [""]
    return f"{', '.join(first)} {last} {end}" if first else end


def name_nodes(names: Iterable[str]) -> str:
    """Return the names of nodes as a phrase: "controller and navigation"."""
    return as_phrase(sorted(name.removeprefix("/") for name in names))


def who_does(names: Iterable[str], verb: str) -> str:
    """Return which nodes do it: "camera publishes", "camera and lidar publish"."""
    doers = list(names)
    ending = ("es" if verb.endswith("sh") else "s") if len(doers) == 1 else ""
    return f"{name_nodes(doers)} {verb}{ending}"


def pictures_phrase(number: int) -> str:
    """Return a number of pictures as a phrase: "one picture", "3 pictures"."""
    return "one picture" if number == 1 else f"{number} pictures"


def with_reason(reason: str) -> str:
    """Return the reason that came with a refusal, as the end of a sentence: "with the reason …"."""
    return f"with the reason “{reason[:200]}”" if reason.strip() else "and without a reason"


def end_phrase(word: str) -> str:
    """Return how a goal ended, in rclpy's ``word`` for it, as a phrase: "ended as aborted …"."""
    aborted = word.lower() == "aborted"
    return f"ended as {word}" + (f" ({ABORTED})" if aborted else "")


def callback_raised(error: str) -> str:
    """Return that a callback raised an ``error``, which says where, as a part of a sentence."""
    return f"a callback raised an error, in {error.rstrip('.')}"


def capitalize_first(text: str) -> str:
    """Return a phrase with a capital letter, to begin a sentence with."""
    return text[:1].upper() + text[1:]
