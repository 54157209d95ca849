"""``autograder collect``: hand-ins of a platform's zip file come into ``submitted/``.

Each is unpacked beside and moved into place as a whole. What cannot be taken is said, a sentence
each, and stops nobody else.
"""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from autograder.assignments.intake import roster
from autograder.assignments.intake.handed_files import download_names
from autograder.assignments.intake.handed_files.file_names import join_names
from autograder.assignments.intake.handed_files.handed_in import is_junk
from autograder.gradebook.collecting.exchange import COLLECTED, Hold
from autograder.gradebook.collecting.matching import Student, match_students, read_students
from autograder.gradebook.collecting.placing import place_submission
from autograder.gradebook.collecting.platform_zip import (
    Download,
    DownloadError,
    HandIn,
    open_download,
)
from autograder.gradebook.collecting.unpacking import (
    NotTakenError,
    check_bounds,
    is_inside,
    unpack_file,
)
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.util.work_files import walk_files
from course.util.close_matches import is_it


@dataclass(frozen=True)
class CollectedZip:
    """What became of a download.

    Attributes:
        assignment: what it is of.
        platform: Moodle or Canvas.
        collected: the students whose work is new in ``submitted/``.
        replaced: those of them who had handed in something else before.
        unchanged: the students whose work lay there already.
        problems: a sentence for each hand-in that was not collected.
        remarks: what else a person should know.
    """

    assignment: str
    platform: str
    collected: tuple[str, ...]
    replaced: tuple[str, ...]
    unchanged: tuple[str, ...]
    problems: tuple[str, ...]
    remarks: tuple[str, ...]


def collect_zip(
    gradebook: CourseGradebook, path: Path, assignment: str, said: Mapping[str, str], hold: Hold
) -> CollectedZip:
    """Bring the hand-ins of a zip file into ``submitted/``.

    Args:
        gradebook: the course's.
        path: what was downloaded from Moodle or Canvas.
        assignment: what it is of; if it is empty, that whose notebooks are in it.
        said: {platform's number: student} of whom names do not say who they are.
        hold: holds the course (`engine.lock_course`).

    Raises:
        DownloadError: nothing of it can be collected.
        OSError: there is no room.
    """
    students = read_students(gradebook)
    _require_known(said, students)
    with open_download(path) as download:
        assignment = assignment or _guess_assignment(gradebook, download)
        notebooks = _notebook_files(gradebook, assignment)
        matches = match_students(
            download.hand_ins, students, said, users=download.platform == "Canvas"
        )
        with hold():
            intake = _ZipIntake(gradebook, download, assignment, notebooks)
            for student, one in sorted(matches.found.items()):
                intake.take(student, one)
            return intake.result(matches.problems)


def _require_known(said: Mapping[str, str], students: list[Student]) -> None:
    known = {student.student for student in students}
    for number, student in said.items():
        if student not in known:
            raise DownloadError(
                f"--who {number}={student}: the gradebook has no student '{student}'"
                f"{is_it(student, known)}; add one with `nbgrader db student add {student}`."
            )


def _notebook_files(gradebook: CourseGradebook, assignment: str) -> frozenset[str]:
    known = gradebook.assignment_names()
    if assignment not in known:
        raise DownloadError(
            f"There is no released assignment '{assignment}'{is_it(assignment, known)}: there are "
            f"{', '.join(known) or 'none yet'}."
        )
    return frozenset(f"{name}.ipynb" for name in gradebook.notebook_names(assignment))


def _guess_assignment(gradebook: CourseGradebook, download: Download) -> str:
    known = gradebook.assignment_names()
    files = {PurePosixPath(place).name for one in download.hand_ins for place in one.files}
    fits = []
    for assignment in known:
        notebooks = _notebook_files(gradebook, assignment)
        if any(download_names.first_name(name, notebooks) in notebooks for name in files):
            fits.append(assignment)
    fits = fits or (known if len(known) == 1 else [])
    if len(fits) != 1:
        raise DownloadError(
            "The names of the files do not say which assignment this is: name it with --assignment "
            f"({', '.join(known) or 'none is released yet'})."
        )
    return fits[0]


class _ZipIntake:
    """Takes one hand-in after the other, and keeps what became of them."""

    def __init__(
        self,
        gradebook: CourseGradebook,
        download: Download,
        assignment: str,
        notebooks: Collection[str],
    ) -> None:
        self._root, self._limits = gradebook.root, gradebook.file_limits
        self._download, self._assignment, self._notebooks = download, assignment, notebooks
        self._beside = gradebook.root / COLLECTED / f"{assignment}.zip"
        self._new: list[str] = []
        self._replaced: list[str] = []
        self._unchanged: list[str] = []
        self._late: list[str] = []
        self._problems: list[str] = []
        self._left_out = list(download.left_out)

    def take(self, student: str, one: HandIn) -> None:
        shutil.rmtree(self._beside, ignore_errors=True)
        place = roster.student_folder(self._root, student) / self._assignment
        try:
            files = self._places(one)
            check_bounds(files, self._limits)
            for name, entry in files.items():
                unpack_file(self._download.archive, entry, self._beside / name, name)
        except NotTakenError as error:
            self._problems.append(f"{one} is not collected: {error}.")
            return
        finally:
            if one.late:
                self._late.append(student)
        if _same_work(self._beside, place):
            self._unchanged.append(student)
            return
        if place.is_dir():
            self._replaced.append(student)
        place_submission(self._beside, place)
        self._new.append(student)

    def result(self, unmatched: tuple[str, ...]) -> CollectedZip:
        shutil.rmtree(self._beside, ignore_errors=True)
        remarks = []
        if self._left_out:
            remarks.append(
                f"Left out, as it is no file that was handed in: {join_names(self._left_out)}."
            )
        if self._late:
            remarks.append(
                f"Late, says {self._download.platform}: {', '.join(self._late)}. It does not say "
                "how much, so nothing is taken off for it unless you write the time of submission "
                f"into submitted/STUDENT/{self._assignment}/timestamp.txt."
            )
        return CollectedZip(
            self._assignment, self._download.platform, tuple(self._new), tuple(self._replaced),
            tuple(self._unchanged), (*unmatched, *self._problems), tuple(remarks),
        )  # fmt: skip

    def _places(self, one: HandIn) -> dict[str, zipfile.ZipInfo]:
        """Return {path in the submission: place in the archive}; a path that leads out is none."""
        found: dict[str, zipfile.ZipInfo] = {}
        for place, entry in one.files.items():
            plain = download_names.first_name(place, self._notebooks)
            name = plain if plain not in one.files else place
            if is_inside(name):
                found[name] = entry
            else:
                self._left_out.append(place)
        if not found:
            raise NotTakenError("there is no file in it")
        return found


def _same_work(new: Path, place: Path) -> bool:
    """Whether two folders hold the same files, but for what an exchange adds."""
    here, there = _work_files(new), _work_files(place)
    return here.keys() == there.keys() and all(
        here[name].read_bytes() == there[name].read_bytes() for name in here
    )


def _work_files(folder: Path) -> dict[str, Path]:
    found = {path.relative_to(folder).as_posix(): path for path in walk_files(folder)}
    return {
        name: path for name, path in found.items()
        if not is_junk(name) and path.is_file() and not path.is_symlink()
    }  # fmt: skip
