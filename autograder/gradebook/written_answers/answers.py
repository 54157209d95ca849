"""Marks for one written question over a whole class: out to a file, and back into the gradebook.

What comes back is looked at whole before anything is entered, and a row whose answer or mark has
changed since the file was made is left for a person.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from nbgrader.api import Assignment, BaseCell, Comment, Grade, Gradebook, Notebook

from autograder.assignments import questions, submission
from autograder.assignments.intake import open_questions
from autograder.assignments.intake.handed_files.file_names import match_name
from autograder.assignments.questions import GradedQuestion
from autograder.assignments.submission import SubmissionError
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.database import of_cells
from autograder.gradebook.nbgrader_plugins.autograde_steps import WORK_FOLDER
from autograder.util.csv_text import as_csv, guard_text, is_formula
from course.errors import CourseError

COLUMNS = (
    "assignment", "notebook", "question", "student", "name", "answer", "points", "comment", "state",
)  # fmt: skip
"""The columns of the file; "points" and "comment" are for a person to fill in."""
MAX_BYTES = 50 * 1024 * 1024
"""Largest file of marks in bytes: 1,000 answers of 10,000 letters have a fifth of it."""
MOST_FAULTS = 20
"""Faults of a file that are named; a longer list helps nobody."""


class MarksError(CourseError):
    """Marks that cannot be written or taken; the message says which and why."""


@dataclass(frozen=True)
class Answer:
    """A student's answer and its mark.

    Attributes:
        student, name: whose it is.
        text: Markdown as the student wrote it.
        points: the mark that stands, None before the first.
        comment: the comment that stands.
        waits: somebody has to look at it, even if there is a mark.
        state: a digest of all that; it tells whether something has changed since.
    """

    student: str
    name: str
    text: str
    points: float | None
    comment: str
    waits: bool
    state: str


@dataclass(frozen=True)
class Answers:
    """All answers to a question: those that wait first; ``empty`` are students who gave none."""

    assignment: str
    question: GradedQuestion
    answers: tuple[Answer, ...]
    empty: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()

    @property
    def waiting_count(self) -> int:
        """How many wait for a mark."""
        return sum(answer.waits for answer in self.answers)


@dataclass(frozen=True)
class EnteredMarks:
    """What became of a file of marks: students by what was done, and those who are left."""

    question: str
    marked: tuple[str, ...] = ()
    already: tuple[str, ...] = ()
    blank: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()


@dataclass
class _Row:
    line: int
    student: str
    points: float | None
    comment: str
    state: str


@dataclass
class _File:
    assignment: str = ""
    notebook: str = ""
    grade_id: str = ""
    rows: list[_Row] = field(default_factory=list)


def written_questions(gradebook: CourseGradebook, assignment: str) -> list[GradedQuestion]:
    """Return the questions of an assignment that a person marks.

    Raises:
        MarksError: there is no such assignment, or nothing in it is marked by a person.
    """
    if assignment not in gradebook.assignment_names():
        known = ", ".join(gradebook.assignment_names()) or "none yet"
        raise MarksError(
            f"There is no assignment '{assignment}' in the gradebook: there are {known}."
        )
    try:
        asked = questions.of_assignment(gradebook.coursedir, assignment)
    except (SubmissionError, OSError) as error:
        raise MarksError(f"The source of '{assignment}' cannot be read: {error}") from None
    found = [q for notebook in asked.values() for q in notebook.values() if q.written]
    if not found:
        raise MarksError(f"Nothing in '{assignment}' is marked by a person.")
    return found


def find_question(gradebook: CourseGradebook, assignment: str, wanted: str) -> GradedQuestion:
    """Return the question that is meant: by its grade id, its title, or a part that one alone has.

    Raises:
        MarksError: none or several are.
    """
    known = written_questions(gradebook, assignment)
    low = wanted.casefold()
    for matches in (
        [q for q in known if q.grade_id == wanted],
        [q for q in known if q.title.casefold() == low],
        [q for q in known if low in q.title.casefold() or low in q.grade_id.casefold()],
    ):
        if len(matches) == 1:
            return matches[0]
        if matches:
            which = ", ".join(f"{q.grade_id} ({q.title})" for q in matches)
            raise MarksError(f"'{wanted}' can be several questions: {which}. Name one by its id.")
    names = ", ".join(f"{q.grade_id} ({q.title})" for q in known)
    raise MarksError(f"There is no question '{wanted}' in '{assignment}': there are {names}.")


def collect_answers(
    gradebook: CourseGradebook, assignment: str, question: GradedQuestion
) -> Answers:
    """Return all answers to a question, from the graded copies and the gradebook."""
    with gradebook.open_gradebook() as book:
        grades = _read_grades(book, assignment, question)
        names = {s.id: " ".join(filter(None, (s.first_name, s.last_name))) for s in book.students}
    asked = open_questions.of_assignment(gradebook.root / WORK_FOLDER, assignment)
    answers: list[Answer] = []
    empty, unread = [], []
    for student, row in sorted(grades.items()):
        text = _read_answer(gradebook, assignment, question, student)
        unclear = asked.get(student, {}).get(question.notebook)
        asked_about = unclear is not None and question.grade_id in unclear.cells
        # If either, what stands in the graded copy is ours, in place of what was handed in.
        if text is None or (row["needs_manual_grade"] and asked_about):
            unread.append(student)
        elif row["manual_score"] is None and not row["needs_manual_grade"]:
            empty.append(student)  # nbgrader has seen that nothing was written
        else:
            answers.append(Answer(
                student, names.get(student) or student, text, row["manual_score"], row["comment"],
                row["needs_manual_grade"], _digest_state(text, row),
            ))  # fmt: skip
    answers.sort(key=lambda answer: (not answer.waits, answer.student))
    return Answers(assignment, question, tuple(answers), tuple(empty), tuple(unread))


def as_file(found: Answers) -> str:
    """Return the answers as CSV, with columns to fill in; one to be looked at again has no points.

    So a person who fills in a part of the file settles nothing that nobody has looked at.
    """
    rows: list[tuple[str, ...]] = [COLUMNS]
    question = found.question
    for answer in found.answers:
        points = "" if answer.waits or answer.points is None else f"{answer.points:g}"
        cells = (
            found.assignment, question.notebook, question.grade_id, answer.student, answer.name,
            answer.text, points, answer.comment, answer.state,
        )  # fmt: skip
        rows.append(tuple(map(guard_text, cells)))
    return as_csv(rows)


def enter_marks(gradebook: CourseGradebook, path: Path) -> EnteredMarks:
    """Enter a file of marks into the gradebook; a cell that is empty changes nothing.

    Raises:
        MarksError: the file cannot be read or has faults: then nothing of it was entered.
    """
    file = _parse_marks(path)
    question = find_question(gradebook, file.assignment, file.grade_id)
    if question.notebook != file.notebook:
        raise MarksError(f"{path.name}: {file.grade_id} is not in the notebook '{file.notebook}'.")
    done: dict[str, list[str]] = {"marked": [], "already": [], "blank": [], "changed": []}
    with gradebook.open_gradebook() as book:
        grades = _read_grades(book, file.assignment, question)
        file.rows = [replace(row, student=match_name(row.student, grades)) for row in file.rows]
        faults = list(_find_faults(file, grades, question))
        if faults:
            shown = " ".join(faults[:MOST_FAULTS])
            more = f" And {len(faults) - MOST_FAULTS} more." if len(faults) > MOST_FAULTS else ""
            raise MarksError(f"Nothing of {path.name} was entered. {shown}{more}")
        for row in file.rows:
            current = grades[row.student]
            text = _read_answer(gradebook, file.assignment, question, row.student)
            what = _decide_row(row, current, _digest_state(text or "", current))
            done[what].append(row.student)
            if what == "marked":
                _enter_row(book, file.assignment, question, row)
        book.db.commit()
    return EnteredMarks(question.title, **{what: tuple(who) for what, who in done.items()})


def _decide_row(row: _Row, current: Mapping[str, Any], state: str) -> str:
    """Return what is to be done with a row."""
    comment = row.comment not in ("", current["comment"])
    points = row.points is not None and (
        row.points != current["manual_score"] or current["needs_manual_grade"]
    )
    if row.state != state and (points or comment):
        return "changed"
    if points or comment:
        return "marked"
    return "blank" if row.points is None else "already"


def _enter_row(book: Gradebook, assignment: str, question: GradedQuestion, row: _Row) -> None:
    where = (question.grade_id, question.notebook, assignment, row.student)
    if row.points is not None:
        grade = book.find_grade(*where)
        grade.manual_score, grade.needs_manual_grade = row.points, False
    if row.comment:
        book.find_comment(*where).manual_comment = row.comment


def _read_grades(
    book: Gradebook, assignment: str, question: GradedQuestion
) -> dict[str, dict[str, Any]]:
    def chosen(query: Any) -> Any:
        return query.filter(
            Assignment.name == assignment, Notebook.name == question.notebook,
            BaseCell.name == question.grade_id,
        )  # fmt: skip

    found = {
        student: {"manual_score": points, "needs_manual_grade": bool(waits), "comment": ""}
        for student, _, _, points, waits in chosen(
            of_cells(book.db, Grade, Grade.manual_score, Grade.needs_manual_grade)
        )
    }
    for student, _, _, comment in chosen(of_cells(book.db, Comment, Comment.manual_comment)):
        if student in found:
            found[student]["comment"] = comment or ""
    return found


def _read_answer(
    gradebook: CourseGradebook, assignment: str, question: GradedQuestion, student: str
) -> str | None:
    """Return an answer as it stands in the graded copy, which formgrader shows; None if in none."""
    coursedir = gradebook.coursedir
    folder = coursedir.format_path(coursedir.autograded_directory, student, assignment)
    try:
        notebook = submission.read_notebook(Path(folder) / f"{question.notebook}.ipynb")
    except SubmissionError:
        return None
    cells = (c for c in notebook.cells if submission.grade_id(c) == question.grade_id)
    return next((str(cell.source) for cell in cells), None)


def _digest_state(text: str, row: Mapping[str, Any]) -> str:
    content = json.dumps([text, row["manual_score"], row["needs_manual_grade"], row["comment"]])
    return hashlib.sha256(content.encode()).hexdigest()[:12]


def _parse_marks(path: Path) -> _File:
    rows = csv.DictReader(
        io.StringIO(_read_content(path), newline=""), dialect=_guess_dialect(path)
    )
    missing = [name for name in COLUMNS if name not in (rows.fieldnames or ()) and name != "answer"]
    if missing:
        raise MarksError(
            f"{path.name} is no file of marks: it lacks the {_name_columns(missing)}. Make one "
            "with `autograder marks export`."
        )
    file = _File()
    faults: list[str] = []
    for row in rows:
        where = tuple(
            _without_apostrophe(row[name]) for name in ("assignment", "notebook", "question")
        )
        if not file.rows:
            file.assignment, file.notebook, file.grade_id = where
        elif where != (file.assignment, file.notebook, file.grade_id):
            faults.append(f"Line {rows.line_num} is of another question.")
        try:
            points = _parse_number(_without_apostrophe(row["points"]))
        except ValueError:
            faults.append(
                f"Line {rows.line_num}: '{_without_apostrophe(row['points'])[:40]}' is no number."
            )
            points = None
        comment = _without_apostrophe(row["comment"]).strip()
        file.rows.append(
            _Row(
                rows.line_num,
                _without_apostrophe(row["student"]),
                points,
                comment,
                _without_apostrophe(row["state"]),
            )
        )
    if faults:
        raise MarksError(f"Nothing of {path.name} was entered. {' '.join(faults[:MOST_FAULTS])}")
    if not file.rows:
        raise MarksError(f"{path.name} has no rows.")
    return file


def _read_content(path: Path) -> str:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise MarksError(f"{path.name} has more than {MAX_BYTES // 2**20} MB.")
        return path.read_text(encoding="utf-8-sig")
    except UnicodeError:
        raise MarksError(
            f"{path.name} is not UTF-8: save it as “CSV UTF-8” in the spreadsheet."
        ) from None
    except OSError as error:
        raise MarksError(f"{path} cannot be read ({error.strerror or error}).") from None


def _guess_dialect(path: Path) -> type[csv.Dialect]:
    head = _read_content(path).partition("\n")[0]

    class Dialect(csv.excel):
        """A spreadsheet in a language with decimal commas separates cells by semicolons."""

        delimiter = max(",;\t", key=head.count)

    return Dialect


def _parse_number(text: str) -> float | None:
    if not text.strip():
        return None
    number = float(text.strip().replace(",", "."))
    if not math.isfinite(number):
        raise ValueError(text)
    return number


def _without_apostrophe(text: str | None) -> str:
    """Return a cell without the apostrophe that kept a spreadsheet from running it."""
    text = text or ""
    return text[1:] if text.startswith("'") and is_formula(text[1:]) else text


def _find_faults(
    file: _File, grades: Mapping[str, Mapping[str, Any]], question: GradedQuestion
) -> Iterator[str]:
    seen: set[str] = set()
    for row in file.rows:
        if row.student not in grades:
            yield f"Line {row.line}: '{row.student[:60]}' has no answer to this question."
        elif row.student in seen:
            yield f"Line {row.line}: {row.student} comes twice."
        seen.add(row.student)
        if row.points is not None and not 0 <= row.points <= question.max_points:
            yield (
                f"Line {row.line}: {row.points:g} points for {row.student}, but there are 0 to "
                f"{question.max_points:g}."
            )


def _name_columns(names: list[str]) -> str:
    return f"column{'s' if len(names) > 1 else ''} {', '.join(names)}"
