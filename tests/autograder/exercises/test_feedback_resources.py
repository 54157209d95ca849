"""What a student reads about exercise 4, word for word, and the exercise in a real kernel."""

from __future__ import annotations

import re

import pytest
from nbclient import NotebookClient
from nbformat.v4 import new_code_cell, new_notebook

from autograder import corpus
from autograder.assignments import submission
from autograder.corpus import Case
from autograder.corpus.trials import Notebooks, make_notebooks
from autograder.examination.draws import USUAL_SEED
from autograder.examination.verdict_text import Report
from autograder.running import runner
from tests.autograder.goldens import golden, with_titles_of_pictures
from tests.machine import needs_isolation


@pytest.fixture(scope="module")
def versions() -> Notebooks:
    return make_notebooks("resources")


@pytest.fixture(scope="module")
def cases() -> dict[str, Case]:
    return {case.name: case for case in corpus.load_cases("resources")}


@needs_isolation
@pytest.mark.parametrize("name", ["camera-left-open", "timer-goes-on", "stays-inactive"])
def test_the_report_of_a_typical_mistake(
    name: str, versions: Notebooks, cases: dict[str, Case]
) -> None:
    notebook, _ = submission.restore_cells(cases[name].make_submission(*versions), *versions)
    outcome = runner.run(submission.extract_program(notebook), seed=USUAL_SEED)
    reports = [repr(Report(verdict, hints=3)) for verdict in outcome.verdicts.values()]
    # A device of the examiner's has a random number in its name.
    text = re.sub(r"-[0-9a-f]{8}\b", "-1234abcd", "\n\n".join(reports)) + "\n"
    text = with_titles_of_pictures(text)
    assert text == golden(f"resources-{name}", text)


def test_what_else_a_kernel_does_does_not_disturb(
    versions: Notebooks, cases: dict[str, Case]
) -> None:
    cells = cases["right-exemplar"].make_submission(*versions).cells
    wanted = ("resources-given", "resources-solution", "resources-lifecycle")
    mine = [cell.source for cell in cells if submission.grade_id(cell) in wanted]
    own = "import course\nnodes = course.run(CameraDriver), course.run(ManagedCamera)"
    threads = (
        "stop = threading.Event()\n"
        "for _ in range(8):\n"
        "    threading.Thread(target=stop.wait, daemon=True).start()"
    )
    check = "from autograder import check\ncheck('resources')"
    sources = [*mine, own, threads, check, "stop.set(); len(course.session().nodes)"]
    notebook = new_notebook(cells=[new_code_cell(source) for source in sources])
    NotebookClient(notebook, timeout=150, allow_errors=True).execute()
    *_, checked, alive = (cell.outputs for cell in notebook.cells)
    assert [o["data"]["text/plain"] for o in checked if o["output_type"] == "execute_result"] == [
        "10.0"
    ], checked
    assert not [o for o in checked if o["output_type"] in ("stream", "error")]
    assert alive[-1]["data"]["text/plain"] == "2"
