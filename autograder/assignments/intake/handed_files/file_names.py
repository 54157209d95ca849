"""Names that strangers gave to files and folders: compared as people read them, shown safely.

macOS writes an "ü" as "u" and two dots (decomposed), other systems as one letter (composed); both
are the same name to a reader.
"""

from __future__ import annotations

import shlex
import unicodedata
from collections.abc import Collection, Iterable
from pathlib import Path

MAX_SHOWN_CHARS = 300
"""Characters of a name that are shown."""

_MOST_NAMED = 4


def normalise_name(name: str) -> str:
    """Return a name in the composed form, in which equal names are equal strings."""
    return unicodedata.normalize("NFC", name)


def is_same_name(one: str, other: str) -> bool:
    """Whether two names read the same."""
    return normalise_name(one) == normalise_name(other)


def match_name(name: str, known: Collection[str]) -> str:
    """Return which of the ``known`` names one means: that, or else one that reads the same.

    A name that means none of them comes back in the composed form.
    """
    if name in known:
        return name
    return next(
        (other for other in sorted(known) if is_same_name(other, name)), normalise_name(name)
    )


def find_entry(folder: Path, name: str) -> Path:
    """Return where ``name`` lies in a folder, in whichever form it is written there.

    What lies there under exactly this name comes first; if there is nothing, that is its place.
    """
    place = folder / name
    if place.is_symlink() or place.exists():
        return place
    try:
        return next(
            (path for path in sorted(folder.iterdir()) if is_same_name(path.name, name)), place
        )
    except OSError:
        return place


def printable_name(name: str) -> str:
    """Return a name as it can be shown: line breaks and other control characters as escapes."""
    text = "".join(_escape_letter(letter) for letter in normalise_name(name))
    return text if len(text) <= MAX_SHOWN_CHARS else f"{text[:MAX_SHOWN_CHARS]}…"


def join_names(names: Iterable[str]) -> str:
    """Return names as part of a sentence, in quotes; of many only the first."""
    some = [f"'{printable_name(name)}'" for name in names]
    if len(some) > _MOST_NAMED:
        return f"{', '.join(some[:_MOST_NAMED])} and {len(some) - _MOST_NAMED} more"
    return " and ".join(filter(None, [", ".join(some[:-1]), *some[-1:]]))


def quote_name(name: str) -> str:
    """Return a name as it is typed in a shell.

    It is the `printable_name` if it has characters that nobody types.
    """
    return shlex.quote(printable_name(name))


def _escape_letter(letter: str) -> str:
    if letter.isprintable():
        return letter
    return letter.encode("unicode_escape", "surrogatepass").decode("ascii")
