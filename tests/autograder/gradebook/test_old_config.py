"""A course's nbgrader_config.py imports from one module, whose names stay."""

from __future__ import annotations

import ast
import importlib

import pytest

from course.workspace.content import CONFIG, content_root

EARLIER = ["FlagForHumans", "GradeByBehaviour", "RestoreCells", "SubmissionExporter"]


@pytest.mark.parametrize("name", EARLIER)
def test_a_configuration_of_an_earlier_course_still_loads(name: str) -> None:
    assert hasattr(importlib.import_module("autograder.nbgrader_bridge"), name)


def test_a_configuration_needs_nothing_else_of_ours() -> None:
    tree = ast.parse((content_root() / CONFIG).read_text())
    froms = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    ours = {node.module for node in froms if (node.module or "").startswith("autograder")}
    assert ours == {"autograder.nbgrader_bridge"}
