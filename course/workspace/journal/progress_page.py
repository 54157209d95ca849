"""Progress as a page: Markdown, which JupyterLab draws in its own theme, and the same as text."""

from __future__ import annotations

import datetime
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from urllib.parse import quote

from course.workspace.journal.student_notebooks import StudentNotebook
from course.workspace.journal.time_needed import format_minutes
from course.workspace.journal.work import Chapter, ExerciseWork, QuizTaken, WorkDone

NAMED = 4
"""Sections or checks that are named; of more, the number is given."""

_SPECIAL = re.compile(r"([\\`*_{}\[\]<>#|~$!&])")

Row = tuple[str, ...]


def render_markdown(progress: WorkDone, start: Path) -> str:
    """Return the page as Markdown, with links to the notebooks relative to the folder ``start``."""
    parts = [f"**{_escape_markdown(_format_headline(progress))}**"]
    if todo := _next_step(progress):
        notebook, what = todo
        parts.append(
            f"**Next:** {_notebook_link(progress, notebook, start)}: {_escape_markdown(what)}."
        )
    for head, rows in _progress_tables(progress):
        lines = [head, tuple("---" for _ in head)]
        for notebook, row in rows:
            lines.append((_notebook_link(progress, notebook, start), *map(_escape_markdown, row)))
        parts.append("\n".join(f"| {' | '.join(line)} |" for line in lines))
    parts += [f"**Note:** {_escape_markdown(notice)}" for notice in progress.notices]
    if hand_in := _format_hand_in(progress):
        parts.append(f"**To hand in:** {_escape_markdown(hand_in)}")
    parts.append(_escape_markdown(_format_foot(progress)))
    return "\n\n".join(parts)


def render_text(progress: WorkDone) -> str:
    """Return the page as plain text."""
    lines = [_format_headline(progress)]
    if todo := _next_step(progress):
        notebook, what = todo
        lines.append(f"Next: {notebook.path}: {what}.")
    for head, rows in _progress_tables(progress):
        for notebook, row in rows:
            lines += ["", f"{head[0]}: {notebook.title} ({notebook.path})"]
            lines += [f"  {name}: {value}" for name, value in zip(head[1:], row, strict=True)]
    lines += ["", *(f"Note: {notice}" for notice in progress.notices)]
    if hand_in := _format_hand_in(progress):
        lines.append(f"To hand in: {hand_in}")
    lines.append(_format_foot(progress))
    return "\n".join(lines)


def _format_headline(progress: WorkDone) -> str:
    parts = []
    if progress.chapters:
        done, total = (sum(getattr(c, n) for c in progress.chapters) for n in ("done", "total"))
        parts.append(f"{done} of {total} cells of the chapters run")
    if progress.exercises:
        done = sum(exercise.is_done for exercise in progress.exercises)
        parts.append(f"{done} of {len(progress.exercises)} exercises ready to hand in")
    if progress.quizzes:
        done = sum(quiz.is_passed for quiz in progress.quizzes)
        several = f"{done} of {len(progress.quizzes)} quizzes passed"
        one = "the quiz passed" if done else "the quiz not passed yet"
        parts.append(several if len(progress.quizzes) > 1 else one)
    return (", ".join(parts) or "There are no notebooks of the course here") + "."


def _next_step(progress: WorkDone) -> tuple[StudentNotebook, str] | None:
    """Return the notebook to go on with and what to do there; None if all is done."""
    for chapter in progress.chapters:
        if chapter.unfinished_sections:
            return chapter.notebook, f"go on at “{chapter.unfinished_sections[0].title}”"
    for exercise in progress.exercises:
        if exercise.checked is None:
            return exercise.notebook, "do the task, then run its check cell"
        if exercise.checked.open:
            return exercise.notebook, f"“{exercise.checked.open[0]}” is still open"
        if exercise.notebook.written < exercise.notebook.to_write:
            return exercise.notebook, "write the explanations, and save"
    for quiz in progress.quizzes:
        if not quiz.is_passed:
            return quiz.notebook, "take the quiz"
    return None


def _progress_tables(progress: WorkDone) -> Iterator[tuple[Row, list[tuple[StudentNotebook, Row]]]]:
    if progress.chapters:
        head: Row = ("Chapter", "Takes about", "Cells run", "Still to run")
        yield head, [(chapter.notebook, _chapter_row(chapter)) for chapter in progress.chapters]
    if progress.exercises:
        head = ("Exercise", "Takes about", "Visible checks", "Still open", "Explanations")
        yield head, [(e.notebook, _exercise_row(e, progress.moment)) for e in progress.exercises]
    if progress.quizzes:
        head = ("Quiz", "Takes about", "Passed", "Best attempt", "Attempts")
        yield head, [(quiz.notebook, _quiz_row(quiz)) for quiz in progress.quizzes]


def _chapter_row(chapter: Chapter) -> Row:
    left = _list_titles(section.title for section in chapter.unfinished_sections)
    takes = format_minutes(chapter.notebook.minutes)
    return takes, f"{chapter.done} of {chapter.total}", left


def _exercise_row(exercise: ExerciseWork, now: datetime.datetime) -> Row:
    written, to_write = exercise.notebook.written, exercise.notebook.to_write
    explanations = f"{written} of {to_write} written" if to_write else "none asked for"
    found = exercise.checked
    takes = format_minutes(exercise.notebook.minutes)
    if found is None:
        return takes, "not checked yet", "all", explanations
    moment = _format_moment(found.when, now)
    last = f"at best; {found.score:g} last, {moment}" if found.best > found.score else moment
    points = f"{found.best:g} of {found.max_score:g} points ({last})"
    return takes, points, _list_titles(found.open), explanations


def _quiz_row(quiz: QuizTaken) -> Row:
    best = quiz.best_attempt
    score = f"{best.score:g} of {len(best.answers)}" if best else "none yet"
    takes = format_minutes(quiz.notebook.minutes)
    return takes, "yes" if quiz.is_passed else "not yet", score, str(len(quiz.attempts))


def _list_titles(titles: Iterable[str]) -> str:
    names = [title.rstrip(".") for title in titles]
    more = f"; and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return "; ".join(names[:NAMED]) + more or "nothing"


def _format_moment(stamp: str, now: datetime.datetime) -> str:
    moment = datetime.datetime.fromisoformat(stamp).astimezone(now.tzinfo)
    if moment.date() == now.date():
        return f"today, {moment:%H:%M}"
    return f"{moment.day} {moment:%b %Y, %H:%M}"


def _format_hand_in(progress: WorkDone) -> str:
    """Return which folders a student hands in, and how; empty if there is nothing to hand in."""
    parts: list[StudentNotebook] = [exercise.notebook for exercise in progress.exercises]
    parts += [quiz.notebook for quiz in progress.quizzes]
    folders = sorted({notebook.path.parent.as_posix() for notebook in parts})
    if not folders:
        return ""
    named = " and ".join([", ".join(folders[:-1]), folders[-1]] if folders[1:] else folders)
    return (
        f"save your notebooks, and give your instructor all files of {named}, each folder as it is "
        "(a quiz's answers are in its .attempts.jsonl file), in the way that they have named."
    )


def _format_foot(progress: WorkDone) -> str:
    return (
        f"As of {progress.moment.day} {progress.moment:%b %Y, %H:%M}, from your saved notebooks "
        "and the files beside them. Nothing of it leaves this machine. The visible checks are not "
        "your grade: hidden checks and the explanations are graded when you hand in. Run this cell "
        "again to see what has changed."
    )


def _notebook_link(progress: WorkDone, notebook: StudentNotebook, start: Path) -> str:
    address = quote(os.path.relpath(progress.folder / notebook.path, start))
    return f"[{_escape_markdown(notebook.title)}]({address})"


def _escape_markdown(value: str) -> str:
    """Return text that Markdown shows as it is, on one line of a table."""
    return _SPECIAL.sub(r"\\\1", " ".join(value.split()))
