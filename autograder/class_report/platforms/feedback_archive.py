"""Feedback in one archive, as Moodle and Canvas hand it out to the students.

Moodle ("Upload multiple feedback files in a zip") takes any files in a participant's folder: each
gets the index page and the pages beside it. Canvas ("Upload Submissions") shows a file under the
name under which the student handed in, so that name has to fit what is in it: a notebook comes back
as a notebook with its marks in it, an archive as an archive of the pages.
"""

from __future__ import annotations

import hashlib
import io
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

import nbformat
from nbformat.v4 import new_markdown_cell

from autograder.assignments import submission
from autograder.assignments.intake import notebook_search, roster
from autograder.assignments.intake.handed_files.archives import ArchiveError
from autograder.assignments.submission import SubmissionError
from autograder.class_report import class_data
from autograder.class_report.platforms import platform_names
from autograder.class_report.platforms.platform_names import NamesError, Participant
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.feedback import sheets
from autograder.gradebook.feedback.sheets import Sheet
from course.util.files import replace_file

Platform = Literal["moodle", "canvas"]
Member = tuple[str, bytes]


@dataclass(frozen=True)
class Packed:
    """An archive that was written: its path, who is in it, and who is not, by the reason."""

    path: Path
    students: tuple[str, ...]
    left_out: Mapping[str, tuple[str, ...]]


def pack_feedback(root: Path, assignment: str, platform: Platform, names: Path, to: Path) -> Packed:
    """Write the feedback on an assignment as an archive for a platform.

    Args:
        root: the nbgrader course root.
        assignment: its name.
        platform: where it is to be uploaded.
        names: what was downloaded from there: see `platform_names`.
        to: the archive to write.

    Raises:
        NamesError: ``names`` cannot be read, or nobody in it has feedback.
        ClassReportError: there is no such assignment, or nothing of it is graded.
        OSError: the archive cannot be written; what stood there before still does.
    """
    data = class_data.collect_class(root, assignment)
    graded = [grade.student for grade in data.grades]
    read = {"moodle": platform_names.of_moodle, "canvas": platform_names.of_canvas}[platform]
    submitted = {student: _handed_in(root, student, assignment) for student in graded}
    matched = platform_names.match_participants(read(names), data.people, submitted)
    make = {"moodle": _for_moodle, "canvas": _for_canvas}[platform](root, assignment)
    packed: list[str] = []
    without: list[str] = []
    to.parent.mkdir(parents=True, exist_ok=True)
    with replace_file(to) as file, zipfile.ZipFile(file, "w") as archive:
        for student, participant in sorted(matched.who.items()):
            number = sum(_add_member(archive, *member) for member in make(student, participant))
            (packed if number else without).append(student)
        if not packed:
            raise NamesError(
                f"Nobody in {names.name} has feedback on '{assignment}': run `autograder grade "
                f"{assignment}`, and see that it is the download of this assignment."
            )
    missing = [student for student in graded if student not in matched.who]
    left_out = {
        f"not found in {names.name}": tuple(missing),
        "without feedback that the platform could take": tuple(w for w in without if w in graded),
        f"in {names.name}, but not known here": matched.unknown,
    }
    return Packed(to, tuple(packed), {why: who for why, who in left_out.items() if who})


def _for_moodle(root: Path, assignment: str) -> Callable[[str, Participant], Iterator[Member]]:
    def make(student: str, participant: Participant) -> Iterator[Member]:
        for page in _feedback_pages(root, student, assignment):
            yield f"{participant.label}/{page.name}", page.read_bytes()

    return make


def _for_canvas(root: Path, assignment: str) -> Callable[[str, Participant], Iterator[Member]]:
    gradebook = CourseGradebook(root)

    def make(student: str, participant: Participant) -> Iterator[Member]:
        pages = _feedback_pages(root, student, assignment)
        if not pages:
            return
        with gradebook.open_gradebook() as book:
            sheet = sheets.read_sheet(book, gradebook.coursedir, assignment, student)
        taken = _notebooks_by_digest(root, sheet)
        for file in participant.files:
            name = PurePosixPath(file.name).name
            notebook = next((taken[d] for d in file.digests & taken.keys()), "")
            if name.lower().endswith(".zip"):
                inner = io.BytesIO()
                with zipfile.ZipFile(inner, "w") as archive:
                    for page in pages:
                        _add_member(archive, page.name, page.read_bytes())
                yield name, inner.getvalue()
            elif content := _with_marks(root, sheet, notebook or _exercise_by_name(name, sheet)):
                yield name, content

    return make


def _notebooks_by_digest(root: Path, sheet: Sheet) -> dict[str, str]:
    """Return {digest of a file: notebook} of what counts as a student's, whatever its name."""
    release = root / "release" / sheet.assignment
    released = {}
    for exercise in sheet.exercises:
        with suppress(SubmissionError):  # then names have to do
            name = exercise.notebook
            released[name] = submission.read_notebook(release / f"{name}.ipynb")
    found = notebook_search.of_student(root, sheet.assignment, sheet.student, released)
    taken: dict[str, str] = {}
    for name in released:
        with suppress(SubmissionError, ArchiveError, OSError):
            taken.setdefault(hashlib.sha256(found.read_content(name)).hexdigest(), name)
    return taken


def _exercise_by_name(name: str, sheet: Sheet) -> str:
    """Return which exercise a file of a Canvas download is by name: `…_qos-design-1.ipynb`, say."""
    if not name.lower().endswith(".ipynb"):
        return ""
    # Canvas numbers the files of later attempts.
    stem = re.sub(r"-\d+$", "", name[: -len(".ipynb")])
    fits = [e.notebook for e in sheet.exercises if stem.endswith(f"_{e.notebook}")]
    return max(fits, key=len, default="")


def _with_marks(root: Path, sheet: Sheet, notebook: str) -> bytes | None:
    """Return a graded copy with its marks and comments as cells; None if there is no copy."""
    exercise = next((e for e in sheet.exercises if e.notebook == notebook), None)
    path = root / "autograded" / sheet.student / sheet.assignment / f"{notebook}.ipynb"
    try:
        graded = submission.read_notebook(path) if exercise else None
    except SubmissionError:
        graded = None
    if graded is None or exercise is None:
        return None
    late = sheets.describe_lateness(sheet.seconds_late, exercise.penalty)
    rows = [f"| {line.title.replace('|', '')} | {line.said} |" for line in exercise.lines]
    table = "\n".join(["| | |", "|---|---|", *rows])
    parts = (f"# {exercise.title}: feedback", exercise.score_sentence, late, table)
    top = "\n\n".join(part for part in parts if part)
    cells = [new_markdown_cell(top)]  # type: ignore[no-untyped-call]
    by_id = {line.grade_id: line for line in exercise.lines}
    for cell in graded.cells:
        cells.append(cell)
        line = by_id.get(submission.grade_id(cell))
        if line:
            comment = f"\n\n{line.comment}" if line.comment else ""
            said = f"**{line.title}: {line.said}**{comment}"
            cells.append(new_markdown_cell(said))  # type: ignore[no-untyped-call]
    for cell in cells:
        cell.metadata.pop("nbgrader", None)  # it is to be read, not to be handed in again
    graded.cells = cells
    return str(nbformat.writes(graded)).encode()  # type: ignore[no-untyped-call]


def _feedback_pages(root: Path, student: str, assignment: str) -> list[Path]:
    return sorted((root / "feedback" / student / assignment).glob("*.html"))


def _handed_in(root: Path, student: str, assignment: str) -> list[Path]:
    folder = roster.student_folder(root, student) / assignment
    files = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return [path for path in files if path.stat().st_size <= platform_names.MAX_FILE_BYTES]


def _add_member(archive: zipfile.ZipFile, name: str, content: bytes) -> int:
    # A fixed time: the same feedback makes the same archive.
    archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    return 1
