"""Whole reports of Exercise 3 as a student reads them, compared with texts a person has read."""

from __future__ import annotations

import re
from functools import cache

import pytest

from autograder import corpus
from autograder.assignments import submission
from autograder.corpus import trials
from autograder.examination.draws import USUAL_SEED
from autograder.examination.verdict_text import Report
from autograder.running import runner
from tests.autograder.goldens import golden, with_titles_of_pictures
from tests.machine import needs_isolation


@cache
def _notebooks() -> trials.Notebooks:
    return trials.make_notebooks("patterns")


def report(name: str, part: str) -> str:
    """Return what the student of a corpus case reads about one part, with all hints."""
    case = next(case for case in corpus.load_cases("patterns") if case.name == name)
    source, released = _notebooks()
    notebook, _ = submission.restore_cells(case.make_submission(source, released), source, released)
    outcome = runner.run(submission.extract_program(notebook), seed=USUAL_SEED)
    return repr(Report(outcome.verdicts[f"patterns-{part}"], hints=3)) + "\n"


@needs_isolation
@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("wrong-stub", "visible"),
        ("wrong-navigation-no-stop", "visible"),
        ("wrong-cancel-drives-on", "hidden"),
        ("wrong-choices-all-topics", "choices"),
    ],
)
def test_the_report_reads_as_it_should(name: str, part: str) -> None:
    # When the stub's slow timer comes round depends on when the examiner begins to look.
    late = r"become 0\.\d+, the last percentage was [\d.]*\d"
    text = re.sub(late, "become 0.6, the last percentage was 0.95", report(name, part))
    text = with_titles_of_pictures(text)
    assert text == golden(f"patterns-{name.removeprefix('wrong-')}-{part}", text)
