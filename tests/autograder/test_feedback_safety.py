"""What a student of exercise 5 reads, word for word: three mistakes, with all hints."""

from __future__ import annotations

from pathlib import Path

import pytest

from autograder import corpus
from autograder.corpus import trials
from autograder.report import Report
from tests.machine import needs_isolation

from .conftest import SUBMISSIONS

GOLDEN = Path(__file__).parent / "golden"
CASES = {case.name: case for case in corpus.load(SUBMISSIONS, "safety")}
MISTAKES = ("wrong-gripper-constant-pauses", "wrong-speed-nan", "wrong-drive-shutdown-drives-on")


@needs_isolation
@pytest.mark.parametrize("name", MISTAKES)
def test_the_report_reads_as_it_should(name: str) -> None:
    (trial,) = corpus.run([CASES[name]], *trials.notebooks("safety"), jobs=1)
    shown = [repr(Report(verdict, hints=3)) for verdict in trial.outcome.verdicts.values()]
    assert "\n".join(shown) + "\n" == (GOLDEN / f"safety-{name}.txt").read_text(encoding="utf-8")
