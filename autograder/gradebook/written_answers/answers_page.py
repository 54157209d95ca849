"""A page on which one question is marked for a whole class, beside its model answer.

It works from a file and without a network. Answers are text, never HTML; the one script is the
page's own, and a content security policy forbids every other one.
"""

from __future__ import annotations

import base64
import hashlib
import json
from html import escape
from pathlib import Path

from autograder.gradebook.written_answers.answers import COLUMNS, Answer, Answers
from course.messages.yaml_text import format_count
from quizzes.text import rendering

_STYLE = """
:root { color-scheme: light dark; }
body { font: 1rem/1.5 system-ui, sans-serif; max-width: 80rem; margin: 0 auto; padding: 1rem;
  display: grid; grid-template-columns: minmax(18rem, 2fr) 3fr; gap: 2rem; align-items: start; }
aside { position: sticky; top: 1rem; max-height: calc(100vh - 2rem); overflow: auto; }
h1 { font-size: 1.3rem; } h2 { font-size: 1rem; margin: 1rem 0 .2rem; }
.model { border-left: .3rem solid #009e73; padding-left: .8rem; }
article { border: 1px solid #8888; border-radius: .4rem; padding: .6rem .9rem; margin: 0 0 1rem; }
article.done { border-left: .3rem solid #009e73; }
article h2 { margin: 0; }
.answer { white-space: pre-wrap; overflow-wrap: anywhere; margin: .4rem 0 .6rem; font: inherit; }
.earlier { font-style: italic; }
textarea { width: 100%; box-sizing: border-box; font: inherit; }
input { width: 5rem; font: inherit; }
button { font: inherit; margin-right: .3rem; }
@media (max-width: 50rem) { body { display: block; } aside { position: static; } }
"""

_SCRIPT = """
'use strict';
const data = JSON.parse(document.getElementById('data').textContent);
const articles = [...document.querySelectorAll('article')];
const store = 'marks ' + data.key;
const saved = JSON.parse(localStorage.getItem(store) || '{}');
const fields = (article) => [article.querySelector('input'), article.querySelector('textarea')];
const right = (input) => input.value === '' ? !input.validity.badInput : input.validity.valid;
function show() {
  let done = 0;
  for (const article of articles) {
    const [points] = fields(article);
    const marked = points.value !== '' && right(points);
    article.classList.toggle('done', marked);
    done += marked;
  }
  document.getElementById('done').textContent = done + ' of ' + articles.length + ' marked';
}
function keep() {
  const now = {};
  articles.forEach((article, number) => {
    const [points, comment] = fields(article);
    now[data.rows[number].state] = [points.value, comment.value];
  });
  localStorage.setItem(store, JSON.stringify(now));
  show();
}
articles.forEach((article, number) => {
  const [points, comment] = fields(article);
  const before = saved[data.rows[number].state];
  if (before) [points.value, comment.value] = before;
  article.addEventListener('input', keep);
  article.addEventListener('click', (event) => {
    if (event.target.dataset.points === undefined) return;
    points.value = event.target.dataset.points;
    keep();
    points.focus();
  });
});
const formula = (text) => /^\\s*[=+\\-@\\t\\r\\n\\0\\uFF1D\\uFF0B\\uFF0D\\uFF20]/.test(text);
const cell = (text) => '"' + (formula(text) ? "'" + text : text).replaceAll('"', '""') + '"';
document.getElementById('save').addEventListener('click', () => {
  const wrong = articles.map((article) => fields(article)[0]).find((points) => !right(points));
  if (wrong) { wrong.reportValidity(); return; }
  const lines = [data.columns.map(cell).join(',')];
  articles.forEach((article, number) => {
    const [points, comment] = fields(article);
    const row = { ...data.common, ...data.rows[number],
      points: points.value, comment: comment.value };
    lines.push(data.columns.map((name) => cell(row[name])).join(','));
  });
  const link = document.createElement('a');
  const text = lines.join("\\r\\n") + "\\r\\n";
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = data.file;
  link.click();
});
show();
"""


def render_page(found: Answers, file: str) -> str:
    """Return the page; ``file`` is the name under which a browser saves the marks."""
    question = found.question
    title = f"{question.title}: {format_count(len(found.answers), 'answer')}"
    policy = (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src '{_script_digest(_SCRIPT)}'"
    )
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>\n"
        f"<body>{_render_aside(found, title, file)}<main>{_left_out(found)}"
        f"{''.join(_render_article(answer, question.max_points) for answer in found.answers)}"
        f'</main><script type="application/json" id="data">{_page_data(found, file)}</script>'
        f"<script>{_SCRIPT}</script></body></html>\n"
    )


def _render_aside(found: Answers, title: str, file: str) -> str:
    question = found.question
    parts = [
        f"<aside><h1>{escape(title)}</h1>",
        f"<p>{escape(found.assignment)}, {escape(question.notebook)}. "
        f"{format_count(found.waiting_count, 'answer')} waiting.</p>",
        _render_part("The question", question.text),
        _render_part("Model answer", question.model, "model"),
        _render_part("What students read about the points", question.rules),
        '<p><button type="button" id="save">Save the marks</button> <span id="done" role="status">'
        "</span></p>",
        f"<p>Saved as {escape(file)}; then run <code>autograder marks import</code> with it. "
        "What you have filled in stays in this browser until then.</p></aside>",
    ]
    return "".join(parts)


def _render_part(heading: str, markdown: str, kind: str = "") -> str:
    if not markdown:
        return ""
    return f'<h2>{heading}</h2><div class="{kind}">{_render_markdown(markdown)}</div>'


def _render_markdown(markdown: str) -> str:
    try:
        return rendering.render_block(
            markdown, Path("/nonexistent")
        )  # these texts have no pictures
    except rendering.RenderError:
        return f'<div class="answer">{escape(markdown)}</div>'


def _render_article(answer: Answer, most: float) -> str:
    shown = escape(answer.name)
    who = f"{shown} ({escape(answer.student)})" if answer.name != answer.student else shown
    points = "" if answer.waits or answer.points is None else f"{answer.points:g}"
    earlier = (
        f'<p class="earlier">Marked with {answer.points:g} before: to be looked at again.</p>'
        if answer.waits and answer.points is not None
        else ""
    )
    steps = "".join(
        f'<button type="button" tabindex="-1" data-points="{value:g}">{value:g}</button>'
        for value in (0.0, most / 2, most)
    )
    return (
        f'<article><h2>{who}</h2><div class="answer">{escape(answer.text)}</div>{earlier}'
        f'<p><label>Points <input type="number" min="0" max="{most:g}" step="any" '
        f'value="{points}"></label> of {most:g} {steps}</p>'
        f'<label>Comment <textarea rows="1">{escape(answer.comment)}</textarea></label></article>'
    )


def _left_out(found: Answers) -> str:
    said = []
    if found.empty:
        said.append(f"{format_count(len(found.empty), 'student')} left it empty and have 0 points.")
    if found.unread:
        said.append(f"It is not known what {escape(', '.join(found.unread))} handed in.")
    return f"<p>{' '.join(said)}</p>" if said else ""


def _page_data(found: Answers, file: str) -> str:
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
    data = {"file": file, "key": key, "columns": COLUMNS, "common": common, "rows": rows}
    # Inside of a script element nothing is escaped but what could end it.
    return json.dumps(data).replace("<", "\\u003c")


def _script_digest(script: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
