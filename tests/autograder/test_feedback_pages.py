"""Pages of feedback: nbconvert's own, though most are not parsed once more."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import nbconvert.exporters.html
import pytest
from nbconvert.exporters import HTMLExporter
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from autograder.nbgrader_once import FeedbackExporter

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
    "cell",
    [
        new_code_cell("plot()", outputs=[PICTURE]),
        new_code_cell("table", outputs=[REPORT]),
        new_markdown_cell("Look: <img src='https://example.org/x.png'>"),
        new_markdown_cell("This is <b>mine."),
        new_markdown_cell("<!-- and nothing behind it"),
    ],
    ids=["picture", "html output", "image tag", "open tag", "open comment"],
)
def test_a_page_with_html_of_the_students_is_nbconverts_own(cell: NotebookNode) -> None:
    notebook = new_notebook(cells=[cell, cell_of_the_grader(REPORT)])
    ours = page(FeedbackExporter, notebook)
    assert ours == page(HTMLExporter, notebook)
    images = read(ours, features="html.parser").select("img")
    assert all(image.get("alt") for image in images)
