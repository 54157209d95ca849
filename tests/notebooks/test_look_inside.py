"""What the exercises tell students to look at works on the exemplar, word for word."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from nbformat import NotebookNode

from autograder.assignments import submission
from autograder.assignments.cells import without_markers
from course.workspace.content import content_root
from tests.kernel import Kernel

BUILT = [
    path.relative_to(content_root() / "source")
    for path in sorted((content_root() / "source").glob("*/*.ipynb"))
    if "**Look inside**" in path.read_text(encoding="utf-8")
]
SHOWN = {
    "qos-design": ["QoS lab", "/sensor_drivers", "/camera/image"],
    "patterns": ["Parameters of /robot_interface"],
    "resources": ["/camera_driver"],
    "error-handling": ["Action /drive, 0 goals"],
}
"""Words that must be seen, by the name of the notebook."""


@pytest.fixture
def kernel() -> Iterator[Kernel]:
    running = Kernel()
    yield running
    running.close()


def paragraph(notebook: NotebookNode) -> str:
    """Return the one paragraph of an exercise that says how to look inside."""
    texts = [cell.source for cell in notebook.cells if cell.cell_type == "markdown"]
    (text,) = re.findall(r"\*\*Look inside\*\*.*?(?=\n\n|\Z)", "\n\n".join(texts), re.DOTALL)
    return str(text)


def test_every_notebook_that_must_show_something_says_how_to_look_at_it() -> None:
    assert {path.stem for path in BUILT} >= set(SHOWN)


@pytest.mark.parametrize("path", BUILT, ids=str)
def test_what_an_exercise_says_to_look_at_can_be_looked_at(path: Path, kernel: Kernel) -> None:
    notebook = submission.read_notebook(content_root() / "source" / path)
    for cell in notebook.cells:
        if cell.cell_type == "code" and "check(" not in cell.source:
            status, said = kernel.run(without_markers(cell.source))
            assert status == "ok", said
    spans = re.findall(r"`([^`]+)`", paragraph(notebook))
    commands = [span for span in spans if not span.endswith("(name)")]  # a name of one's own
    assert commands[0] == "import course"
    shown = []
    for command in commands:
        status, said = kernel.run(command)
        assert status == "ok", (command, said)
        assert not [text for kind, text in said if kind == "stderr"], command
        shown += [text for _, text in said]
    for words in SHOWN.get(path.stem, ()):
        assert words in "\n".join(shown)
