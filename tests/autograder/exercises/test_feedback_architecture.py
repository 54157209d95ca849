"""What a student reads about an architecture: whole reports, compared with golden texts."""

from __future__ import annotations

import pytest

from autograder import corpus, exercises
from autograder.corpus import trials
from autograder.examination import points
from autograder.examination.subject.own_interfaces import DEFINITIONS, NAVIGATE_TO
from autograder.examination.verdict_text import Report
from tests.autograder.goldens import golden, with_titles_of_pictures
from tests.machine import needs_isolation

EXAM = "architecture"
CASES = {case.name: case for case in corpus.load_cases(EXAM)}


@pytest.fixture(scope="module")
def notebooks() -> trials.Notebooks:
    return trials.make_notebooks(EXAM)


@needs_isolation
@pytest.mark.parametrize(
    ("name", "hints"),
    [
        ("wrong-stub", 1),
        ("wrong-obstacles-on-request", 3),
        ("wrong-velocity-by-service", 2),
        ("wrong-detector-mute", 1),
    ],
)
def test_the_whole_report_is_the_golden_one(
    name: str, hints: int, notebooks: trials.Notebooks
) -> None:
    (trial,) = trials.run([CASES[name]], *notebooks, jobs=1)
    verdicts = trial.outcome.verdicts
    text = "\n\n".join(
        repr(Report(verdicts[f"{EXAM}-{part}"], hints=hints)) for part in points.table()[EXAM].parts
    )
    text = with_titles_of_pictures(text)
    assert text + "\n" == golden(f"{EXAM}-{name}", text + "\n")


def test_the_examiner_has_the_action_that_the_notebook_gives(notebooks: trials.Notebooks) -> None:
    source, _ = notebooks
    given = next(cell for cell in source.cells if cell.id == f"{EXAM}-given")
    assert f"'{NAVIGATE_TO}'" in given.source
    assert DEFINITIONS[NAVIGATE_TO] in given.source


def test_nothing_of_the_grader_is_in_what_a_student_reads() -> None:
    for check in exercises.load_exam(EXAM).checks.values():
        for text in (check.title, check.rationale, *check.hints, check.read):
            assert "autograder" not in text
            assert "rig" not in text.split()
