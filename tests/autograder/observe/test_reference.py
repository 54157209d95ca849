"""The reference for authors is what the docstrings say, and its examples run."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

from autograder import observe
from autograder.observe.__main__ import reference
from course.workspace.content import content_root

LIBRARY = Path(observe.__file__).parent
EXAMPLES = [
    "autograder.corpus.mutations",
    *(
        ".".join(("autograder.observe", *path.relative_to(LIBRARY).with_suffix("").parts))
        for path in sorted(LIBRARY.rglob("*.py"))
        if ">>> " in path.read_text()
    ),
]


def test_the_page_is_what_the_docstrings_say() -> None:
    page = content_root() / "guides" / "observe.md"
    assert page.read_text() == reference(), f"run: python -m autograder.observe > {page}"


@pytest.mark.parametrize("module", EXAMPLES)
def test_the_examples_run(module: str) -> None:
    result = doctest.testmod(importlib.import_module(module))
    assert result.attempted
    assert not result.failed
