"""Which file of a submission holds the attempts at a quiz, if its name does not say it.

As with notebooks (see `notebook_search`): the one file that holds attempts at the quiz is taken,
whatever it is called, and that is said; where there is none, whatever else lies there is left to a
person. So are several files with different attempts, and attempts that were made under the login
of somebody else in the class.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import islice
from pathlib import Path

from autograder.assignments.intake import claim_records
from autograder.assignments.intake.handed_files.archives import ArchiveError
from autograder.assignments.intake.handed_files.file_names import (
    find_entry,
    join_names,
    normalise_name,
    printable_name,
    quote_name,
)
from autograder.assignments.intake.handed_files.handed_in import (
    NOTEBOOK,
    HandedInItem,
    handed_out,
    look_through,
)
from quizzes.attempts import record

MAX_OPENED, MAX_READ = 200, 20
"""Files that are opened, and that are read as attempts; further ones are left to a person."""

_MARK = b'"answers"'
"""What every attempt has in it, as it is written."""


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


@dataclass(frozen=True)
class _Holding:
    """A file with attempts at a quiz; ``attempts`` are compared only, so their hashes do."""

    item: HandedInItem
    attempts: frozenset[int]


def with_attempts(
    items: Iterable[HandedInItem],
) -> Iterator[tuple[HandedInItem, list[record.Attempt]]]:
    """Yield the files that hold attempts at any quiz, and the attempts."""
    marked = ((item, _read_item(item)) for item in islice(items, MAX_OPENED))
    likely = ((item, content) for item, content in marked if _MARK in content)
    for item, content in islice(likely, MAX_READ):
        if attempts := record.parse_attempts(content)[0]:
            yield item, attempts


def find_attempts(
    folder: Path, quiz: str, student: str, root: Path, roster: Collection[str] = ()
) -> Attempts:
    """Return a student's attempts at a quiz that lie in a submission.

    Args:
        folder: the submission.
        quiz: its name.
        student: whose submission it is.
        root: the course root, with the claims and the submissions of the class.
        roster: the students whom the gradebook knows; they may have handed in nothing.

    Raises:
        OSError: the file is there and cannot be read.
        ClaimError: the file of claims is damaged.
    """
    name, key = record.attempts_filename(quiz), f"quiz-{quiz}"
    command = f"autograder claim {quote_name(folder.name)} {quote_name(student)} {quote_name(key)}"
    claim = claim_records.of_student(root, folder.name, student).get(key)
    if claim is not None:
        handed_in = look_through(folder)
        if claim.state == claim_records.digest_state(folder, handed_in, name, claim.file):
            item = handed_in.find_item(claim.file) if claim.file else None
            if item is None:
                return Attempts(nothing=True)
            return Attempts(
                _read_item(item), f"'{printable_name(item.place)}' counts, as a person has said."
            )
    class_ = _with_folders(root) | {normalise_name(name) for name in roster}
    return _of_the_student(_find_unclaimed(folder, quiz, command, root), student, class_)


def _find_unclaimed(folder: Path, quiz: str, command: str, root: Path) -> Attempts:
    """Return what counts, or may count, if no person has said it."""
    name = record.attempts_filename(quiz)
    path = find_entry(folder, name)
    given = handed_out(root / "release" / folder.name)
    others = [
        item for item in look_through(folder).unclaimed_items(given)
        if item.path != path and NOTEBOOK not in item.name.lower()
    ]  # fmt: skip
    if path.is_symlink() or path.exists():
        return _read_proper_file(path, others, quiz, command)
    found = _distinct_files(others, quiz)
    if len(found) == 1:
        item = found[0].item
        said = (
            f"There was no {name}, but '{printable_name(item.place)}' holds attempts, so it counts."
        )
        return Attempts(_read_item(item), said, command=f"{command} {quote_name(item.place)}")
    return _ask_about_files(f"There is no {name}", found, others, command)


def _read_proper_file(path: Path, others: list[HandedInItem], quiz: str, command: str) -> Attempts:
    """Return the attempts in the file of their own, unless others are more likely meant."""
    name = record.attempts_filename(quiz)
    try:
        content = record.read_plain(path, record.MAX_FILE_BYTES + 1)
    except OSError:
        if not others:
            raise
        content = b""
    own = _hash_attempts(record.parse_attempts(content)[0], quiz)
    found = [file for file in _distinct_files(others, quiz) if not file.attempts <= own]
    if not own:
        asked = _ask_about_files(f"{name} holds no attempt at the quiz", found, others, command)
        return asked if asked.question else Attempts(content)
    if not found:
        return Attempts(content, command=f"{command} {quote_name(name)}")
    return Attempts(
        content,
        question=f"Beside {name} there is {_list_places(found)}, too, with other attempts: "
        "a person has to say what counts.",
        command=f"{command} {quote_name(found[0].item.place)}",
    )


def _ask_about_files(
    said: str, found: list[_Holding], others: list[HandedInItem], command: str
) -> Attempts:
    """Ask a person about the files that hold attempts, or else about all that may."""
    places = [file.item.place for file in found] or [item.place for item in others]
    if not places:
        return Attempts()
    verb = "is" if len(places) == 1 else "are"
    return Attempts(
        question=f"{said}, but there {verb} {join_names(places)}: a person has to say what counts.",
        command=f"{command} {quote_name(found[0].item.place) if found else 'FILE'}",
    )


def _distinct_files(items: Iterable[HandedInItem], quiz: str) -> list[_Holding]:
    """Return the files with attempts at a quiz, but none whose attempts are all in another."""
    found = [_Holding(item, _hash_attempts(made, quiz)) for item, made in with_attempts(items)]
    distinct: list[_Holding] = []
    for file in sorted(found, key=lambda file: -len(file.attempts)):
        if file.attempts and not any(file.attempts <= other.attempts for other in distinct):
            distinct.append(file)
    return distinct


def _hash_attempts(attempts: Iterable[record.Attempt], quiz: str) -> frozenset[int]:
    return frozenset(hash(attempt.to_json()) for attempt in attempts if attempt.quiz == quiz)


def _list_places(found: list[_Holding]) -> str:
    return join_names(file.item.place for file in found)


def _of_the_student(found: Attempts, student: str, class_: Collection[str]) -> Attempts:
    """Ask a person if attempts carry the login of somebody else in the class."""
    if found.content is None:
        return found
    logins = dict.fromkeys(
        normalise_name(a.student) for a in record.parse_attempts(found.content)[0]
    )
    others = [login for login in logins if login != normalise_name(student)]
    known = [login for login in others if login in class_]
    if not known:
        return found
    who = join_names(known)
    said = (
        f"The attempts were made under the login of {who}, who is in the class, too: a person has "
        "to say whether they count."
    )
    return replace(found, question=" ".join(filter(None, (found.question, said))))


def _with_folders(root: Path) -> frozenset[str]:
    submitted = root / "submitted"
    try:
        return _folder_names(submitted, submitted.stat().st_mtime_ns)
    except OSError:
        return frozenset()


@lru_cache(maxsize=2)
def _folder_names(submitted: Path, changed_ns: int) -> frozenset[str]:
    """Return the students who have a folder; it is read again once ``changed_ns`` is another."""
    return frozenset(normalise_name(path.name) for path in submitted.iterdir() if path.is_dir())


def _read_item(item: HandedInItem) -> bytes:
    try:
        return item.read(record.MAX_FILE_BYTES + 1)
    except (OSError, ArchiveError):
        return b""
