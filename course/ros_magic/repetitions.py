"""``--once``, ``--times`` and ``--rate``: how often a command does a thing, which has an end."""

from __future__ import annotations

import math

from course.errors import SessionError
from course.ros_magic.options import TIMEOUT_S, Add
from course.util.argument_checks import check_whole_number

MAX_RATE_HZ = 1000.0


def declare_repetitions(add: Add, what: str) -> None:
    """Declare the options of a command that can ``what`` more than once."""
    add("-1", "--once", action="store_true", help=f"{what} once, as without -r and -t")
    add("-t", "--times", type=int, metavar="N", help=f"{what} N times, once a second without -r")
    declare_rate(add, what)


def declare_rate(add: Add, what: str) -> None:
    """Declare ``--rate``."""
    add("-r", "--rate", type=float, metavar="N",
        help=f"{what} N times a second, for {TIMEOUT_S:g} s: no cell runs for ever")  # fmt: skip


def parse_repetitions(once: bool, times: int | None, rate: float | None) -> tuple[int, float]:
    """Return (how often, how many times a second) for the options.

    Raises:
        SessionError: they contradict each other, or a number is out of range.
    """
    if once and times is not None:
        raise SessionError("--once and --times say different things: leave one of them out.")
    if rate is not None and not (0 < rate <= MAX_RATE_HZ):
        raise SessionError(f"--rate is above 0 and at most {MAX_RATE_HZ:g} a second, not {rate:g}.")
    if times is not None:
        check_whole_number(times, "--times", least=1, example=3)
    if once or (times is None and rate is None):
        return 1, 1.0
    rate = rate or 1.0
    return times or max(1, math.floor(TIMEOUT_S * rate)), rate
