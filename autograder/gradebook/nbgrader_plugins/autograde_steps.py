"""What nbgrader runs in place of its own steps: an exporter and preprocessors for its autograding.

`GradeByBehaviour` stands where nbgrader would execute the notebook in a kernel. It writes the
outputs of the subject's run into the cells and each exam's points into its grade cell, so that
nbgrader's own steps save, flag and report the scores as everyone knows them. `SubmissionExporter`
reads the notebooks: one that cannot be read is entered with the reason, too.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from nbconvert.exporters import NotebookExporter
from nbformat import NotebookNode
from nbformat.v4 import new_output
from nbgrader.api import Gradebook, MissingEntry
from nbgrader.coursedir import CourseDirectory
from nbgrader.preprocessors import NbGraderPreprocessor
from nbgrader.utils import parse_utc
from traitlets import Bool

from autograder.assignments import cells, submission
from autograder.assignments.intake import nbgrader_commands, open_questions, roster
from autograder.assignments.intake.handed_files.attachments import files_beside
from autograder.assignments.intake.notebook_search import Intake, UnclearError
from autograder.assignments.intake.recognition import cell_matching
from autograder.assignments.submission import SubmissionError
from autograder.examination.subject import outputs
from autograder.examination.verdict import Verdict
from autograder.examination.verdict_text import Report
from autograder.gradebook import verdict_records
from autograder.gradebook.safe_html import allowed_html
from autograder.gradebook.safe_html.page_texts import Page
from autograder.gradebook.waiting_extensions import WaitingExtensions
from autograder.util import exercise_folders
from course.errors import CourseError

NOTES_KEY = "ros2_course_notes"
UNREADABLE_KEY = "ros2_course_unreadable"
ASKED_KEY = "ros2_course_asked"
"""Metadata that the first steps leave for the later ones: remarks, why there is no more, and what a
person is asked: {grade id: why}."""

FOUND_KEY = "ros2_course_found"
ATTACHMENTS_KEY = "ros2_course_attachments"
UNCLEAR_KEY = "ros2_course_unclear"
"""Resources that the exporter leaves for the first step: which file it is, or what is not clear."""

WORK_FOLDER = ".autograder"
"""Folder under the course root where the engine keeps outcomes and staged submissions."""


class NotReadyError(CourseError):
    """An assignment that cannot be graded as it stands; the message says what to do."""


Resources = dict[str, Any]
Key = tuple[str, str, str]

prepared: dict[Key, Any] = {}
"""Outcomes that the engine already has, by (assignment, student, notebook)."""


class SubmissionExporter(NotebookExporter):
    """Reads a submitted notebook as the engine does, whatever a stranger has put in its place."""

    def from_filename(
        self, filename: str, resources: Resources | None = None, **more: Any
    ) -> tuple[NotebookNode, Resources]:
        """Return the notebook at ``filename``; the released one, with why, if it is unreadable."""
        resources = resources or {}
        converter: Any = self.parent
        exercise_folders.use_course(Path(converter.coursedir.root))
        coursedir, (assignment, student, name) = converter.coursedir, _submission_key(resources)
        folder = nbgrader_commands.submitted_folder(coursedir, assignment, student)
        try:
            if Path(filename).parent == folder:
                intake = _make_intake(coursedir, assignment, student)
                found = intake.find_notebook(name)
                notebook = found.notebook
                resources[FOUND_KEY] = found
                if found.item is not None:
                    resources[ATTACHMENTS_KEY] = intake.find_attachments(found)
            else:  # nbgrader reads a second time what it has written itself
                notebook = submission.read_notebook(Path(filename))
        except SubmissionError as error:
            _, notebook = read_originals(coursedir, assignment, name)
            resources[UNREADABLE_KEY] = str(error)
            if isinstance(error, UnclearError):
                resources[UNCLEAR_KEY] = f"{error} {error.suggestion}"
        return self.from_notebook_node(notebook, resources, **more)  # type: ignore[no-untyped-call,no-any-return]


class RestoreCells(NbGraderPreprocessor):  # type: ignore[misc]  # nbgrader ships no types
    """Put the instructor's cells right before anything else looks at a submission."""

    def preprocess(self, nb: NotebookNode, resources: Resources) -> tuple[NotebookNode, Resources]:
        """Mend ``nb`` against the source and the released notebook; remember what was mended."""
        from autograder.gradebook.quizzes import quiz_marks

        coursedir, (assignment, student, notebook) = (
            _course_directory(self),
            _submission_key(resources),
        )
        source, released = read_originals(coursedir, assignment, notebook)
        known = cell_matching.recognise_cells(nb, released)
        nb, notes = submission.restore_cells(nb, source, released)
        found = resources.pop(FOUND_KEY, None)
        doubts = {} if found is not None and found.claimed else known.doubts
        before = found.notes if found is not None else ()
        notes = [*before, *known.notes, *dict.fromkeys(doubts.values()), *notes]
        for name, why in doubts.items():
            ask_about_cells(nb, why, [name])
        if UNCLEAR_KEY in resources:
            ask_about_cells(nb, resources.pop(UNCLEAR_KEY), graded_cells(nb))
        folder, root = (
            nbgrader_commands.submitted_folder(coursedir, assignment, student),
            Path(coursedir.root),
        )
        class_ = nbgrader_commands.known_students(coursedir)
        quizzes = quiz_marks.quiz_questions(nb, folder, student, root, class_)
        for name, (why, command) in quizzes.items():
            ask_about_cells(nb, f"{why} Say it with `{command}`.", [name])
        allowed_html.screen_texts(nb, released, Page())
        # The grading steps read what is written here: nothing of a submission's own metadata is.
        nb.metadata[NOTES_KEY] = notes
        if UNREADABLE_KEY in resources:
            nb.metadata[UNREADABLE_KEY] = resources[UNREADABLE_KEY]
        return nb, resources


class GradeByBehaviour(NbGraderPreprocessor):  # type: ignore[misc]
    """Run the notebook in a subject, let the examiner watch, and write down what came of it."""

    trust_submissions = Bool(
        False, help="Run submissions outside of a sandbox, with your own rights."
    ).tag(config=True)

    def preprocess(self, nb: NotebookNode, resources: Resources) -> tuple[NotebookNode, Resources]:
        """Fill in the outputs of every code cell, and each exam's report and points."""
        from autograder.running import runner

        notes = list(nb.metadata.pop(NOTES_KEY, []))
        asked = dict(nb.metadata.pop(ASKED_KEY, {}))
        unreadable = str(nb.metadata.pop(UNREADABLE_KEY, ""))
        outcome = prepared.get(_submission_key(resources)) or self._compute_outcome(
            nb, resources, unreadable
        )
        outcome = runner.with_notes(outcome, notes)
        texts = Page()
        code_cells = [cell for cell in nb.cells if cell.cell_type == "code"]
        for cell, shown in zip(code_cells, outcome.outputs, strict=True):
            verdict = outcome.verdicts.get(submission.grade_id(cell))
            if verdict is None:
                shown = outputs.of_test(
                    shown, float(submission.nbgrader_metadata(cell).get("points") or 0)
                )
                cell.outputs = [
                    new_output(**allowed_html.screen_output(output, texts))  # type: ignore[no-untyped-call]
                    for output in shown
                ]
            else:
                # What stands here goes into the student's feedback: no hidden check, no key.
                cell.source = cells.without_hidden(cell.source)
                cell.outputs = _verdict_outputs(verdict)
        resources["ros2_course_outcome"] = outcome
        if outcome.unreadable:  # nobody knows what it is worth, nor whether answers are empty
            asked = {**dict.fromkeys(graded_cells(nb), " ".join(outcome.notes)), **asked}
        flags = [name for name, verdict in outcome.verdicts.items() if verdict.needs_human]
        resources["ros2_course_flags"] = [*dict.fromkeys([*asked, *flags])]
        resources[ASKED_KEY] = asked
        return nb, resources

    def _compute_outcome(self, nb: NotebookNode, resources: Resources, unreadable: str) -> Any:
        """Return what comes of a notebook that the engine has not run before."""
        from autograder.gradebook.quizzes import quiz_marks
        from autograder.running import runner
        from autograder.running.outcomes.outcome_store import OutcomeStore

        coursedir = _course_directory(self)
        exercise_folders.use_course(Path(coursedir.root))
        assignment, student, _ = _submission_key(resources)
        folder = Path(coursedir.format_path(coursedir.submitted_directory, student, assignment))
        root = Path(coursedir.root)
        program = submission.extract_program(nb)
        if unreadable:
            outcome = runner.refused_outcome(program, unreadable)
        else:
            attachments = resources.pop(ATTACHMENTS_KEY, None) or files_beside(folder)
            store = OutcomeStore(root / WORK_FOLDER, trust=self.trust_submissions, hidden=[root])
            outcome = runner.with_notes(
                store.get_or_run(program, attachments.files), attachments.notes
            )
        class_ = nbgrader_commands.known_students(coursedir)
        return quiz_marks.with_quizzes(outcome, nb, folder, student, root, class_)


class FlagForHumans(NbGraderPreprocessor):  # type: ignore[misc]
    """After the scores are saved: have a person look where the grader could not decide."""

    def preprocess(self, nb: NotebookNode, resources: Resources) -> tuple[NotebookNode, Resources]:
        """Mark the flagged grade cells as needing a manual grade; keep the verdicts of all.

        The penalty for lateness is next: an extension that waits for this submission is granted.
        """
        assignment, student, notebook = _submission_key(resources)
        waiting = WaitingExtensions(Path(_course_directory(self).root) / WORK_FOLDER, assignment)
        if hours := waiting.hours_for(student):
            with Gradebook(resources["nbgrader"]["db_url"]) as gradebook:
                gradebook.grant_extension(assignment, student, hours=hours)
            waiting.set_hours(student, 0)  # it is in the gradebook from now on
        if "ros2_course_outcome" in resources:
            work = Path(_course_directory(self).root) / WORK_FOLDER
            verdict_records.write_record(
                work, assignment, student, notebook, resources["ros2_course_outcome"]
            )
            asked = resources[ASKED_KEY]
            why = " ".join(dict.fromkeys(asked.values()))
            question = open_questions.OpenQuestion(why, tuple(asked)) if asked else None
            open_questions.keep_question(work, assignment, student, notebook, question)
        self._correct_time(resources)
        self._ask_about_missing(resources)
        flags = resources.get("ros2_course_flags", [])
        if flags:
            with Gradebook(resources["nbgrader"]["db_url"]) as gradebook:
                for name in flags:
                    grade = gradebook.find_grade(name, notebook, assignment, student)
                    grade.needs_manual_grade = True
                    with suppress(MissingEntry):  # nbgrader takes it for an answer left empty
                        comment = gradebook.find_comment(name, notebook, assignment, student)
                        comment.auto_comment = None
                gradebook.db.commit()
        return nb, resources

    def _ask_about_missing(self, resources: Resources) -> None:
        """Ask about what nbgrader has not found under its own name, and given zero points."""
        assignment, student, _ = _submission_key(resources)
        coursedir = _course_directory(self)
        folder = nbgrader_commands.submitted_folder(coursedir, assignment, student)
        gone = nbgrader_commands.missing_notebooks(folder, _notebook_names(coursedir, assignment))
        if gone:
            work = Path(coursedir.root) / WORK_FOLDER
            intake = _make_intake(coursedir, assignment, student)
            with Gradebook(resources["nbgrader"]["db_url"]) as gradebook:
                nbgrader_commands.ask_about(gradebook, intake, gone, assignment, student, work)

    def _correct_time(self, resources: Resources) -> None:
        """Have lateness counted from the time that was meant: nbgrader misreads some zones."""
        assignment, student, _ = _submission_key(resources)
        coursedir = _course_directory(self)
        folder = coursedir.format_path(coursedir.submitted_directory, student, assignment)
        file = Path(folder) / "timestamp.txt"
        if not file.exists():
            return
        zone = str(self.config.Exchange.get("timezone", ""))
        time = roster.read_timestamp(file, zone)
        with Gradebook(resources["nbgrader"]["db_url"]) as gradebook:
            submitted = gradebook.find_submission(assignment, student)
            submitted.timestamp = parse_utc(time)
            gradebook.db.commit()


def ask_about_cells(notebook: NotebookNode, why: str, cells_: Iterable[str]) -> None:
    """Have a person asked about grade cells of a notebook: they wait for points by hand."""
    asked = dict(notebook.metadata.get(ASKED_KEY, {}))
    for name in cells_:
        asked[name] = why
    notebook.metadata[ASKED_KEY] = asked


def graded_cells(notebook: NotebookNode) -> list[str]:
    """Return the grade ids of the cells of a restored notebook that earn points."""
    return [
        submission.grade_id(c)
        for c in notebook.cells
        if submission.nbgrader_metadata(c).get("grade")
    ]


def read_originals(
    coursedir: CourseDirectory, assignment: str, notebook: str
) -> tuple[NotebookNode, NotebookNode]:
    """Return the source and the released version of a notebook of an assignment.

    Raises:
        NotReadyError: one of them is missing or damaged: no submission is to blame.
    """
    source = _read_original(coursedir, coursedir.source_directory, assignment, notebook)
    return source, _read_original(coursedir, coursedir.release_directory, assignment, notebook)


def _read_original(
    coursedir: CourseDirectory, step: str, assignment: str, notebook: str
) -> NotebookNode:
    path = Path(coursedir.format_path(step, ".", assignment)) / f"{notebook}.ipynb"
    if step == coursedir.source_directory:
        return read_source(path)
    return _read_instructor_notebook(path, f"autograder release {assignment}")


def read_source(path: Path) -> NotebookNode:
    """Return a notebook of an assignment's source; raises as `read_originals`."""
    return _read_instructor_notebook(path, "autograder build")


def _read_instructor_notebook(path: Path, command: str) -> NotebookNode:
    """Return a notebook of the instructor's, which a ``command`` makes again."""
    try:
        return submission.read_notebook(path)
    except SubmissionError:
        wrong = "damaged" if path.exists() else "missing"
        raise NotReadyError(
            f"The instructor's {path} is {wrong}, so nothing can be graded: make it again with "
            f"`{command}`, then grade."
        ) from None


def _notebook_names(coursedir: CourseDirectory, assignment: str) -> list[str]:
    folder = Path(coursedir.format_path(coursedir.source_directory, ".", assignment))
    return sorted(path.stem for path in folder.glob("*.ipynb"))


def _make_intake(coursedir: CourseDirectory, assignment: str, student: str) -> Intake:
    names = _notebook_names(coursedir, assignment)
    released = {name: read_originals(coursedir, assignment, name)[1] for name in names}
    return nbgrader_commands.look_into(coursedir, assignment, student, released)


def _course_directory(preprocessor: NbGraderPreprocessor) -> CourseDirectory:
    return preprocessor.parent.parent.coursedir  # the exporter's parent is the converter


def _submission_key(resources: Resources) -> Key:
    names = resources["nbgrader"]
    return names["assignment"], names["student"], names["notebook"]


def _verdict_outputs(verdict: Verdict) -> list[NotebookNode]:
    report = Report(verdict, hints=3)
    shown = {"text/plain": repr(report), "text/html": report._repr_html_()}
    return [
        new_output("display_data", data=shown),  # type: ignore[no-untyped-call]
        new_output(  # type: ignore[no-untyped-call]
            "execute_result", data={"text/plain": repr(float(verdict.score))}, execution_count=None
        ),
    ]
