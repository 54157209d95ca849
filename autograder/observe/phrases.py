"""How a message names several things, counts them, or quotes a reason."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

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


def there_were(number: int, one: str, several: str) -> str:
    """Return how many of something there were, as a clause.

    Example:
        >>> there_were(1, "try", "tries"), there_were(0, "try", "tries")
        ('there was 1 try', 'there were no tries')
    """
    return f"there was 1 {one}" if number == 1 else f"there were {number or 'no'} {several}"


def say_words(words: Sequence[object], nothing: str = "It said nothing.") -> str:
    """Return which words were said, one after the other, as a sentence.

    Example:
        >>> say_words(["lost", "arrived"])
        'It said “lost”, then “arrived”.'
    """
    said = ", then ".join(f"“{word}”" for word in words)
    return f"It said {said}." if said else nothing


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
