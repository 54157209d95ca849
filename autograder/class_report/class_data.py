"""Collects what is known of a graded class: grades, people, and the verdicts behind the points."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from nbgrader.api import Gradebook
from sqlalchemy.exc import SQLAlchemyError

from autograder.assignments import questions
from autograder.assignments.intake import roster
from autograder.assignments.intake.handed_files.file_names import normalise_name
from autograder.assignments.intake.notebook_search import GRADED_AS
from autograder.assignments.intake.roster import Roster
from autograder.assignments.questions import GradedQuestion
from autograder.class_report import ClassReportError
from autograder.gradebook import verdict_records
from autograder.gradebook.course_gradebook import CourseGradebook, Grade
from autograder.gradebook.nbgrader_plugins.autograde_steps import WORK_FOLDER
from autograder.gradebook.verdict_records import Record, RecordError
from quizzes.errors import suggest_name


@dataclass(frozen=True)
class Person:
    """A student as nbgrader's gradebook knows them; what it does not know is empty."""

    student: str
    first_name: str = ""
    last_name: str = ""
    email: str = ""
    lms_user_id: str = ""

    @property
    def name(self) -> str:
        """First and last name; empty if neither is known."""
        return " ".join(part for part in (self.first_name, self.last_name) if part)


@dataclass(frozen=True)
class ClassData:
    """A graded class.

    Attributes:
        root: the nbgrader course root.
        assignment: its name.
        max_score: points there are to earn.
        grades: one a student, sorted by student.
        people: {student: person}.
        records: {student: {notebook: what came of running it}}; what is missing was graded before
            records were kept, or is damaged (`notes` says so).
        not_entered: students with a folder in ``submitted/`` and no grade.
        absent: students of the gradebook who have handed in nothing.
        left_out: {student: notebooks that are not in what they handed in}.
        questions: {notebook: {grade id: question}}, as far as the source is there.
        notes: a sentence for each thing that is left out.
    """

    root: Path
    assignment: str
    max_score: float
    grades: tuple[Grade, ...]
    people: Mapping[str, Person] = field(default_factory=dict)
    records: Mapping[str, Mapping[str, Record]] = field(default_factory=dict)
    not_entered: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    absent: tuple[str, ...] = ()
    left_out: Mapping[str, frozenset[str]] = field(default_factory=dict)
    questions: Mapping[str, Mapping[str, GradedQuestion]] = field(default_factory=dict)

    def has_left_out(self, student: str, notebook: str) -> bool:
        """Whether a student who handed in something has not handed in this."""
        return notebook in self.left_out.get(student, ())

    def is_unreadable(self, student: str, notebook: str) -> bool:
        """Whether a notebook could not be run at all, so that a person has to look at it."""
        record = self.records.get(student, {}).get(notebook)
        return record is not None and record.unreadable

    def not_handed_in(self, notebook: str) -> int:
        """How many students of the gradebook have not handed in a notebook."""
        left_out = sum(notebook in notebooks for notebooks in self.left_out.values())
        return len(self.absent) + left_out

    def display_name(self, student: str) -> str:
        """Return how a student is called: the name, if one is known, with the id behind it."""
        person = self.people.get(student)
        return f"{person.name} ({student})" if person and person.name else student


def collect_class(root: Path, assignment: str) -> ClassData:
    """Read what is known of an assignment's class.

    Raises:
        ClassReportError: no such assignment, nothing of it graded yet, or a gradebook that cannot
            be read.
        GradebookError: ``root`` is no course.
        GradebookUnusable: its gradebook cannot be read.
    """
    gradebook = CourseGradebook(root)
    try:
        _require_assignment(gradebook, assignment)
        grades = tuple(gradebook.read_grades(assignment))
        people = _read_people(gradebook)
    except SQLAlchemyError as error:
        raise ClassReportError(
            f"The gradebook of {gradebook.root} cannot be read ({_error_reason(error)}): if "
            "another program uses it, wait until that is done; if it is damaged, put a copy back."
        ) from None
    if not grades:
        raise ClassReportError(
            f"Nothing of '{assignment}' has been graded yet: run `autograder grade {assignment}` "
            "first."
        )
    found, notes = _load_records(gradebook.root, assignment, grades)
    known = {grade.student for grade in grades}
    handed_in = _find_submitters(gradebook, assignment, known | people.keys())
    absent = people.keys() - known - set(handed_in)
    return ClassData(
        gradebook.root, assignment, max(grade.max_score for grade in grades), grades, people,
        found, tuple(student for student in handed_in if student not in known), tuple(notes),
        tuple(sorted(absent)), _left_out(gradebook.root, assignment, found),
        questions.known_questions(gradebook.coursedir, assignment),
    )  # fmt: skip


def _require_assignment(gradebook: CourseGradebook, assignment: str) -> None:
    known = gradebook.assignment_names()
    if assignment not in known:
        raise ClassReportError(
            f"There is no assignment '{assignment}' in the gradebook of {gradebook.root}: there "
            f"are {', '.join(known) or 'none yet'}.{suggest_name(assignment, known)}"
        )


def _read_people(gradebook: CourseGradebook) -> dict[str, Person]:
    courses = gradebook.coursedir
    with Gradebook(courses.db_url, courses.course_id) as book:
        return {
            s.id: Person(
                s.id, s.first_name or "", s.last_name or "", s.email or "", s.lms_user_id or ""
            )
            for s in book.students
            if s.id not in gradebook.excluded_students
        }


def _load_records(
    root: Path, assignment: str, grades: tuple[Grade, ...]
) -> tuple[dict[str, dict[str, Record]], list[str]]:
    found: dict[str, dict[str, Record]] = {}
    notes: list[str] = []
    missing = 0
    for grade in grades:
        of_student = found.setdefault(grade.student, {})
        for notebook in grade.cells:
            try:
                record = verdict_records.load_record(
                    root / WORK_FOLDER, assignment, grade.student, notebook
                )
            except RecordError as error:
                notes.append(str(error))
                continue
            if record is None:
                missing += 1
            else:
                of_student[notebook] = record
    if missing:
        what = "1 notebook has" if missing == 1 else f"{missing} notebooks have"
        notes.append(
            f"{what} a grade but no record of the checks behind it: run "
            f"`autograder grade {assignment}` again to have it written."
        )
    return found, notes


def _left_out(
    root: Path, assignment: str, found: Mapping[str, Mapping[str, Record]]
) -> dict[str, frozenset[str]]:
    """Return the notebooks that are not there and were not examined under another name either."""

    def is_missing(student: str, notebook: str, record: Record) -> bool:
        results = [check for verdict in record.verdicts.values() for check in verdict.checks]
        taken = any(GRADED_AS in note for note in record.notes)
        if record.unreadable or taken or any(c.status != "not_checked" for c in results):
            return False
        return not (
            roster.student_folder(root, student) / assignment / f"{notebook}.ipynb"
        ).exists()

    return {
        student: frozenset(n for n, record in notebooks.items() if is_missing(student, n, record))
        for student, notebooks in found.items()
    }


def _find_submitters(
    gradebook: CourseGradebook, assignment: str, known: Collection[str]
) -> list[str]:
    """Return who has handed in something, even where nobody looks for it.

    A name that is ``known`` in another form of Unicode is that.
    """
    assignments = gradebook.assignment_names()
    students, wrong = roster.find_submissions(gradebook.root, assignment, Roster(), assignments)
    ids = {normalise_name(student): student for student in known}
    return sorted({ids.get(normalise_name(name), name) for name in (*students, *wrong)})


def _error_reason(error: SQLAlchemyError) -> str:
    return str(getattr(error, "orig", None) or error).splitlines()[0][:200]
