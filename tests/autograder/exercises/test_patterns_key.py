"""The key of Exercise 3 stands in one hidden cell, and nobody who should not see it does."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import nbformat
import pytest

from autograder import corpus, exercises
from autograder.assignments import submission
from autograder.assignments.build_notebooks import build
from autograder.corpus.trials import one_notebook
from autograder.examination import answer_keys
from autograder.examination.exam import Failed
from autograder.exercises.patterns.scenarios import CHOICES
from autograder.gradebook.release import make_release
from autograder.grading import engine
from autograder.running import runner
from course.workspace.student_version import student_versions
from tests.machine import needs_isolation

KEY_LINES = ('"position": ["service", "topic"]', '"navigation": ["action"]', "key=")


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = one_notebook(tmp_path_factory.mktemp("course"), "patterns", "ch05")
    build(root)
    make_release(root, "ch05")
    return root


def read(root: Path, step: str) -> nbformat.NotebookNode:
    return submission.read_notebook(root / step / "ch05" / "patterns.ipynb")


def key(root: Path) -> dict[str, Any]:
    (cell,) = (
        cell for cell in submission.extract_program(read(root, "source")) if cell.part == "choices"
    )
    return dict(cell.key)


def test_the_key_is_read_from_the_hidden_cell_without_running_it(root: Path) -> None:
    found = key(root)
    assert list(found) == list(CHOICES.questions)
    assert all(set(right) <= set(CHOICES.words) for right in found.values())


@pytest.mark.parametrize(
    "source",
    ["", "check('patterns')", "check('patterns', part='choices'", "x = {'key': 1}"],
)
def test_a_cell_without_a_key_has_none(source: str) -> None:
    assert answer_keys.of_cell(source) == {}


@pytest.mark.parametrize("written", ["secret()", "[1, 2]", "{'a': open('/etc/passwd')}", "None"])
def test_a_key_that_is_not_plain_data_is_refused(written: str) -> None:
    with pytest.raises(answer_keys.KeyCellError, match="written out as a dictionary of plain data"):
        answer_keys.of_cell(f"check('patterns', part='choices', key={written})")


def test_the_release_has_no_key(root: Path) -> None:
    text = (root / "release" / "ch05" / "patterns.ipynb").read_text(encoding="utf-8")
    copies = student_versions(root).values()
    for line in KEY_LINES:
        assert json.dumps(line)[1:-1] in json.dumps(read(root, "source"))
        for handed_out in (text, *copies):
            assert json.dumps(line)[1:-1] not in handed_out
    released = submission.extract_program(read(root, "release"))
    assert not any(cell.key for cell in released)


def test_the_subject_is_told_neither_the_key_nor_the_part(root: Path) -> None:
    program = submission.extract_program(read(root, "source"))
    shown = json.dumps([runner._cell_message(program, number) for number in range(len(program))])
    for secret in ("choices\\", "key=", "hidden", '[\\"action'):
        assert secret not in shown.replace("choices = {", "")


def test_no_text_of_a_choice_check_names_a_pattern() -> None:
    checks = exercises.load_exam("patterns").checks
    for scenario in CHOICES.questions:
        check = checks[f"{scenario}_choice"]
        said = " ".join((check.title, check.rationale, *check.hints, check.read)).lower()
        for pattern in CHOICES.words:
            assert pattern not in said, (scenario, pattern)


def test_no_visible_check_of_the_node_says_which_pattern_to_take() -> None:
    """Neither as a hint nor as what is to be read; what works, the node shows by working."""
    checks = exercises.load_exam("patterns").checks
    for name in exercises.load_exam("patterns").part("visible"):
        check = checks[name]
        said = " ".join((check.title, check.rationale, *check.hints, check.read)).lower()
        for word in () if name == "choices_made" else (*CHOICES.words, "publish", "trigger"):
            assert word not in said, (name, word)


def test_the_report_of_a_wrong_choice_names_no_other_pattern(root: Path) -> None:
    """Every wrong answer to every question, as the student would read it."""
    checks = exercises.load_exam("patterns").checks
    for scenario, right in key(root).items():
        for pattern in set(CHOICES.words) - set(right):
            with pytest.raises(Failed) as failed:
                CHOICES.require_right(scenario, pattern, key(root))
            said = f"{failed.value} {checks[f'{scenario}_choice'].hints}".lower()
            assert f'you chose "{pattern}"' in said
            for other in set(CHOICES.words) - {pattern}:
                assert other not in said, (scenario, pattern)


@needs_isolation
def test_the_feedback_html_has_the_verdict_and_not_the_key(root: Path) -> None:
    cases = {case.name: case for case in corpus.load_cases("patterns")}
    case = cases["wrong-choice-navigation"]
    folder = root / "submitted" / "wrong" / "ch05"
    folder.mkdir(parents=True)
    nbformat.write(
        case.make_submission(read(root, "source"), read(root, "release")), folder / "patterns.ipynb"
    )
    engine.grade(root, "ch05")
    html = (root / "feedback" / "wrong" / "ch05" / "patterns.html").read_text(encoding="utf-8")
    autograded = (root / "autograded/wrong/ch05/patterns.ipynb").read_text(encoding="utf-8")
    assert "Sending a navigation goal: the pattern fits." in html
    assert "no way to call it back before it arrives" in html
    for text in (html, autograded):
        assert "key=" not in text
        assert "HIDDEN TESTS" not in text
        assert '["action"]' not in text.replace("&quot;", '"').replace('\\"', '"')
