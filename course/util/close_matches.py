"""“Did you mean …?”: the name that comes closest to one which does not exist."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def close_match(name: str, known: Iterable[str]) -> str:
    """Return the known name that is most like ``name``, or nothing if none is.

    >>> close_match("/scna", ["/scan", "/odom"])
    '/scan'
    """
    return next(iter(difflib.get_close_matches(name, list(known), n=1)), "")


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the question for the closest name, with a space before it; or nothing.

    >>> did_you_mean("qso", ["qos", "safety"])
    " Did you mean 'qos'?"
    """
    return f" Did you mean '{close}'?" if (close := close_match(name, known)) else ""


def is_it(name: str, known: Iterable[str]) -> str:
    """Return the same question in brackets, for the middle of a sentence.

    >>> is_it("ada.lovelce", ["ada.lovelace"])
    " (is it 'ada.lovelace'?)"
    """
    return f" (is it '{close}'?)" if (close := close_match(name, known)) else ""
