"""Every right design of the corpus drives the robot, or says what keeps it from that."""

from __future__ import annotations

from typing import Any

import pytest

import course
from autograder import corpus
from autograder.assignments import submission
from course.workspace.content import content_root

CASES = [
    case
    for case in corpus.load_cases("architecture")
    if case.name.startswith("right-") and case.name != "right-without-library"  # no course.Design
]
DRIVEN_S = 8.0


def load_design(case: Any) -> Any:
    """Return the design of a case, as the notebook's cells make it."""
    source = submission.read_notebook(content_root() / "source/ch05/architecture.ipynb")
    cells = {submission.grade_id(cell): cell for cell in case.make_submission(source, source).cells}
    namespace: dict[str, Any] = {}
    for name in ("architecture-given", "architecture-solution"):
        exec(cells[name].source.replace("%load_ext course", ""), namespace)
    return namespace["design"]


@pytest.mark.timeout(400)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_drives_or_says_why_not(case: Any) -> None:
    with course.Session(sim_time=True) as session:
        world = session.world("warehouse")
        trip = load_design(case).drive(world, to="dock")
        session.sim.advance(DRIVEN_S, step=0.05)
        ran_off = world.simulation.describe_moment()["robot"]["x"] > 2.0
        assert ran_off or trip.gaps, trip
        assert [error for error in session.errors if "WorkingNode" in str(error)] == []
