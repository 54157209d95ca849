"""``autograder marks``: one written question marked over a whole class."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from autograder.commands.options import AsJson, Root, use_root
from autograder.util.terminal import Terminal, visible_json

app = typer.Typer(
    help="Mark one written question over a whole class.", no_args_is_help=True,
    add_completion=False,
)  # fmt: skip
out = Terminal()


@app.command("export")
def export_marks(
    assignment: str,
    question: Annotated[
        str, typer.Argument(help="Its title, a part of it, or its grade id; all if left out.")
    ] = "",
    root: Root = None,
    as_json: AsJson = False,
) -> None:
    """Write the answers to a question, with its model answer: a page to mark on, and a CSV file.

    Both stand in reports/ASSIGNMENT. On the page, fill in points and comments and save them, or
    fill in the columns "points" and "comment" of the file in a spreadsheet; then run
    `autograder marks import FILE`. Without a question it lists which there are.
    """
    from autograder.gradebook.course_gradebook import CourseGradebook
    from autograder.gradebook.written_answers import answers, answers_page
    from autograder.util.work_files import write_whole

    gradebook = CourseGradebook(use_root(root))
    asked = (
        [answers.find_question(gradebook, assignment, question)]
        if question
        else answers.written_questions(gradebook, assignment)
    )
    found = [answers.collect_answers(gradebook, assignment, one) for one in asked]
    files: list[Path] = []
    folder = gradebook.root / "reports" / assignment
    if question:
        name = f"marks-{asked[0].grade_id}"
        files = [folder / f"{name}.html", folder / f"{name}.csv"]
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(files[0], answers_page.render_page(found[0], f"{name}.csv"))
        write_whole(files[1], answers.as_file(found[0]))
    if as_json:
        _print_json({
            "questions": [
                {"question": a.question.grade_id, "title": a.question.title,
                 "notebook": a.question.notebook, "answers": len(a.answers),
                 "waiting": a.waiting_count, "empty": len(a.empty)}
                for a in found
            ],
            "files": [str(path) for path in files],
        })  # fmt: skip
        return
    table = Table("Question", "Grade id", "Answers", "Waiting", "Empty")
    for a in found:
        counts = (str(len(a.answers)), str(a.waiting_count), str(len(a.empty)))
        table.add_row(a.question.title, a.question.grade_id, *counts)
    out.print(table)
    if files:
        out.print(f"Written: {', '.join(map(str, files))}", soft_wrap=True)


@app.command("import")
def import_marks(
    file: Annotated[Path, typer.Argument(help="A file of marks that was filled in.")],
    root: Root = None,
    as_json: AsJson = False,
) -> None:
    """Enter marks and comments into the gradebook; the next `autograder grade` tells the students.

    A file with a fault (points out of bounds, an unknown student) is not entered at all. A row
    whose answer or mark has changed since the export is left out and named.
    """
    from autograder.gradebook.course_gradebook import CourseGradebook
    from autograder.gradebook.written_answers import answers
    from course.messages.yaml_text import format_count

    entered = answers.enter_marks(CourseGradebook(use_root(root)), file)
    if as_json:
        _print_json(vars(entered))
    else:
        said = (
            f"{entered.question}: {format_count(len(entered.marked), 'mark')} entered, "
            f"{len(entered.already)} as they were, {len(entered.blank)} left blank."
        )
        out.print(said, soft_wrap=True)
        if entered.changed:
            who = ", ".join(entered.changed)
            out.print(
                "Not entered, because the answer or its mark has changed since the export: "
                f"{who}. Export the question again and mark these.",
                soft_wrap=True,
            )  # fmt: skip
    if entered.changed:
        raise typer.Exit(1)


def _print_json(data: Any) -> None:
    sys.stdout.write(visible_json(json.dumps(data, default=str, ensure_ascii=False)) + "\n")
