"""What a student of exercise 1 reads, word for word: three mistakes, with all hints."""

from __future__ import annotations

import re

import pytest

from autograder import corpus
from autograder.corpus import trials
from autograder.examination.verdict_text import Report
from tests.autograder.goldens import golden, with_titles_of_pictures
from tests.machine import needs_sandbox

CASES = {case.name: case for case in corpus.load_cases("qos")}
MISTAKES = (
    "wrong-camera-reliable",
    "wrong-constructor-raises",
    "wrong-imu-single",
    "wrong-incompatible",
)


@needs_sandbox
@pytest.mark.parametrize("name", MISTAKES)
def test_the_report_reads_as_it_should(name: str) -> None:
    (trial,) = corpus.run([CASES[name]], *trials.make_notebooks("qos"), jobs=1)
    shown = [repr(Report(verdict, hints=3)) for verdict in trial.outcome.verdicts.values()]
    text = "\n".join(shown) + "\n"
    # Readings come in at a sensor's rate until all have had their pause: one more or less. And of
    # the last frames of the gap one may have got through.
    text = re.sub(r"\bof \d{3} readings", "of 151 readings", text)
    text = re.sub(r"\b[34] frames that were lost", "4 frames that were lost", text)
    text = with_titles_of_pictures(text)
    assert text == golden(f"qos-{name}", text)
