"""What a hub's ``hub.toml`` says, and whether this machine has what it names.

`autograder new hub` copies this module into the hub's folder. Its only dependency is pydantic,
which JupyterHub installs, so it works even if the course is installed in another environment.
"""

from __future__ import annotations

import os
import pwd
import stat
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

FILE = "hub.toml"
COURSE_ID = r"^[a-z0-9]+(-[a-z0-9]+)*$"
"""What a course can be called: it is a folder, a group and a part of an address."""

EXCHANGE_RIGHTS = {"": "rwx", "COURSE": "x", "COURSE/inbound": "wx", "COURSE/feedback": "x"}
"""What everybody must be allowed in the exchange, and in what nbgrader makes in it."""

_BITS = {"r": stat.S_IROTH, "w": stat.S_IWOTH, "x": stat.S_IXOTH}
_NAMES = {"r": "read", "w": "write", "x": "enter"}


class HubError(Exception):
    """A hub that cannot start; the message says what is wrong, where, and what to do."""


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Course(_Strict):
    """A course: the Unix user that grades it, its root, its port, and who belongs to it."""

    grader: str
    root: Path
    port: int = Field(ge=1024, le=65_535)
    instructors: list[str] = []
    students: list[str] = []


class HubSettings(_Strict):
    """The content of ``hub.toml``; what each field means stands there."""

    exchange: Path
    python: Path
    address: str = "127.0.0.1"
    port: int = Field(default=8000, ge=1, le=65_535)
    admins: list[str] = []
    idle_minutes: int = Field(default=60, ge=1)
    memory: str = Field(default="2G", pattern=r"^\d+(\.\d+)?[KMGT]$")
    processors: float = Field(default=2.0, gt=0)
    courses: dict[Annotated[str, Field(pattern=COURSE_ID)], Course] = Field(min_length=1)

    @property
    def allowed_users(self) -> set[str]:
        """Return everybody who may sign in."""
        people = [*self.admins]
        for course in self.courses.values():
            people += [*course.instructors, *course.students]
        return set(people)


def read_settings(folder: Path) -> HubSettings:
    """Return what the ``hub.toml`` of a folder says.

    Raises:
        HubError: it cannot be read, or is not sound.
    """
    file = folder / FILE
    try:
        settings = HubSettings.model_validate(tomllib.loads(file.read_text(encoding="utf-8")))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise HubError(f"{file}: {where}: {first['msg']}.") from None
    except (OSError, ValueError) as error:
        raise HubError(
            f"{file} cannot be read ({error}): mend it, then start the hub again."
        ) from (error)
    return settings


def require_machine(settings: HubSettings) -> None:
    """See that the exchange, the graders and the course roots are there, with the rights needed.

    Raises:
        HubError: the first thing that is missing, and the command that makes it.
    """
    for problem in _problems(settings):
        raise HubError(problem)


def _problems(settings: HubSettings) -> Iterator[str]:
    exchange = settings.exchange
    if not exchange.is_dir():
        yield (
            f"There is no exchange at {exchange}: make it with `sudo mkdir -p {exchange} && sudo "
            f"chmod 777 {exchange}`, or name yours in {FILE}."
        )
    for folder in exchange.parents:
        yield from _missing_right(folder, "x")
    for name in settings.courses:
        for place, letters in EXCHANGE_RIGHTS.items():
            if (folder := exchange / place.replace("COURSE", name)).is_dir():
                yield from _missing_right(folder, letters)
    for name, course in settings.courses.items():
        yield from _course_problems(name, course, exchange)
    if not os.access(settings.python, os.X_OK):
        yield f"There is no Python at {settings.python}: name the course's own in {FILE} (python)."


def _missing_right(folder: Path, letters: str) -> Iterator[str]:
    mode = folder.stat().st_mode
    missing = "".join(letter for letter in letters if not mode & _BITS[letter])
    if missing:
        names = " and ".join(_NAMES[letter] for letter in missing)
        yield (
            f"Not everybody may {names} {folder} (it is {stat.filemode(mode)}; the right {missing} "
            f"is missing for others): run `sudo chmod o+{missing} {folder}`."
        )


def _course_problems(name: str, course: Course, exchange: Path) -> Iterator[str]:
    try:
        pwd.getpwnam(course.grader)
    except KeyError:
        yield (
            f"There is no user {course.grader}, who grades {name}: run `sudo useradd "
            f"--create-home {course.grader}`, or name another in {FILE}."
        )
    if not (course.root / "nbgrader_config.py").is_file():
        yield (
            f"There is no course {name} at {course.root}: run `sudo -u {course.grader} autograder "
            f"new course {course.root} --course-id {name} --exchange {exchange}` (--chapter-5 for "
            "the bundled one)."
        )
