"""What nbgrader runs in place of its own execution step: preprocessors for ``nbgrader autograde``.

`GradeByBehaviour` stands where nbgrader would execute the notebook in a kernel. It writes the
outputs of the subject's run into the cells and each exam's points into its grade cell, so that
nbgrader's own steps save, flag and report the scores as everyone knows them.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from nbformat import NotebookNode
from nbformat.v4 import new_output
from nbgrader.api import Gradebook
from nbgrader.coursedir import CourseDirectory
from nbgrader.preprocessors import NbGraderPreprocessor
from traitlets import Bool

from autograder import cells, submission
from autograder.insight import records
from autograder.report import Report
from autograder.verdict import Verdict

NOTES_KEY = "ros2_course_notes"
WORK_FOLDER = ".autograder"
"""Folder under the course root where the engine keeps outcomes and staged submissions."""

Resources = dict[str, Any]
Key = tuple[str, str, str]

prepared: dict[Key, Any] = {}
"""Outcomes that the engine already has, by (assignment, student, notebook)."""


class RestoreCells(NbGraderPreprocessor):  # type: ignore[misc]  # nbgrader ships no types
    """Put the instructor's cells right before anything else looks at a submission."""

    def preprocess(self, nb: NotebookNode, resources: Resources) -> tuple[NotebookNode, Resources]:
        """Mend ``nb`` against the source and the released notebook; remember what was mended."""
        source, released = originals(_coursedir(self), *_names(resources)[::2])
        # nbgrader has read it by itself: it must be what the engine would read.
        nb = submission.parse(json.dumps(nb), f"{_names(resources)[2]}.ipynb")
        nb, notes = submission.restore(nb, source, released)
        nb.metadata[NOTES_KEY] = notes
        return nb, resources


class GradeByBehaviour(NbGraderPreprocessor):  # type: ignore[misc]
    """Run the notebook in a subject, let the examiner watch, and write down what came of it."""

    trust_submissions = Bool(
        False, help="Run submissions outside of a sandbox, with your own rights."
    ).tag(config=True)

    def preprocess(self, nb: NotebookNode, resources: Resources) -> tuple[NotebookNode, Resources]:
        """Fill in the outputs of every code cell, and each exam's report and points."""
        from autograder import runner

        notes = list(nb.metadata.pop(NOTES_KEY, []))
        outcome = prepared.get(_names(resources)) or self._run(nb, resources)
        outcome = runner.with_notes(outcome, notes)
        code_cells = [cell for cell in nb.cells if cell.cell_type == "code"]
        for cell, outputs in zip(code_cells, outcome.outputs, strict=True):
            verdict = outcome.verdicts.get(submission.grade_id(cell))
            if verdict is None:
                cell.outputs = [new_output(**output) for output in outputs]  # type: ignore[no-untyped-call]
            else:
                # What stands here goes into the student's feedback: no hidden check, no key.
                cell.source = cells.without_hidden(cell.source)
                cell.outputs = _graded(verdict)
        resources["ros2_course_outcome"] = outcome
        resources["ros2_course_flags"] = [
            name
            for name, verdict in outcome.verdicts.items()
            if outcome.unreadable or verdict.needs_human
        ]
        return nb, resources

    def _run(self, nb: NotebookNode, resources: Resources) -> Any:
        from autograder import quiz_marks
        from autograder.store import OutcomeStore

        coursedir = _coursedir(self)
        assignment, student, _ = _names(resources)
        folder = coursedir.format_path(coursedir.submitted_directory, student, assignment)
        program, files = submission.program(nb), submission.extras(Path(folder))
        root = Path(coursedir.root)
        store = OutcomeStore(
            root / WORK_FOLDER / "outcomes", trust=self.trust_submissions, hidden=[root]
        )
        outcome = store.outcome(program, files)
        return quiz_marks.with_quizzes(outcome, nb, Path(folder), student, root)


class FlagForHumans(NbGraderPreprocessor):  # type: ignore[misc]
    """After the scores are saved: have a person look where the grader could not decide."""

    def preprocess(self, nb: NotebookNode, resources: Resources) -> tuple[NotebookNode, Resources]:
        """Mark the flagged grade cells as needing a manual grade; keep the verdicts of all."""
        assignment, student, notebook = _names(resources)
        if "ros2_course_outcome" in resources:
            work = Path(_coursedir(self).root) / WORK_FOLDER
            records.keep(work, assignment, student, notebook, resources["ros2_course_outcome"])
        flags = resources.get("ros2_course_flags", [])
        if flags:
            with Gradebook(resources["nbgrader"]["db_url"]) as gradebook:
                for name in flags:
                    grade = gradebook.find_grade(name, notebook, assignment, student)
                    grade.needs_manual_grade = True
                gradebook.db.commit()
        return nb, resources


def originals(
    coursedir: CourseDirectory, assignment: str, notebook: str
) -> tuple[NotebookNode, NotebookNode]:
    """Return the source and the released version of a notebook of an assignment."""
    folders = (coursedir.source_directory, coursedir.release_directory)
    source, released = (
        submission.read(Path(coursedir.format_path(folder, ".", assignment)) / f"{notebook}.ipynb")
        for folder in folders
    )
    return source, released


def _coursedir(preprocessor: NbGraderPreprocessor) -> CourseDirectory:
    return preprocessor.parent.parent.coursedir  # the exporter's parent is the converter


def _names(resources: Resources) -> Key:
    names = resources["nbgrader"]
    return names["assignment"], names["student"], names["notebook"]


def _graded(verdict: Verdict) -> list[NotebookNode]:
    report = Report(verdict, hints=3)
    shown = {"text/plain": repr(report), "text/html": report._repr_html_()}
    return [
        new_output("display_data", data=shown),  # type: ignore[no-untyped-call]
        new_output(  # type: ignore[no-untyped-call]
            "execute_result", data={"text/plain": repr(float(verdict.score))}, execution_count=None
        ),
    ]
