"""What of a class is compared: the program of each exercise, and each answer in words."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

from nbformat import NotebookNode

from autograder.assignments import questions, submission
from autograder.assignments.intake import roster
from autograder.assignments.intake.handed_files.attachments import files_beside
from autograder.assignments.questions import GradedQuestion
from autograder.assignments.submission import SubmissionError
from autograder.class_report.class_data import ClassData
from autograder.class_report.similarity import alike_pairs
from autograder.class_report.similarity.alike_pairs import Similarity
from autograder.class_report.similarity.own_text import MAX_CHARS, GivenText, OwnText

Texts = Mapping[str, Mapping[str, OwnText]]
"""{what is compared: {student: what they wrote of it}}."""

BESIDE = "The files beside the notebooks"


def texts_of(data: ClassData, given: GivenText) -> tuple[dict[str, dict[str, OwnText]], list[str]]:
    """Return what the students of a class wrote, and a note on those whose work cannot be read."""
    names = sorted({name for grade in data.grades for name in grade.cells})
    texts: defaultdict[str, dict[str, OwnText]] = defaultdict(dict)
    unread = []
    handed_out = files_beside(data.root / "release" / data.assignment).files
    for grade in data.grades:
        folder = roster.student_folder(data.root, grade.student) / data.assignment
        notebooks = {**_read_notebooks(folder, names), **_read_graded(data, grade.student)}
        if not notebooks:
            unread.append(grade.student)
            continue
        for name, notebook in notebooks.items():
            title = questions.title_of_notebook(name)
            texts[title][grade.student] = given.extract_own_text({name: notebook}, {})
            for question, answer in _find_answers(notebook, data.questions.get(name, {})):
                texts[answers_title(title, question)][grade.student] = answer
        files = files_beside(folder).files
        own = {name: content for name, content in files.items() if content != handed_out.get(name)}
        if (beside := given.extract_own_text({}, own)).lines:
            texts[BESIDE][grade.student] = beside
    if not unread:
        return dict(texts), []
    more = f" and {len(unread) - 10} more" if len(unread) > 10 else ""
    who = ", ".join(map(data.display_name, unread[:10]))
    return dict(texts), [f"Not compared, because no notebook can be read: {who}{more}."]


def compare_class(data: ClassData, texts: Texts, given: GivenText, threshold: float) -> Similarity:
    """Return which students' programs and answers are alike; see `alike_pairs`."""
    asked = {
        answers_title(questions.title_of_notebook(name), question): question
        for name, found in data.questions.items()
        for question in found.values()
    }
    programs = [where for where in texts if where not in asked]
    # The work grows with the square of what is compared at a time.
    work = int(alike_pairs.MOST_WORK / math.sqrt(max(1, len(programs))))
    return alike_pairs.merge_findings(
        alike_pairs.alike_in_words(found, _given_text(asked[where]), threshold, where)
        if where in asked
        else alike_pairs.compare_programs(found, given, threshold, where, work)
        for where, found in texts.items()
    )


def answers_title(title: str, question: GradedQuestion) -> str:
    """Return what the answers to a question of an exercise are called."""
    return f"{title}: {question.title}"


def _given_text(question: GradedQuestion) -> str:
    return "\n".join((question.text, question.rules, question.model, question.stub))


def _read_notebooks(folder: Path, names: list[str]) -> dict[str, NotebookNode]:
    notebooks = {}
    for name in names:
        try:
            notebooks[name] = submission.read_notebook(folder / f"{name}.ipynb")
        except SubmissionError:
            continue  # "what needs a person" names it, and why it cannot be read
    return notebooks


def _read_graded(data: ClassData, student: str) -> dict[str, NotebookNode]:
    """Return what was graded, under whichever name it was handed in.

    Its cells are recognised: one that came without metadata says there which it is.
    """
    records = data.records.get(student, {})
    read = [name for name, record in records.items() if not record.unreadable]
    return _read_notebooks(data.root / "autograded" / student / data.assignment, read)


def _find_answers(
    notebook: NotebookNode, asked: Mapping[str, GradedQuestion]
) -> list[tuple[GradedQuestion, OwnText]]:
    found = []
    for cell in notebook.cells:
        question = asked.get(submission.grade_id(cell))
        if question and question.written and cell.cell_type == "markdown":
            source = str(cell.source)
            lines = tuple(source[:MAX_CHARS].splitlines())
            found.append((question, OwnText(lines, len(source) > MAX_CHARS)))
    return found
