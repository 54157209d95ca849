"""The class report: made of what was graded, and written to files."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from nbformat import NotebookNode

from autograder.assignments import submission
from autograder.assignments.submission import SubmissionError
from autograder.class_report import ClassReportError, attention, feedback, figures, means
from autograder.class_report.class_data import ClassData, collect_class
from autograder.class_report.class_report import ClassReport
from autograder.class_report.platforms import exports
from autograder.class_report.platforms.exports import Export
from autograder.class_report.similarity import alike_pairs, compared_work
from autograder.class_report.similarity.own_text import GivenText
from autograder.gradebook.course_gradebook import CourseGradebook
from course.messages.yaml_text import format_count

PAGE, CANVAS, MOODLE = "class-report.html", "canvas.csv", "moodle.csv"


def make_report(
    root: Path, assignment: str, threshold: float = alike_pairs.THRESHOLD
) -> ClassReport:
    """Make the report of an assignment from the gradebook, the records and the submissions.

    Raises:
        ClassReportError: no such assignment, or nothing of it has been graded yet.
        GradebookError: ``root`` is no course.
    """
    data = collect_class(root, assignment)
    given = GivenText(_read_notebooks(data, "release"), _read_notebooks(data, "source"))
    texts, notes = compared_work.texts_of(data, given)
    return ClassReport(
        data, figures.check_figures(data), figures.run_times(data), feedback.common_groups(data),
        attention.people_needed(data), compared_work.compare_class(data, texts, given, threshold),
        texts, given, threshold, (*data.notes, *notes), means.of_class(data),
    )  # fmt: skip


def write_report(
    report: ClassReport, column: str = "", *, provisional: bool = False, zero_absent: bool = False
) -> list[Path]:
    """Write the page and both exports into ``reports/ASSIGNMENT``; return the files.

    Raises:
        ClassReportError: the folder cannot be written.
    """
    from autograder.class_report import report_page  # plots take a moment to import

    folder = report.data.root / "reports" / report.data.assignment
    chosen = {"provisional": provisional, "zero_absent": zero_absent}
    contents = {
        PAGE: report_page.render_page(report),
        CANVAS: exports.export_canvas(report.data, column, **chosen).text,
        MOODLE: exports.export_moodle(report.data, column, **chosen).text,
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in contents.items():
            # A lone surrogate (a folder name that is no UTF-8) must not cost the others' grades.
            encoded = content.encode("utf-8", "backslashreplace")
            (folder / name).write_bytes(encoded)
    except OSError as error:
        raise ClassReportError(
            f"The report cannot be written in {folder} ({error.strerror or error}): make room "
            "there, or make the folder writable, and run the same command again."
        ) from None
    return [folder / name for name in contents]


def export_remarks(export: Export) -> list[str]:
    """Return what an instructor has to know before importing the files, as sentences."""
    remarks = []
    everybody = export.students + len(export.waiting) + len(export.absent)
    if export.waiting or export.absent:
        remarks.append(
            f"The exports have points for {export.students} of {everybody} students; an empty cell "
            "is no grade for both platforms, and deletes one that is there."
        )
    if export.waiting:
        number = len(export.waiting)
        remarks.append(
            f"Empty for {format_count(number, 'student')} whose "
            f"{'grade' if number == 1 else 'grades'} "
            f"still {'waits' if number == 1 else 'wait'} for a person (--provisional takes them "
            "in)."
        )
    if export.absent:
        remarks.append(
            f"Empty for {format_count(len(export.absent), 'student')} who handed in nothing: "
            "whether that is a 0 is your course's rule, which the platforms can apply themselves "
            "(--zero-absent writes it)."
        )
    if export.guarded:
        remarks.append(
            "These ids could run as a formula in a spreadsheet and were written with an apostrophe "
            f"in front, so match them by hand: {', '.join(export.guarded[:20])}."
        )
    return remarks


def _read_notebooks(data: ClassData, step: Literal["source", "release"]) -> dict[str, NotebookNode]:
    coursedir = CourseGradebook(data.root).coursedir
    directory = {"source": coursedir.source_directory, "release": coursedir.release_directory}
    folder = Path(coursedir.format_path(directory[step], ".", data.assignment))
    mend = {"source": "build", "release": f"release {data.assignment}"}
    found = {}
    for path in sorted(folder.glob("*.ipynb")):
        try:
            found[path.stem] = submission.read_notebook(path)
        except SubmissionError as error:
            raise ClassReportError(
                f"{error} It lies in {folder}: run `autograder {mend[step]}` again."
            ) from None
    return found
