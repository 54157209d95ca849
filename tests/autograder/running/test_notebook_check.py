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
from autograder.running import live_report
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


class Watching(NotebookClient):
    """Keeps each text that is displayed, also those that others have replaced since."""

    def __init__(self, *sources: str) -> None:
        cells = [new_code_cell(source) for source in sources]
        super().__init__(new_notebook(cells=cells), timeout=120, allow_errors=True)
        self.shown: list[str] = []

    def process_message(self, msg: Output, *more: Any) -> Any:
        if msg["msg_type"] in ("display_data", "update_display_data"):
            self.shown.append(msg["content"]["data"]["text/plain"])
        return super().process_message(msg, *more)


def test_the_report_says_what_is_examined_and_grows_with_each_result(
    course: Course, cases: dict[str, Case]
) -> None:
    check = "from autograder import check\ncheck('qos')"
    watching = Watching(*given(course, cases["wrong-lidar-deep"]), check)
    notebook = watching.execute()
    starts, *examining, whole = watching.shown
    assert starts == "qos: 0 points so far\nThe examiner starts."
    for number, text in enumerate(examining, 1):
        first, *results, now = text.splitlines()
        assert first.endswith("points so far")
        assert now.startswith(f"Examining {number} of {len(examining)}: ")
        titles = [line for line in results if line[0] in "✔✘"]
        assert len(titles) == number - 1
        assert [line for line in whole.splitlines() if line[0] in "✔✘"][: number - 1] == titles
    assert "✘ After a pause obstacle avoidance" in examining[-1]
    assert "picture: " in whole
    assert report(notebook.cells[-1].outputs) == whole
    assert "<svg" in notebook.cells[-1].outputs[0]["data"]["text/html"]


def test_an_examination_that_is_interrupted_says_so_in_its_report(
    course: Course, cases: dict[str, Case]
) -> None:
    broken = (
        "from autograder.running.start import ExaminerProcess\n"
        "from autograder import check\n"
        "def request(*_, **__): raise KeyboardInterrupt\n"
        "ExaminerProcess.request = request\ncheck('qos')"
    )
    (outputs,) = run(broken)
    assert report(outputs).splitlines()[-1] == live_report.ENDED


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
