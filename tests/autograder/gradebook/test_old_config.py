"""Courses of earlier versions: the names that their nbgrader_config.py imports are still there."""

from __future__ import annotations

import importlib

import pytest


@pytest.mark.parametrize(
    "name", ["FlagForHumans", "GradeByBehaviour", "RestoreCells", "SubmissionExporter"]
)
def test_a_configuration_of_an_earlier_course_still_loads(name: str) -> None:
    found = importlib.import_module("autograder.nbgrader_bridge")
    assert (
        getattr(found, name).__module__ == "autograder.gradebook.nbgrader_plugins.autograde_steps"
    )
