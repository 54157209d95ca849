"""The reference for authors is what the docstrings say, and its examples run."""

from __future__ import annotations

import doctest

import pytest

from autograder.corpus import mutations
from autograder.observe import (
    node_graph,
    nouns,
    observed_node,
    process_usage,
    stepped_rate,
    wall_rate,
)
from autograder.observe.__main__ import reference
from course.workspace.content import content_root


def test_the_page_is_what_the_docstrings_say() -> None:
    page = content_root() / "guides" / "observe.md"
    assert page.read_text() == reference(), f"run: python -m autograder.observe > {page}"


@pytest.mark.parametrize(
    "module",
    [mutations, node_graph, nouns, observed_node, process_usage, stepped_rate, wall_rate],
)
def test_the_examples_run(module: object) -> None:
    result = doctest.testmod(module)  # type: ignore[arg-type]
    assert result.attempted
    assert not result.failed
