"""Pages that show a submission: nothing of it runs in them, and none takes long to make."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from typing import Any

import nbconvert.exporters.html
import pytest
from nbconvert.exporters import HTMLExporter
from nbformat import NotebookNode, from_dict
from nbformat.v4 import (
    new_code_cell,
    new_markdown_cell,
    new_notebook,
    new_output,
    new_raw_cell,
)

from autograder.examination.pictures.picture import Series
from autograder.examination.verdict import CheckResult, Verdict
from autograder.examination.verdict_text import Report
from autograder.gradebook.nbgrader_plugins.nbgrader_speedups import TOO_LONG, FeedbackExporter
from autograder.gradebook.safe_html import allowed_html, page_texts
from autograder.gradebook.safe_html.page_texts import Page

NBCONVERT: Any = nbconvert.exporters.html
read: Callable[..., Any] = NBCONVERT.BeautifulSoup  # as nbconvert itself does

PICTURE = new_output(
    "display_data", data={"image/png": "iVBORw0KGgo=", "text/plain": "<Figure size 1x1>"}
)
PRINTED = new_output("stream", name="stdout", text="<img src=x> & <b>")
REPORT = new_output("display_data", data={"text/html": "<p>right</p>", "text/plain": "right"})


def cell_of_the_grader(output: NotebookNode) -> NotebookNode:
    return new_code_cell("check()", outputs=[output], metadata={"nbgrader": {"grade": True}})


def page(exporter: type[HTMLExporter], notebook: NotebookNode) -> str:
    text, _ = exporter(template_name="classic").from_notebook_node(notebook)
    return str(text)


def parsed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    pages: list[str] = []

    def parse(text: str, **options: Any) -> Any:
        pages.append(text)
        return read(text, **options)

    monkeypatch.setattr(NBCONVERT, "BeautifulSoup", parse)
    return pages


def test_a_page_without_html_of_the_students_is_not_parsed_and_says_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    notebook = new_notebook(
        cells=[
            new_markdown_cell("A depth of `10`, if 5 < depth & *more*."),
            new_markdown_cell("<b>ours</b>", metadata={"nbgrader": {"locked": True}}),
            new_code_cell("print('<img src=x> & <b>')", outputs=[PRINTED]),
            cell_of_the_grader(REPORT),
        ]
    )
    pages = parsed(monkeypatch)
    ours = page(FeedbackExporter, notebook)
    assert not pages
    assert page(HTMLExporter, notebook) == str(read(ours, features="html.parser"))
    assert len(pages) == 1


@pytest.mark.parametrize(
    ("cell", "kept"),
    [
        (new_code_cell("plot()", outputs=[PICTURE]), 'src="data:image/png;base64,iVBORw0KGgo="'),
        (new_code_cell("table", outputs=[REPORT]), "<p>right</p>"),
        (
            new_markdown_cell("Look: <img src='data:image/png;base64,iVBORw0KGgo='>"),
            '<img alt="No description has been provided for this image" '
            'src="data:image/png;base64,iVBORw0KGgo=">',
        ),
        (new_markdown_cell("[x](https://example.org/x.png)"), 'href="https://example.org/x.png"'),
        (new_markdown_cell("This is <b>mine."), "This is <b>mine.</b>"),
        (new_markdown_cell("| a |\n|---|\n| $x<y$ |"), "<td>$x&lt;y$</td>"),
        (
            new_markdown_cell("<math><mfrac><mn>1</mn><mi>f</mi></mfrac></math>"),
            "<math><mfrac><mn>1</mn><mi>f</mi></mfrac></math>",
        ),
        (new_markdown_cell("```python\nif x: pass\n```"), '<span class="k">if</span>'),
        (new_markdown_cell("Code: `List<int>`, `<script>`"), "<code>&lt;script&gt;</code>"),
    ],
    ids=[
        "picture",
        "html output",
        "image tag",
        "link",
        "open tag",
        "table",
        "mathml",
        "code",
        "types",
    ],
)
def test_html_that_runs_nothing_is_kept_and_whole(cell: NotebookNode, kept: str) -> None:
    ours = page(FeedbackExporter, new_notebook(cells=[cell, cell_of_the_grader(REPORT)]))
    assert kept in ours
    assert ours.count("<p>right</p>") >= 1


def test_the_picture_of_a_check_is_on_its_page_and_a_drawing_of_a_students_is_not() -> None:
    picture = Series("Threads over lives", "lives", "threads", ((0, 12), (1, 13)))
    check = CheckResult("flat", "It is flat", "failed", 0.0, 1.0, picture=picture)
    report = Report(Verdict("resources", "visible", (check,)))
    shown = new_output("display_data", data={"text/html": report._repr_html_()})
    theirs = new_output(
        "display_data", data={"text/html": "<p>mine</p><svg><title>Threads</title></svg>"}
    )
    output = new_output(**allowed_html.screen_output(theirs, Page()))
    cells = [new_code_cell("draw()", outputs=[output]), cell_of_the_grader(shown)]
    made = page(FeedbackExporter, new_notebook(cells=cells))
    assert made.count("<svg") == 1
    assert read(made, features="html.parser").svg["aria-label"].startswith("Threads over lives.")
    assert "<p>mine</p>" in made


SCRIPT = "fetch('/formgrader/api/grades')"
HOSTILE = [
    new_markdown_cell(f"<script>{SCRIPT}</script>"),
    new_markdown_cell(f'<img src=x onerror="{SCRIPT}">'),
    new_markdown_cell(f"[look](javascript:{SCRIPT})"),
    new_markdown_cell(f"[look](&#106;ava&Tab;script:{SCRIPT})"),
    new_markdown_cell(f"[look][1]\n\n[1]: javascript:{SCRIPT}"),
    new_markdown_cell(f"<javascript:{SCRIPT}>"),
    new_markdown_cell(f"```mermaid\n<img src=x onerror={SCRIPT}>\n```"),
    new_markdown_cell(f"<svg onload={SCRIPT}></svg><iframe srcdoc='<script>{SCRIPT}</script>'>"),
    new_markdown_cell(
        "![a](attachment:a.png)",
        attachments={"a.png": {f'image/png" onerror="{SCRIPT}': "x", "image/png": "%%"}},
    ),
    new_raw_cell(f"<script>{SCRIPT}</script>"),
    *(
        new_code_cell(
            "x", outputs=[new_output("display_data", data={kind: text, "text/plain": "x"})]
        )
        for kind, text in {
            "text/html": f"<b onclick={SCRIPT}>x</b><script>{SCRIPT}</script>",
            "text/markdown": f"<script>{SCRIPT}</script>",
            "text/latex": f"$x$<script>{SCRIPT}</script>",
            "application/javascript": SCRIPT,
            "image/svg+xml": f"<svg onload={SCRIPT}><script>{SCRIPT}</script></svg>",
            "text/vnd.mermaid": f"graph TD\nclick A {SCRIPT}\nA[<img src=x onerror={SCRIPT}>]",
            "application/vnd.jupyter.widget-view+json": {"model_id": f"</script>{SCRIPT}"},
        }.items()
    ),
]


def executable(page_: str) -> list[str]:
    """Return what a browser would run of a page, if it was the script of a student."""
    found = []
    for element in read(page_, features="html.parser").find_all(True):
        if element.name in ("script", "iframe", "object", "embed", "svg"):
            found.append(str(element))
        for name, value in element.attrs.items():
            bare = "".join(str(value).split()).lower()
            if name.startswith("on") or name == "srcdoc" or bare.startswith("javascript:"):
                found.append(f"{name}={value}")
    return [text for text in found if "formgrader/api" in text]


@pytest.mark.parametrize("number", range(len(HOSTILE)))
def test_nothing_of_a_submission_runs_in_a_page(number: int) -> None:
    """Neither in feedback of any graded copy, nor where nbgrader itself shows what was written."""
    hostile = new_notebook(cells=[copy.deepcopy(HOSTILE[number])])
    assert not executable(page(FeedbackExporter, copy.deepcopy(hostile)))
    written = copy.deepcopy(hostile)
    allowed_html.screen_texts(written, new_notebook(), Page())
    for cell in written.cells:
        cell.outputs = [
            from_dict(allowed_html.screen_output(output, Page()))
            for output in cell.get("outputs", [])
        ]
    assert not executable(page(HTMLExporter, written))


def test_the_same_texts_would_run_if_they_were_not_screened() -> None:
    ran = [bool(executable(page(HTMLExporter, new_notebook(cells=[cell])))) for cell in HOSTILE]
    assert sum(ran) >= 10  # nbconvert itself sees to some of the others


ELSEWHERE = [
    "/logout", "//example.org/x.png", "https://example.org/x.png", "../../logout", "a/../../logout",
    "%2e%2e/logout", "files//logout", "?logout", "HTTPS:x.png", "file:///etc/x.png",
]  # fmt: skip


def loaded(page_: str) -> list[str]:
    """Return what a browser would ask for by itself where it shows a page."""
    found = []
    for element in read(page_, features="html.parser").body.find_all(True):
        for name in ("src", "srcset", "poster", "background", "data"):
            found += [element.attrs[name]] if name in element.attrs else []
        found += re.findall(r"url\(.*", element.attrs.get("style", ""))
    return [url for url in found if not url.startswith("data:")]


@pytest.mark.parametrize(
    "text",
    [
        "![a]({})", '![a]({} "title")', "![a][1]\n\n[1]: {}", "![a]\n\n[a]: {}",
        "![a [b](x.png)]({})", "[![a]({})](x)", "![a\\](x.png) b]({})",
        "![`](x.png)` ]({})", "![$](x.png)$ ]({})",
        '<img src="{}">', "<img src={}>", '<img alt="a" srcset="{}">',
        '<video poster="{}"></video>',
        '<table background="{}"><tr><td>a</td></tr></table>', '<object data="{}"></object>',
        '<b style="background-color: url({})">a</b>', '<b style="border: 1px url({})">a</b>',
    ],
)  # fmt: skip
def test_a_page_loads_nothing_by_itself_but_what_lies_beside_the_notebook(text: str) -> None:
    """Neither where nbgrader shows what was written, nor in feedback: a page asks for nothing."""
    hostile = new_notebook(cells=[new_markdown_cell(text.format(url)) for url in ELSEWHERE])
    hostile.cells += [
        new_code_cell("x", outputs=[new_output("display_data", data={kind: text.format(url)})])
        for url in ELSEWHERE for kind in ("text/html", "text/markdown")
    ]  # fmt: skip
    assert loaded(page(FeedbackExporter, copy.deepcopy(hostile))) == []
    allowed_html.screen_texts(hostile, new_notebook(), Page())
    for cell in hostile.cells:
        cell.outputs = [
            from_dict(allowed_html.screen_output(output, Page()))
            for output in cell.get("outputs", [])
        ]
    assert loaded(page(HTMLExporter, hostile)) == []


@pytest.mark.parametrize(
    "text",
    [
        "# explain-depth", "# **explain**-depth", "explain-depth\n===", "# explain-depth-comment",
        "<div>", "</div></div>", "<table>", "```\n<div>\n```\n</div>",
    ],
)  # fmt: skip
def test_an_answer_cannot_take_the_place_of_a_part_of_the_formgraders_page(text: str) -> None:
    graded = new_markdown_cell("x", metadata={"nbgrader": {"grade_id": "explain-depth"}})
    written = new_notebook(cells=[new_markdown_cell(text), graded])
    allowed_html.screen_texts(written, new_notebook(), Page())
    shown = page(HTMLExporter, written)
    found = read(shown, features="html.parser").find_all(id=re.compile("^explain-depth"))
    assert not found
    assert shown.count("<div") == shown.count("</div>")
    letters = "".join(re.findall(r"\w+", text))
    assert letters in "".join(re.findall(r"\w+", written.cells[0].source))


@pytest.mark.parametrize(
    "text",
    [
        "Depth 10, `List<int>` and *so* on: a < b, [0](https://example.org/?a=b)", "<b>x</b><br/>",
        "![a](picture.png) ![b](attachment:b.png)", '![a](files/my%20plots/a.png "my plot")',
        "[![a](picture.png)](https://example.org)", "| a | b |\n|---|---|\n| 1 | 2 |", "x[0]: 3",
        '<img src="a.png" width="300"> <span style="color: red">r</span>', "[there](#Heading)",
        "<details><summary>More</summary>\n\ntext\n\n</details>", "<https://example.org>",
        "$$\\frac{a}{b}$$ <math><mi>x</mi></math>", "```python\nx = 1 < 2\n```", "me <a@b.org>",
    ],
)  # fmt: skip
def test_an_ordinary_answer_is_written_as_it_was_typed(text: str) -> None:
    attachments = {"b.png": {"image/png": "iVBORw0KGgo="}}
    written = new_notebook(cells=[new_markdown_cell(text, attachments=attachments)])
    allowed_html.screen_texts(written, new_notebook(), Page())
    assert written.cells[0].source.replace("\N{WORD JOINER}", "") == text
    if "List<" not in text:
        assert written.cells[0].source == text


SLOW = {
    "brackets": new_markdown_cell("[" * 100_000),
    "stars": new_markdown_cell("*a_" * 30_000),
    "twenty megabytes": new_markdown_cell("[" * 20_000_000),
    "code that never runs": new_code_cell("%%script false\n" + "(" * 200_000),
    "tags in an output": new_code_cell(
        "x", outputs=[new_output("display_data", data={"text/html": "<svg " * 100_000})]
    ),
    "markdown in an output": new_code_cell(
        "x", outputs=[new_output("display_data", data={"text/markdown": "[" * 100_000})]
    ),
    "colours": new_code_cell(
        "x", outputs=[new_output("stream", name="stdout", text="\x1b[31m" * 10_000)] * 20
    ),
}


@pytest.mark.parametrize("what", SLOW)
def test_what_takes_too_long_is_shown_as_it_was_typed(what: str) -> None:
    notebook = new_notebook(cells=[copy.deepcopy(SLOW[what]), new_markdown_cell("*all* the rest")])
    shown = page(FeedbackExporter, copy.deepcopy(notebook))  # which would take minutes
    if SLOW[what].cell_type == "markdown":
        assert TOO_LONG in shown
    assert "<em>all</em> the rest" in shown  # the others are formatted all the same
    allowed_html.screen_texts(notebook, new_notebook(), Page())
    for cell in notebook.cells:
        cell.outputs = [
            from_dict(allowed_html.screen_output(output, Page()))
            for output in cell.get("outputs", [])
        ]
    # As the formgrader does, in the server that all windows share.
    assert "<em>all</em> the rest" in page(HTMLExporter, notebook)


def test_the_process_that_formats_is_started_anew_if_it_is_lost() -> None:
    assert Page().format_markdown("*a*", {}) == "<p><em>a</em></p>\n"
    page_texts._formatter._process.kill()
    page_texts._formatter._process.wait()
    assert Page().format_markdown("*b*", {}) == "<p><em>b</em></p>\n"


def test_files_beside_a_notebook_run_nothing_where_they_are_served() -> None:
    def may(name: str, content: bytes = b"") -> bool:
        return allowed_html.may_lie_beside(name, lambda: content)

    svg = b'<svg xmlns="http://www.w3.org/2000/svg">%s</svg>'
    assert all(map(may, ("plot.png", "data.csv", "node.py", "notes.txt", "report.docx")))
    assert may("drawing.svg", svg % b'<g><path d="M0 0"/></g>')
    for inside in (
        b'<g fill="url(#a)"/><use href="#b"/>', b'<image href="a.png"/>',
        b"<style>g {fill: url('data:image/png;base64,AA==')}</style><text>a\\b url(c)</text>",
    ):  # fmt: skip
        assert may("drawing.svg", svg % inside), inside
    for name in ("page.html", "page.XHTML", "feed.xml", "sheet.xsl", "letter.mht"):
        assert not may(name), name
    for inside in (
        b"<script>1</script>", b'<g onload="1"/>', b"<foreignObject/>", b'<a href="javascript:1"/>',
        b'<x:script xmlns:x="http://www.w3.org/1999/xhtml">1</x:script>',
        b'<use href="data:text/html,x"/>', b"<g>", b'<image href="/logout"/>',
        b'<image href="https://example.org/x.png"/>', b'<g fill="url(/logout)"/>',
        b'<g style="fill: u\\72l(/logout)"/>', b"<style>@import '/logout';</style>",
        b"<style>g {fill: ur<!-- -->l(/logout)}</style>",
    ):  # fmt: skip
        assert not may("drawing.svg", svg % inside), inside
    assert not may("drawing.svg", b'<!DOCTYPE svg [<!ENTITY x "y">]>' + svg % b"")
