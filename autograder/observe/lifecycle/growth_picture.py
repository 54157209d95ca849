"""A picture of what a process keeps of each of many rounds: threads, files or memory."""

from __future__ import annotations

from collections.abc import Sequence

from autograder.examination.pictures.picture import MAX_ITEMS, Series
from autograder.observe.lifecycle.process_holdings import Usage

MOST_POINTS = MAX_ITEMS // 2


def growth_picture(usages: Sequence[Usage], what: str, grown: str) -> Series | None:
    """Return what the process held before the rounds and after each of them, of what grew.

    Args:
        usages: what it held, first before the rounds.
        what: what a round is, in the plural: "lives".
        grown: in words what there was more of: "12 more threads".

    Returns:
        None if there were too few rounds to see anything.

    Example:
        >>> held = [Usage(12, 30, 90_000), Usage(13, 30, 90_010), Usage(14, 30, 90_020)]
        >>> growth_picture(held, "lives", "2 more threads").points
        ((0, 12), (1, 13), (2, 14))
    """
    if len(usages) < 3:
        return None
    values: list[float]
    if "thread" in grown:
        name, values = "threads", [usage.threads for usage in usages]
    elif "file" in grown:
        name, values = "open files", [usage.files for usage in usages]
    else:
        name, values = "MiB of memory", [round(usage.memory / 1024, 1) for usage in usages]
    every = len(values) // MOST_POINTS + 1
    points = tuple(enumerate(values))[::every]
    title = f"{name[0].upper()}{name[1:]} that the process had, after more and more {what}"
    return Series(title, what, name, points)
