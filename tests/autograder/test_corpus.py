"""The graders are graded: every case of the corpus gets exactly its verdict, on real DDS."""

from __future__ import annotations

from pathlib import Path

import pytest

from autograder import corpus, exams
from autograder.corpus import Case, CorpusError

from .conftest import SUBMISSIONS, Course

CASES = corpus.load(SUBMISSIONS, "qos")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_case_gets_its_verdict(case: Case, released_course: Path) -> None:
    course = Course(released_course)
    (trial,) = corpus.run([case], course.source, course.released, jobs=1)
    assert trial.difference == "", trial.outcome.verdicts


def test_a_check_that_no_mutant_needs_is_not_a_check() -> None:
    killers = {name for case in CASES for name in case.fails or ()}
    assert killers == set(exams.load("qos").checks)


def test_every_mutant_is_killed_and_designs_differ() -> None:
    for case in CASES:
        assert (case.fails == frozenset()) == case.name.startswith("right-")
    assert sum(case.name.startswith("right-") for case in CASES) >= 5


def test_a_difference_is_reported(released_course: Path, cases: dict[str, Case]) -> None:
    course = Course(released_course)
    right = cases["right-chapter"]
    claimed = Case("qos", "claimed", "t", frozenset({"imu_burst"}), right.body)
    (trial,) = corpus.run([claimed], course.source, course.released, jobs=1)
    assert trial.difference == "passed but must fail: imu_burst"


def test_a_corpus_without_a_header_is_named(tmp_path: Path) -> None:
    (tmp_path / "qos").mkdir()
    (tmp_path / "qos" / "case.py").write_text("x = 1\n")
    with pytest.raises(CorpusError, match=r"case\.py must begin with"):
        corpus.load(tmp_path, "qos")
    with pytest.raises(CorpusError, match="no corpus for 'other'"):
        corpus.load(tmp_path, "other")
