"""Courses that were made before rooms had doors: what their nbgrader_config.py imports is there."""

from __future__ import annotations

import importlib

import pytest

IMPORTS = {
    "autograder.index_page": ["IndexPages"],
    "autograder.model_answers": ["ShowModelAnswers"],
    "autograder.nbgrader_bridge": [
        "FlagForHumans",
        "GradeByBehaviour",
        "RestoreCells",
        "SubmissionExporter",
    ],
    "autograder.nbgrader_once": ["FeedbackExporter"],
    "autograder.settled_export": ["SettledExport"],
}


@pytest.mark.parametrize("module", IMPORTS)
def test_a_configuration_of_an_earlier_course_still_loads(module: str) -> None:
    found = importlib.import_module(module)
    for name in IMPORTS[module]:
        assert getattr(found, name).__module__.startswith("autograder.gradebook.")
