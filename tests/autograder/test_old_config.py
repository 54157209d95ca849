"""Courses that were made before rooms had doors: what their nbgrader_config.py imports is there."""

from __future__ import annotations

import importlib

import pytest


@pytest.mark.parametrize(
    "name", ["FlagForHumans", "GradeByBehaviour", "RestoreCells", "SubmissionExporter"]
)
def test_a_configuration_of_an_earlier_course_still_loads(name: str) -> None:
    found = importlib.import_module("autograder.nbgrader_bridge")
    assert getattr(found, name).__module__ == "autograder.gradebook.bridge"
