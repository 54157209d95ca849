"""A page on which one question is marked for a whole class, next to its model answer.

It works from a file and without a network. Answers are text, never HTML; the one script is the
page's own, and a content security policy forbids every other one.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from autograder.assignments.questions import GradedQuestion
from autograder.gradebook.written_answers.answers import COLUMNS, Answer, Answers
from course.messages.yaml_text import format_count
from quizzes.text import rendering
from quizzes.text.html_pages import fill_template

_TEMPLATE = Path(__file__).with_name("answers_page.html.jinja")
_SCRIPT = Path(__file__).with_name("answers_page.js")


@dataclass(frozen=True)
class AnswersPart:
    """Something about the question: HTML of its Markdown, or its ``text`` if there is none."""

    heading: str
    text: str
    rendered: Markup | None
    kind: str


@dataclass(frozen=True)
class Article:
    """A student's answer; the mark that stands, or an ``earlier`` one to be looked at again."""

    who: str
    text: str
    points: str
    earlier: str
    comment: str


def render_page(found: Answers, file: str) -> str:
    """Return the page; ``file`` is the name under which a browser saves the marks."""
    question, most = found.question, found.question.max_points
    return fill_template(
        _TEMPLATE,
        title=f"{question.title}: {format_count(len(found.answers), 'answer')}",
        script_digest=_script_digest(_SCRIPT.read_bytes()),
        assignment=found.assignment,
        question=question,
        waiting=format_count(found.waiting_count, "answer"),
        parts=list(_show_question(question)),
        file=file,
        left_out=list(_tell_left_out(found)),
        articles=[_show_answer(answer) for answer in found.answers],
        most=f"{most:g}",
        steps=[f"{value:g}" for value in (0.0, most / 2, most)],
        data=_page_data(found, file),
    )


def _show_question(question: GradedQuestion) -> Iterator[AnswersPart]:
    for heading, markdown, kind in (
        ("The question", question.text, ""),
        ("Model answer", question.model, "model"),
        ("What students read about the points", question.rules, ""),
    ):
        if markdown:
            yield AnswersPart(heading, markdown, _render_markdown(markdown), kind)


def _render_markdown(markdown: str) -> Markup | None:
    try:
        # These texts have no pictures.
        rendered = rendering.render_block(markdown, Path("/nonexistent"))
    except rendering.RenderError:
        return None
    return Markup(rendered)  # Markdown with HTML switched off: what looks like a tag is escaped


def _show_answer(answer: Answer) -> Article:
    who = answer.name
    if answer.name != answer.student:
        who = f"{answer.name} ({answer.student})"
    points = "" if answer.points is None else f"{answer.points:g}"
    standing, earlier = ("", points) if answer.waits else (points, "")
    return Article(who, answer.text, standing, earlier, answer.comment)


def _tell_left_out(found: Answers) -> Iterator[str]:
    if found.empty:
        yield f"{format_count(len(found.empty), 'student')} left it empty and have 0 points."
    if found.unread:
        yield f"It is not known what {', '.join(found.unread)} handed in."


def _page_data(found: Answers, file: str) -> dict[str, Any]:
    question = found.question
    common = {
        "assignment": found.assignment,
        "notebook": question.notebook,
        "question": question.grade_id,
    }
    rows = [
        {"student": a.student, "name": a.name, "answer": a.text, "state": a.state}
        for a in found.answers
    ]
    key = f"{found.assignment} {question.grade_id}"
    return {"file": file, "key": key, "columns": COLUMNS, "common": common, "rows": rows}


def _script_digest(script: bytes) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(script).digest()).decode()
