"""Which file of a submission holds the attempts at a quiz, if its name does not say it.

As with notebooks (`autograder.intake`): the one file that holds attempts at the quiz is taken, and
that is said; whatever else may be it is left to a person. Attempts that were made under the login
of somebody else in the class are left to a person, too, whatever their file is called.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from autograder import intake_claims
from autograder.intake_files import HandedIn, Item, look_through
from autograder.intake_names import entry, listed, normal, quoted, shown
from autograder.intake_zip import ArchiveError
from quizzes import record

MAX_READ = 20
"""Files that are read as attempts; further ones are left to a person."""

_LIKELY = re.compile(r"attempts|\.jsonl|\bquiz\b.*\.(txt|json)$", re.IGNORECASE)


@dataclass(frozen=True)
class Attempts:
    """A student's attempts at a quiz.

    Attributes:
        content: what their file holds; None if there is none that counts.
        note: for the student, where it was found.
        question: what a person is asked; empty if nothing.
        command: how that person answers.
        nothing: a person has said that there are none.
    """

    content: bytes | None = None
    note: str = ""
    question: str = ""
    command: str = ""
    nothing: bool = False


def is_likely(name: str) -> bool:
    """Whether a file's name is like one of a quiz's attempts."""
    return bool(_LIKELY.search(name))


def find(folder: Path, quiz: str, student: str, root: Path) -> Attempts:
    """Return a student's attempts at a quiz that lie in a submission.

    Args:
        folder: the submission.
        quiz: its name.
        student: whose submission it is.
        root: the course root, with the claims and the class.

    Raises:
        OSError: the file is there and cannot be read.
        ClaimError: the file of claims is damaged.
    """
    name, key = record.filename(quiz), f"quiz-{quiz}"
    command = f"autograder claim {quoted(folder.name)} {quoted(student)} {quoted(key)}"
    claim = intake_claims.of_student(root, folder.name, student).get(key)
    if claim is not None:
        handed_in = look_through(folder)
        if claim.state == intake_claims.state(folder, handed_in, name, claim.file):
            item = handed_in.at(claim.file) if claim.file else None
            if item is None:
                return Attempts(nothing=True)
            return Attempts(_read(item), f"'{shown(item.place)}' counts, as a person has said.")
    path = entry(folder, name)
    if path.is_symlink() or path.exists():
        content = record.read_plain(path, record.MAX_FILE + 1)
        return _of_the_student(
            Attempts(content, command=f"{command} {quoted(name)}"), student, root
        )
    found = _elsewhere(look_through(folder), quiz, name, command)
    return _of_the_student(found, student, root)


def _elsewhere(handed_in: HandedIn, quiz: str, name: str, command: str) -> Attempts:
    likely = [item for item in handed_in.items if is_likely(item.name)]
    holding: dict[bytes, Item] = {}
    for item in likely[:MAX_READ]:
        content = _read(item)
        if any(attempt.quiz == quiz for attempt in record.parse(content)[0]):
            holding.setdefault(content, item)
    if len(holding) == 1:
        ((content, item),) = holding.items()
        said = f"There was no {name}, but '{shown(item.place)}' holds attempts, so it counts."
        return Attempts(content, said, command=f"{command} {quoted(item.place)}")
    strange = list(holding.values()) or [
        item for item in likely if not item.name.endswith(".ipynb")
    ]
    closed = [item for item in handed_in.items if item.place in handed_in.closed]
    if not (strange or closed):
        return Attempts()
    there = listed(item.place for item in (*strange, *closed))
    verb = "is" if len([*strange, *closed]) == 1 else "are"
    return Attempts(
        question=f"There is no {name}, but there {verb} {there}: a person has to say what counts.",
        command=f"{command} {quoted((*strange, *closed)[0].place)}",
    )


def _of_the_student(found: Attempts, student: str, root: Path) -> Attempts:
    """Ask a person if attempts carry the login of somebody else in the class."""
    if found.content is None:
        return found
    logins = dict.fromkeys(normal(a.student) for a in record.parse(found.content)[0])
    others = [login for login in logins if login != normal(student)]
    known = [login for login in others if login in _class(root)]
    if not known:
        return found
    who = listed(known)
    return Attempts(
        found.content, found.note,
        f"The attempts were made under the login of {who}, who is in the class, too: a person has "
        "to say whether they count.",
        found.command,
    )  # fmt: skip


def _class(root: Path) -> frozenset[str]:
    submitted = root / "submitted"
    try:
        return _names(submitted, submitted.stat().st_mtime_ns)
    except OSError:
        return frozenset()


@lru_cache(maxsize=2)
def _names(submitted: Path, changed_ns: int) -> frozenset[str]:
    """Return the students who have a folder; it is read again once ``changed_ns`` is another."""
    return frozenset(normal(path.name) for path in submitted.iterdir() if path.is_dir())


def _read(item: Item) -> bytes:
    try:
        return item.read(record.MAX_FILE + 1)
    except (OSError, ArchiveError):
        return b""
