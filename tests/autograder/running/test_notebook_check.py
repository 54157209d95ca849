"""The student's door, in a real kernel: a report in the cell, a float at its end, no stderr."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient
from nbformat.v4 import new_code_cell, new_notebook

from autograder.assignments import submission
from autograder.corpus import Case
from tests.autograder.conftest import Course

Output = dict[str, Any]


def run(*sources: str) -> list[list[Output]]:
    notebook = new_notebook(cells=[new_code_cell(source) for source in sources])
    NotebookClient(notebook, timeout=120, allow_errors=True).execute()
    return [cell.outputs for cell in notebook.cells]


def given(course: Course, case: Case) -> list[str]:
    cells = case.make_submission(course.source, course.released).cells
    wanted = ("qos-given", "qos-solution")
    return [cell.source for cell in cells if submission.grade_id(cell) in wanted]


def value(outputs: list[Output]) -> float:
    (result,) = (o for o in outputs if o["output_type"] == "execute_result")
    return float(result["data"]["text/plain"])


def report(outputs: list[Output]) -> str:
    (shown,) = (o for o in outputs if o["output_type"] == "display_data")
    return str(shown["data"]["text/plain"])


def test_the_cell_shows_a_report_and_ends_with_the_points(
    course: Course, cases: dict[str, Case]
) -> None:
    check = "from autograder import check\ncheck('qos')"
    outputs = run(*given(course, cases["wrong-lidar-deep"]), check, "check('qos', hint=3)")
    for cell in outputs[2:]:
        assert value(cell) == 8.0
        assert not [o for o in cell if o["output_type"] in ("stream", "error")]
    assert "hint 1" in report(outputs[2])
    assert "hint 2" not in report(outputs[2])
    assert "hint 3" in report(outputs[3])


def test_a_learners_own_running_nodes_do_not_disturb(
    course: Course, cases: dict[str, Case]
) -> None:
    own = "import course\nnodes = course.run(SensorDrivers), course.run(SensorConsumers)"
    check = "from autograder import check\ncheck('qos')"
    *_, checked, alive = run(
        *given(course, cases["right-chapter"]), own, check, "len(course.session().nodes)"
    )
    assert value(checked) == 10.0
    assert value(alive) == 2


def test_a_constructor_that_never_returns_ends_with_a_verdict_and_a_usable_kernel(
    course: Course, cases: dict[str, Case]
) -> None:
    hang = "class SensorDrivers(Relay):\n    def __init__(self):\n        while True: pass"
    right = given(course, cases["right-chapter"])
    check = "from autograder import check\ncheck('qos')"
    *_, hung, _, again = run(*right, hang, check, right[1], check)
    assert value(hung) == 0.0
    assert "did not answer" in report(hung)
    assert value(again) == 10.0


def test_an_unknown_exam_is_named(course: Course) -> None:
    (outputs,) = run("from autograder import check\ncheck('qso')")
    assert "Did you mean 'qos'?" in outputs[-1]["evalue"]


def test_the_check_works_in_a_plain_script(course: Course, cases: dict[str, Case]) -> None:
    sources = [s.replace("%load_ext course", "") for s in given(course, cases["right-chapter"])]
    script = "\n".join([*sources, "from autograder import check", "assert check('qos') == 10"])
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=False
    )
    assert result.returncode == 0, result.stderr
    assert "10 of 10 points" in result.stdout
    assert result.stderr == ""


@pytest.mark.parametrize("hint", [1, 2, 3])
def test_hints_of_the_exam_are_graded(hint: int) -> None:
    from autograder.exercises.qos.exam import EXAM

    for check in EXAM.checks.values():
        assert len(check.hints[hint - 1]) > 20


def test_the_notebook_is_valid(course: Course) -> None:
    nbformat.validate(course.released)
