"""Submissions that want to act in the instructor's browser: an answer that gives itself full marks.

They are graded for real, and shown by the real formgrader in a real browser. At the end the same
script is run in the same page, and does give the marks: so it would have, had it run before.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_raw_cell
from nbgrader.api import Gradebook
from playwright.sync_api import Browser, BrowserContext, Page, expect

from autograder import corpus
from autograder.assignments import submission
from autograder.assignments.build_notebooks import build
from autograder.corpus.trials import one_notebook
from autograder.examination import points
from autograder.gradebook.release import make_release
from autograder.grading import engine
from tests.machine import needs_sandbox

from .lab import Lab, until

pytestmark = [
    pytest.mark.timeout(900), pytest.mark.xdist_group("browser: grading"),
    needs_sandbox,
]  # fmt: skip

ASSIGNMENT, NOTEBOOK = "ch05", "qos-design"
EXPLANATIONS = list(points.table()["qos"].manual)

GIVE_FULL_MARKS = """
window.taken = true;
fetch(`${base_url}/api/grades?submission_id=${submission_id}`).then((r) => r.json()).then((all) =>
  all.forEach((grade) => fetch(`${base_url}/api/grade/${grade.id}`, {
    method: 'PUT', headers: {'Content-Type': 'application/json'},
    body: JSON.stringify({...grade, manual_score: grade.max_score}),
  })));
"""
RUN = f"eval(atob('{base64.b64encode(GIVE_FULL_MARKS.encode()).decode()}'))"
DRAWING = f'<svg xmlns="http://www.w3.org/2000/svg" onload="{RUN}"><script>{RUN}</script></svg>'

ASKS = '<img src="/logout?asked"><img src="https://example.org/asked.png">'
"""It ends the instructor's session, and tells a stranger of it: if a page asks for it by itself."""

ANSWERS = [
    f"<script>{RUN}</script>\n\nbecause of *the depth* {ASKS}",
    f'<img src="none.png" onerror="{RUN}"> [click](javascript:{RUN}) ![a](/logout?asked)',
    f"```mermaid\n<img src=x onerror=\"{RUN}\">\n```\n\n<b onmouseover=\"{RUN}\">here</b>",
    f"<svg onload=\"{RUN}\"></svg><details open ontoggle=\"{RUN}\">x</details> [c](evil.html)",
    f"<iframe srcdoc=\"<script>parent.{RUN}</script>\"></iframe><div>\n\n# {EXPLANATIONS[0]}",
]  # fmt: skip
SHOWN = f"""
from IPython.display import HTML, SVG, Javascript, Latex, Markdown, display
run = {RUN!r}
display(HTML({ASKS!r}), Markdown("![a](/logout?asked)"))
for kind in (HTML, Markdown, Latex):
    display(kind('<script>' + run + '</script><img src=x onerror="' + run + '">'))
display(Javascript(run))
display(SVG({DRAWING!r}))
display({{'text/vnd.mermaid': '<img src=x onerror="' + run + '">', 'text/plain': 'x'}}, raw=True)
display(HTML('<table><tr><td>kept</td></tr></table><math><mi>k</mi></math>'))
"""


@pytest.fixture(scope="module")
def course_root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A graded course with one submission, whose every part wants to run in a browser."""
    root = one_notebook(tmp_path_factory.mktemp("hostile") / "course", "qos", ASSIGNMENT)
    build(root)
    make_release(root, ASSIGNMENT)
    source, released = (
        submission.read_notebook(root / step / ASSIGNMENT / f"{NOTEBOOK}.ipynb")
        for step in ("source", "release")
    )
    case = next(c for c in corpus.load_cases("qos") if c.name == "broken-empty")
    notebook = case.make_submission(source, released)
    cells = {submission.grade_id(cell): cell for cell in notebook.cells}
    for number, name in enumerate(EXPLANATIONS):
        cells[name].source = ANSWERS[number % len(ANSWERS)]
    notebook.cells[1:1] = [
        new_code_cell(SHOWN), new_raw_cell(f"<script>{RUN}</script>"),
        *map(new_markdown_cell, ANSWERS),
    ]  # fmt: skip
    folder = root / "submitted" / "eve" / ASSIGNMENT
    folder.mkdir(parents=True)
    nbformat.write(notebook, folder / f"{NOTEBOOK}.ipynb")
    (folder / "evil.html").write_text(f"<script>opener.{RUN}</script>")
    (folder / "evil.svg").write_text(DRAWING)
    engine.grade(root, ASSIGNMENT)
    return root


@pytest.fixture
def window(course_root: Path, tmp_path: Path, browser: Browser) -> Iterator[tuple[Lab, Page]]:
    with Lab(tmp_path, course_root) as lab:
        context: BrowserContext = browser.new_context(viewport={"width": 1280, "height": 900})
        yield lab, context.new_page()
        context.close()


def marks(root: Path) -> dict[str, float | None]:
    with Gradebook(f"sqlite:///{root / 'gradebook.db'}") as book:
        handed_in = book.find_submission_notebook(NOTEBOOK, ASSIGNMENT, "eve")
        return {grade.name: grade.manual_score for grade in handed_in.grades}


def test_no_submission_gives_itself_marks_in_the_formgrader(
    window: tuple[Lab, Page], course_root: Path
) -> None:
    lab, page = window
    with Gradebook(f"sqlite:///{course_root / 'gradebook.db'}") as book:
        which = book.find_submission_notebook(NOTEBOOK, ASSIGNMENT, "eve").id
    written: list[str] = []
    asked: list[str] = []
    page.on("request", lambda r: written.append(r.url) if r.method in ("PUT", "POST") else None)
    page.on("request", lambda r: asked.append(r.url) if "asked" in r.url else None)
    page.goto(f"{lab.url}/formgrader/submissions/{which}/")
    for cell in EXPLANATIONS:
        expect(page.locator(f"input.score#{cell}")).to_have_class(
            "score tabbable needs_manual_grade"
        )
        assert page.locator(f"#{cell}").count() == 1  # no heading of an answer has its place
    for link in page.locator(".rendered_html a").all():
        target = link.get_attribute("href") or ""
        assert urlsplit(target).scheme in ("", "http", "https", "mailto"), target
    for place in page.locator(".rendered_html b, .rendered_html details").all():
        place.hover()
    assert page.evaluate("window.taken") is None
    assert not written
    assert not asked
    assert not any(marks(course_root).values())
    for name in ("evil.html", "evil.svg"):  # nobody is to be led there
        assert page.request.get(f"{lab.url}/formgrader/submissions/{which}/{name}").status == 404

    # The answers are there all the same, and what is no danger looks as it should.
    text = page.locator("#notebook-container").first.inner_text().replace("\N{WORD JOINER}", "")
    assert all(answer.split(">")[0].split("(")[0][:8] in text for answer in ANSWERS[:2])
    expect(page.locator(".output_html td").filter(has_text="kept")).to_have_count(1)
    expect(page.locator(".output_html math")).to_have_count(1)
    expect(page.locator(".rendered_html em").filter(has_text="the depth").first).to_be_visible()

    # One answer's buttons are its own, whatever the answers before it have left open.
    first, *others = EXPLANATIONS
    panel = page.locator(".nbgrader_cell", has=page.locator(f"#{first}"))
    panel.get_by_role("button", name="No credit").click()
    until(
        lambda: marks(course_root)[first] == 0.0, 60,
        lambda: f"the mark did not reach the gradebook: {marks(course_root)}",
    )  # fmt: skip
    assert not any(marks(course_root)[cell] is not None for cell in others)

    page.evaluate(RUN)  # it works where it runs
    until(
        lambda: all(marks(course_root)[cell] for cell in EXPLANATIONS), 60,
        lambda: f"the script gives nobody marks, so this test proves nothing: {marks(course_root)}",
    )  # fmt: skip


def test_nothing_runs_in_a_feedback_page(window: tuple[Lab, Page], course_root: Path) -> None:
    _, page = window
    folder = course_root / "feedback" / "eve" / ASSIGNMENT
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    for file in sorted(folder.glob("*.html")):
        page.goto(file.as_uri())
        assert page.evaluate("window.taken") is None
    assert (folder / f"{NOTEBOOK}.html").is_file()
    assert not [url for url in asked if "formgrader" in url or "asked" in url]
    assert not (folder / "evil.html").exists()
