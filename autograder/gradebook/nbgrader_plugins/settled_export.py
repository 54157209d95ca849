"""What ``nbgrader export`` writes: no score for a student about whom a person is to be asked.

nbgrader's own plugin writes a number for everybody, and zero for students of whom it has nothing.
While it is not clear what a student handed in, or while it lies where nobody looks for it, that
number must not be passed on: such a student has no row of that assignment. All others have
nbgrader's row.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nbgrader.api import Gradebook, MissingEntry
from nbgrader.plugins import CsvExportPlugin

from autograder.assignments.intake import open_questions, roster
from autograder.assignments.intake.handed_files.file_names import join_names, normalise_name
from autograder.assignments.intake.roster import Roster
from autograder.gradebook.nbgrader_plugins.autograde_steps import WORK_FOLDER


class SettledExport(CsvExportPlugin):  # type: ignore[misc]  # nbgrader ships no types
    """nbgrader's CSV file, without the scores that nobody can rely on."""

    def export(self, gradebook: Gradebook) -> None:
        """Write the file, and say who is left out."""
        root = Path(self.parent.coursedir.root)
        open_ = {
            a.name: _unsettled_students(gradebook, root, a.name) for a in gradebook.assignments
        }
        super().export(_Settled(gradebook, open_))
        for assignment, students in open_.items():
            if students:
                self.log.warning(
                    "Left out of %s: %s, of whom it is not clear what was handed in. "
                    "`autograder grade %s` says what to do.",
                    assignment, join_names(sorted(students)), assignment,
                )  # fmt: skip


class _Settled:
    """A gradebook as the export goes through it: at each assignment only those who are settled."""

    def __init__(self, gradebook: Gradebook, open_: dict[str, set[str]]) -> None:
        self._gradebook = gradebook
        self._open = open_
        self._left_out: set[str] = set()

    @property
    def assignments(self) -> Iterator[Any]:
        for assignment in self._gradebook.assignments:
            self._left_out = self._open[assignment.name]
            yield assignment

    @property
    def students(self) -> list[Any]:
        return [s for s in self._gradebook.students if normalise_name(s.id) not in self._left_out]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gradebook, name)


def _unsettled_students(gradebook: Gradebook, root: Path, assignment: str) -> set[str]:
    """Return the students of whom it is not clear what they handed in for an assignment."""
    found = set()
    for student, questions in open_questions.of_assignment(root / WORK_FOLDER, assignment).items():
        try:
            submission = gradebook.find_submission(assignment, student)
        except MissingEntry:
            continue
        waiting = {
            notebook.name: [
                grade.name for grade in notebook.grades
                if grade.needs_manual_grade and grade.manual_score is None
            ]
            for notebook in submission.notebooks
        }  # fmt: skip
        if open_questions.open_ones(questions, waiting):
            found.add(student)
    names = [each.name for each in gradebook.assignments]
    _, misplaced = roster.find_submissions(root, assignment, Roster(), names)
    return set(map(normalise_name, found | misplaced.keys()))
