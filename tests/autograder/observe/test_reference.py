"""The reference for authors is what the docstrings say, and its examples run."""

from __future__ import annotations

import doctest

import pytest

from autograder.corpus import mutations
from autograder.observe import (
    graph,
    graph_faults,
    mark_trace,
    nouns,
    observed_design,
    observed_node,
)
from autograder.observe.__main__ import reference
from course.workspace.content import content_root


def test_the_page_is_what_the_docstrings_say() -> None:
    page = content_root() / "guides" / "observe.md"
    assert page.read_text() == reference(), f"run: python -m autograder.observe > {page}"


@pytest.mark.parametrize(
    "module", [mutations, nouns, observed_node, graph, graph_faults, mark_trace, observed_design]
)
def test_the_examples_run(module: object) -> None:
    result = doctest.testmod(module)  # type: ignore[arg-type]
    assert result.attempted
    assert not result.failed
