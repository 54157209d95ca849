"""What is wrong with nbgrader's exchange: which right is missing, on which folder, for whom.

It is a folder that all users share (its rights: ``nbgrader release_assignment``, which makes what
is below it): anybody writes into ``COURSE/inbound`` and nobody but the instructor lists it (0733);
feedback lies under names that only its student can work out, in a folder that anybody enters and
nobody lists (0711).
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

from nbgrader.coursedir import CourseDirectory
from nbgrader.exchange.default import Exchange
from nbgrader.exchange.exchange_factory import ExchangeFactory

from autograder.gradebook.course_gradebook import CONFIG, CourseGradebook
from course.errors import CourseError

_LETTERS = {os.R_OK: "r", os.W_OK: "w", os.X_OK: "x"}
_NAMES = {"r": "read", "w": "write", "x": "enter"}


class ExchangeRightsError(CourseError):
    """An exchange that cannot be used; the message says what is missing, where, and the remedy."""


def require_exchange(gradebook: CourseGradebook, assignment: str) -> list[str]:
    """Return what students will miss in the exchange, a sentence each.

    An exchange that is no folder (a plugin's) is not looked at.

    Raises:
        ExchangeRightsError: the instructor cannot work with it.
    """
    factory = ExchangeFactory(config=gradebook.config)
    if not issubclass(factory.exchange, Exchange):
        return []
    root = Path(Exchange(coursedir=gradebook.coursedir, config=gradebook.config).root)
    course_id = gradebook.coursedir.course_id
    if not course_id:
        raise ExchangeRightsError(
            f"{gradebook.root / CONFIG} does not say which course of the exchange this is: set "
            "c.CourseDirectory.course_id there."
        )
    if not root.is_dir():
        raise ExchangeRightsError(
            f"There is no exchange at {root}: make it with `sudo mkdir -p {root} && sudo chmod 777 "
            f"{root}`, or name yours in {CONFIG} (c.Exchange.root)."
        )
    _require_own_rights(gradebook.coursedir, root, assignment)
    return list(_missing_for_students(gradebook.coursedir, root / course_id))


def _require_own_rights(course: CourseDirectory, root: Path, assignment: str) -> None:
    home = root / course.course_id
    if not course.groupshared:
        _require_right(root, os.W_OK | os.X_OK, f"sudo chmod 777 {root}")
    if not (home / "inbound").is_dir():
        _require_right(root, os.X_OK, f"sudo chmod 777 {root}")
        raise ExchangeRightsError(
            f"Nobody can hand in yet, as there is no folder {home / 'inbound'}: run `nbgrader "
            f"release_assignment {assignment}`, which makes it."
        )
    _require_right(home / "inbound", os.R_OK | os.X_OK, f"chmod 2733 {home / 'inbound'}")
    feedback = home / "feedback"
    if not feedback.exists():
        _require_right(home, os.W_OK | os.X_OK, f"chmod 755 {home}")
    elif not course.groupshared and feedback.stat().st_uid != os.geteuid():
        raise ExchangeRightsError(
            f"{feedback} belongs to {_owner(feedback)}, and nbgrader releases feedback into a "
            f"folder of its own user only: run `sudo chown -R $(id -un) {feedback}`, or run this "
            "command as that user."
        )
    else:
        _require_right(feedback, os.W_OK | os.X_OK, f"chmod 711 {feedback}")


def _require_right(folder: Path, rights: int, remedy: str) -> None:
    missing = [
        letter for bit, letter in _LETTERS.items() if rights & bit and not os.access(folder, bit)
    ]
    if missing:
        raise ExchangeRightsError(
            f"You may not {' and '.join(_NAMES[letter] for letter in missing)} {folder} (it is "
            f"{stat.filemode(folder.stat().st_mode)} and belongs to {_owner(folder)}; the right "
            f"{''.join(missing)} is missing): run `{remedy}` as its owner."
        )


def _missing_for_students(course: CourseDirectory, home: Path) -> Iterator[str]:
    """Yield what others may not do; where all servers run as one user, that need not matter."""
    if course.groupshared:
        return
    needed = {
        home.parent: ("x", "nobody else reaches the exchange"),
        home: ("x", "nobody else reaches this course"),
        home / "inbound": ("wx", "nobody else can hand in"),
        home / "feedback": ("x", "nobody else can fetch feedback"),
    }
    for folder, (letters, what) in needed.items():
        if not folder.is_dir():
            continue
        mode = stat.S_IMODE(folder.stat().st_mode)
        missing = [one for one in letters if not mode & {"w": 0o002, "x": 0o001}[one]]
        if missing:
            yield (
                f"{folder} is {stat.filemode(folder.stat().st_mode)}, so {what}: run `chmod "
                f"o+{''.join(missing)} {folder}`, unless everybody's server runs as one user."
            )


def _owner(path: Path) -> str:
    try:
        return path.owner()
    except KeyError:
        return f"user {path.stat().st_uid}"
