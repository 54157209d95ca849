"""What a person has said about files whose names do not say it: claims, kept beside the gradebook.

A claim says which file is a student's notebook (or attempts file), or that they handed in nothing.
It is about what lay there when it was made: if a student hands in again, it no longer holds, and
they are asked about again. What the student handed in is not touched.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock

from autograder.assignments.intake.handed_files import folder_digest
from autograder.assignments.intake.handed_files.file_names import find_entry, normalise_name
from autograder.assignments.intake.handed_files.handed_in import HandedIn
from autograder.assignments.submission import MAX_NOTEBOOK_BYTES
from autograder.util.work_files import write_whole
from course.errors import CourseError

FILE = "claims.json"
"""In the course root: decisions of people, which nobody can work out again."""

VERSION = 1


class ClaimError(CourseError):
    """A claim that cannot be made or read; the message says what there is."""


@dataclass(frozen=True)
class Claim:
    """What a person said of one notebook or attempts file of a student.

    Attributes:
        file: where it lies in the submission; empty if nothing was handed in.
        state: digest of what the claim is about (see `digest_state`).
    """

    file: str
    state: str


def digest_state(folder: Path, handed_in: HandedIn, proper: str, file: str) -> str:
    """Return a digest of what a claim depends on.

    That is the file itself, and what lies at its ``proper`` place; for the claim that there is
    nothing (an empty ``file``) it is all that was handed in.
    """
    if not file:
        return folder_digest.of_folder(folder)
    item = handed_in.find_item(file)
    content = item.digest(MAX_NOTEBOOK_BYTES + 1) if item else ""
    there = (
        folder_digest.of_folder(find_entry(folder, proper))
        if find_entry(folder, proper).is_file()
        else ""
    )
    return hashlib.sha256(f"{content} {there}".encode()).hexdigest()


def of_student(root: Path, assignment: str, student: str) -> dict[str, Claim]:
    """Return {name of what is claimed: claim} of one submission.

    A student's name may come in any form of Unicode: nbgrader's own commands take it from a folder.

    Raises:
        ClaimError: the file of claims is damaged.
    """
    claims = _load_claims(root).get(assignment, {}).get(normalise_name(student), {})
    return {name: Claim(data["file"], data["state"]) for name, data in claims.items()}


def keep_claim(root: Path, assignment: str, student: str, name: str, claim: Claim | None) -> None:
    """Keep a claim in place of an earlier one; None takes it back.

    Raises:
        ClaimError: the file of claims is damaged.
        OSError: it cannot be written.
    """
    lock = root / ".autograder" / "claims.lock"
    lock.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(lock):
        found = _load_claims(root)
        of_student = found.setdefault(assignment, {}).setdefault(normalise_name(student), {})
        of_student.pop(name, None)
        if claim is not None:
            of_student[name] = asdict(claim)
        data = {"version": VERSION, "claims": found}
        write_whole(root / FILE, json.dumps(data, indent=1, sort_keys=True) + "\n")


def _load_claims(root: Path) -> dict[str, Any]:
    path = root / FILE
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["version"] != VERSION:
            raise ValueError(f"version {data['version']}")
        claims: dict[str, Any] = data["claims"]
        for students in claims.values():
            for named in students.values():
                for claim in named.values():
                    Claim(str(claim["file"]), str(claim["state"]))
        return claims
    except FileNotFoundError:
        return {}
    except (ValueError, KeyError, TypeError, AttributeError, OSError) as error:
        raise ClaimError(
            f"{path} cannot be read ({str(error)[:100]}): mend it or put a copy back; it holds "
            "which files were claimed for which students."
        ) from None
