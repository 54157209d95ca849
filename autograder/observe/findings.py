"""What a finding says beside what was found: where that was, and what was needed there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from autograder.examination.exam import Failed


@contextmanager
def in_context(needed: str, seen: str) -> Iterator[None]:
    """Have a failure in the block say more.

    Args:
        needed: a sentence to put before what was needed.
        seen: what to put before what was seen: "In the next drive:".

    Raises:
        Failed: the block did.

    Example:
        >>> with in_context("The drive holds nobody up.", "At 2 m:"):
        ...     raise Failed(expected="Pictures come.", actual="None came.")
        Traceback (most recent call last):
        autograder.examination.exam.Failed: expected: The drive holds nobody up. Pictures come. \
observed: At 2 m: None came.
    """
    try:
        yield
    except Failed as failed:
        raise Failed(
            expected=f"{needed} {failed.expected}", actual=f"{seen} {failed.actual}"
        ) from None
