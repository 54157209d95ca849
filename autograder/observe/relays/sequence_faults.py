"""What is wrong with a sequence of numbered messages, as a phrase: lost, repeated, out of order."""

from __future__ import annotations

from collections.abc import Sequence

MOST_SHOWN = 6
"""Numbers that a phrase shows."""


def lost_phrase(number: int, of: int = 0, *, oldest: bool = False) -> str:
    """Return how many were lost, as a phrase; ``oldest``: they had waited longest.

    Example:
        >>> lost_phrase(1), lost_phrase(2, 7), lost_phrase(4, oldest=True)
        ('1 was lost', '2 of 7 were lost', 'the 4 that had waited longest were lost')
    """
    was = "was" if number == 1 else "were"
    if oldest:
        return f"the {'one' if number == 1 else number} that had waited longest {was} lost"
    return f"{number}{f' of {of}' if of else ''} {was} lost"


def numbers_phrase(numbers: Sequence[int], noun: str = "message") -> str:
    """Return the first of some numbers, as a phrase that counts from 1, as people do.

    Example:
        >>> numbers_phrase([0, 4], "reading"), numbers_phrase([])
        ('readings 1, 5', 'nothing at all')
    """
    if not numbers:
        return "nothing at all"
    shown = ", ".join(str(number + 1) for number in numbers[:MOST_SHOWN])
    nouns = noun if len(numbers) == 1 else f"{noun}s"
    return f"{nouns} {shown}{' …' if len(numbers) > MOST_SHOWN else ''}"


def describe_fault(got: Sequence[int], count: int) -> str:
    """Return what is wrong with ``got``, which is not 0 to ``count - 1`` in order, as a phrase.

    Example:
        >>> describe_fault([0, 2], 3), describe_fault([0, 1, 1], 2), describe_fault([1, 0], 2)
        ('1 of 3 was lost', '1 of 2 came more than once', 'Some came out of order')
    """
    if missing := count - len(set(got)):
        return lost_phrase(missing, count)
    if again := len(repeated_numbers(got)):
        return f"{again} of {count} came more than once"
    return "Some came out of order"


def faulty_numbers(got: Sequence[int], count: int, noun: str = "message") -> str:
    """Return the numbers from one before the first that is out of place on, as a phrase.

    Or that those from the first on are there, and then no more up to ``count``.

    Example:
        >>> faulty_numbers([0, 1, 2, 5, 6], 9), faulty_numbers([0, 1, 2], 9)
        ('messages 3, 6, 7', 'only the first 3 of them')
    """
    first = next((place for place, number in enumerate(got) if number != place), len(got))
    if got and first == len(got) < count:
        return f"only the first {first} of them" if first > 1 else "only the first of them"
    return numbers_phrase(got[max(0, first - 1) :], noun)


def repeated_numbers(numbers: Sequence[int]) -> set[int]:
    """Return the numbers that are there more than once.

    Example:
        >>> repeated_numbers([1, 2, 3, 2])
        {2}
    """
    return {number for number in numbers if numbers.count(number) > 1}
