"""The reference for authors is what the docstrings say, and its examples run."""

from __future__ import annotations

import doctest

import pytest

from autograder.corpus import mutations
from autograder.observe import (
    heartbeats,
    multi_node_rig,
    nouns,
    observed_goal,
    observed_node,
    phrases,
    wall_waits,
)
from autograder.observe.__main__ import reference
from course.workspace.content import content_root

EXAMPLES = (
    mutations, nouns, observed_node, heartbeats, observed_goal, multi_node_rig, phrases, wall_waits,
)  # fmt: skip


def test_the_page_is_what_the_docstrings_say() -> None:
    page = content_root() / "guides" / "observe.md"
    assert page.read_text() == reference(), f"run: python -m autograder.observe > {page}"


@pytest.mark.parametrize("module", EXAMPLES)
def test_the_examples_run(module: object) -> None:
    result = doctest.testmod(module)  # type: ignore[arg-type]
    assert result.attempted
    assert not result.failed
