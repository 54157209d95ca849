"""nbgrader's exchange: submissions come into ``submitted/``, and feedback goes back.

nbgrader collects them as `nbgrader collect --update` does, but into a folder of the engine's, from
where each is moved into place as a whole. By itself it removes the earlier submission and then
copies the new one file by file, so that one of which half was copied when it was killed would stay
so for ever: its time of submission is there already. One student's folder that cannot be taken
ends its work for everybody; here that student is named, and the others are collected.
"""

from __future__ import annotations

import glob
import hashlib
import os
import pwd
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from nbgrader.exchange.default import ExchangeCollect

from autograder.assignments.intake import roster
from autograder.assignments.intake.handed_files import folder_digest
from autograder.assignments.intake.handed_files.file_names import printable_name
from autograder.gradebook.collecting.placing import place_submission
from autograder.gradebook.course_gradebook import CourseGradebook, GradebookError
from autograder.gradebook.nbgrader_plugins.autograde_steps import WORK_FOLDER
from autograder.gradebook.staging import SECRET, TIME
from autograder.running.resource_errors import is_full
from autograder.util.state_table import StateTable

COLLECTED = f"{WORK_FOLDER}/collected"
KIND = "released"
"""Rows of the course's state: which feedback of a student's is in the exchange."""

_NOBODY = {"username": "", "filename": "", "timestamp": datetime.min}
"""What a folder in the exchange is for nbgrader that is nobody's submission."""


Hold = Callable[[], AbstractContextManager[None]]


def _never() -> bool:
    return False


@dataclass(frozen=True)
class Collected:
    """The students of whom something new has come, and a sentence for each thing that has not."""

    students: tuple[str, ...]
    remarks: tuple[str, ...] = ()


def collect_submissions(
    gradebook: CourseGradebook,
    assignment: str,
    hold: Hold,
    stopped: Callable[[], bool] = _never,
) -> Collected:
    """Bring new submissions of an assignment from the exchange into ``submitted/``.

    Args:
        gradebook: the course's.
        assignment: its name. Only one process at a time may collect it.
        hold: holds the course, so that nobody grades it meanwhile (`engine.lock_course`); it is
            asked for only if there is something new.
        stopped: is asked before each submission whether to leave the rest for the next time.

    Raises:
        GradebookError: nbgrader cannot collect at all.
        OSError: there is no room.
    """
    root, mirror = gradebook.root, gradebook.root / COLLECTED / assignment
    remarks: list[str] = []
    _lay_out_times(gradebook, assignment, mirror)
    gradebook.collect(
        assignment, str(mirror.relative_to(root)), lambda of: _make_collector(of, remarks, stopped)
    )
    new = {
        folder.parent.name: folder
        for folder in sorted(mirror.glob(f"*/{glob.escape(assignment)}"))
        if _is_new(folder, _place(root, folder.parent.name, assignment))
    }
    if new:
        with hold():
            for student, folder in new.items():
                place_submission(folder, _place(root, student, assignment))
    shutil.rmtree(mirror, ignore_errors=True)
    return Collected(tuple(new), tuple(remarks))


def _place(root: Path, student: str, assignment: str) -> Path:
    return roster.student_folder(root, student) / assignment


def _is_new(collected: Path, place: Path) -> bool:
    """Whether nbgrader has put a submission there, and not the one that is in place."""
    if {path.name for path in collected.iterdir()} <= {TIME}:
        return False
    # One whose time cannot be read is copied each time.
    return not place.is_dir() or folder_digest.of_folder(collected) != folder_digest.of_folder(
        place
    )


def _lay_out_times(gradebook: CourseGradebook, assignment: str, mirror: Path) -> None:
    """Let nbgrader see the times of the submissions that are there, and nothing else of them."""
    shutil.rmtree(mirror, ignore_errors=True)
    mirror.mkdir(parents=True)
    for place in (gradebook.root / "submitted").glob(f"*/{glob.escape(assignment)}"):
        stub = mirror / place.parent.name / assignment
        stub.mkdir(parents=True)
        if (time := roster.read_timestamp(place / TIME, gradebook.time_zone)) is not None:
            (stub / TIME).write_text(time, encoding="utf-8")


def _make_collector(
    base: type[ExchangeCollect], remarks: list[str], stopped: Callable[[], bool]
) -> type[ExchangeCollect]:
    """Return nbgrader's collector, but that one folder in the exchange ends nobody else's work."""

    class Collector(base):  # type: ignore[misc]
        def _path_to_record(self, path: str) -> dict[str, Any]:
            name = printable_name(Path(path).name)
            try:
                record: dict[str, Any] = super()._path_to_record(path)
                owner = _owner_name(path)
            except Exception:  # noqa: BLE001 - whatever a stranger calls a folder
                remarks.append(
                    f"{name} in the exchange has no name that a submission has: it is left there."
                )
                return dict(_NOBODY)
            student = record["username"]
            if self.check_owner and owner != student:
                remarks.append(
                    f"{name} in the exchange was put there by {owner}, not by "
                    f"{printable_name(student)}: it is left there. Where everybody's servers run "
                    "as one user, set c.ExchangeCollect.check_owner = False in nbgrader_config.py."
                )
                return dict(_NOBODY)
            return record

        src_records: list[dict[str, Any]]

        def init_src(self) -> None:
            super().init_src()
            self.src_records = [record for record in self.src_records if record["username"]]

        def do_copy(self, src: str, dest: str, log: Any = None) -> None:
            if stopped():
                return
            try:
                _refuse_links(src)
                super().do_copy(src, dest, log)
            except Exception as error:
                shutil.rmtree(dest, ignore_errors=True)
                if is_full(error):
                    raise
                name = printable_name(Path(src).name)
                remarks.append(f"{name} in the exchange is not collected: {_copy_problem(error)}.")

    return Collector


def _owner_name(path: str) -> str:
    try:
        return pwd.getpwuid(Path(path).stat().st_uid).pw_name
    except KeyError:
        return "an unknown user"


def _refuse_links(folder: str) -> None:
    """Refuse a folder with links: `nbgrader submit` makes none, and they may lead anywhere."""
    for place, folders, files in os.walk(folder):
        if found := [name for name in (*folders, *files) if (Path(place) / name).is_symlink()]:
            raise ValueError(f"it holds a link, {printable_name(found[0])}")


def _copy_problem(error: Exception) -> str:
    if isinstance(error, shutil.Error) and error.args and error.args[0]:
        return str(error.args[0][0][-1])[:200]  # of each file that failed: from, to, why
    return str(error)[:200].rstrip(".")


def release_feedback(gradebook: CourseGradebook, assignment: str, hold: Hold) -> Collected:
    """Release the feedback that the exchange does not have yet; return whose, and what failed.

    Feedback on work that did not come through the exchange has no way back there. ``hold`` is as
    in `collect_submissions`.
    """
    released = StateTable(gradebook.work_folder, KIND, assignment)
    known = released.rows()
    waiting = {
        folder.parent.name: state
        for folder in sorted((gradebook.root / "feedback").glob(f"*/{glob.escape(assignment)}"))
        if (state := _feedback_state(folder)) and known.get((folder.parent.name,)) != state
    }
    students: list[str] = []
    remarks: list[str] = []
    with hold() if waiting else nullcontext():
        for student, state in waiting.items():
            if student in gradebook.excluded_students:
                continue
            try:
                gradebook.release_feedback(assignment, student)
            except GradebookError as error:
                remarks.append(f"The feedback for {student} is not released: {error}")
                continue
            released.put(state, student)  # only now: after a kill it is released once more
            students.append(student)
    return Collected(tuple(students), tuple(remarks))


def _feedback_state(folder: Path) -> str:
    """Return what changes with each feedback; empty if the exchange cannot take it."""
    if not (folder / SECRET).is_file():
        return ""
    state = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        if path.suffix == ".html" or path.name == SECRET:
            with suppress(OSError):
                status = path.stat()
                state.update(f"{path.name} {status.st_size} {status.st_mtime_ns}\n".encode())
    return state.hexdigest()
