"""The intake for nbgrader's own commands, which look for notebooks by their names alone.

nbgrader gives zero points, for good, for a notebook that is not there under its own name. Where it
may lie there under another, `autograder grade` takes it or asks; here it is asked about.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from nbformat import NotebookNode
from nbgrader.api import Gradebook
from nbgrader.coursedir import CourseDirectory

from autograder.assignments.intake import claim_records, open_questions
from autograder.assignments.intake.handed_files.file_names import find_entry, quote_name
from autograder.assignments.intake.handed_files.handed_in import handed_out
from autograder.assignments.intake.notebook_search import Intake, UnclearError
from autograder.assignments.submission import SubmissionError


def submitted_folder(coursedir: CourseDirectory, assignment: str, student: str) -> Path:
    """Return the folder of a submission, as nbgrader's configuration has it."""
    return Path(coursedir.format_path(coursedir.submitted_directory, student, assignment))


def known_students(coursedir: CourseDirectory) -> frozenset[str]:
    """Return the students whom the gradebook knows."""
    with Gradebook(coursedir.db_url, coursedir.course_id) as gradebook:
        return frozenset(student.id for student in gradebook.students)


def look_into(
    coursedir: CourseDirectory,
    assignment: str,
    student: str,
    released: Mapping[str, NotebookNode],
) -> Intake:
    """Return the intake of one submission; ``released`` are the assignment's notebooks."""
    return Intake(
        submitted_folder(coursedir, assignment, student),
        released,
        claim_records.of_student(Path(coursedir.root), assignment, student),
        whose=f"{quote_name(assignment)} {quote_name(student)}",
        given=handed_out(Path(coursedir.format_path(coursedir.release_directory, ".", assignment))),
    )


def missing_notebooks(folder: Path, names: list[str]) -> list[str]:
    """Return which notebooks nbgrader does not find in a submission."""
    return [name for name in names if not find_entry(folder, f"{name}.ipynb").is_file()]


def ask_about(
    gradebook: Gradebook,
    intake: Intake,
    names: list[str],
    assignment: str,
    student: str,
    work: Path,
) -> None:
    """Have a person look at the notebooks ``names``, which nbgrader has not found, if need be."""
    for name in names:
        try:
            found = intake.find_notebook(name)
            why = " ".join((*found.notes, f"`autograder grade {quote_name(assignment)}` takes it."))
        except UnclearError as error:
            why = f"{error} {error.suggestion}"
        except SubmissionError:
            continue
        grades = gradebook.find_submission_notebook(name, assignment, student).grades
        for grade in grades:
            grade.needs_manual_grade = True
        question = open_questions.OpenQuestion(why, tuple(grade.name for grade in grades))
        open_questions.keep_question(work, assignment, student, name, question)
    gradebook.db.commit()
