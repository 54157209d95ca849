"""A check in a kernel as other machines have it: ports beside the usual ones, or no Linux."""

from __future__ import annotations

import pytest

from tests.benchmarks.bench_student_cost import solved_cells
from tests.kernel import Kernel

FULL_HOST = "from course.runtime.domains import port_bases; port_bases.settle(7474)"
NO_LINUX = "import os; os.environ['COURSE_PORTABLE'] = '1'"


@pytest.mark.parametrize("first", [FULL_HOST, NO_LINUX])
def test_the_first_check_finds_a_right_answer(first: str) -> None:
    kernel = Kernel()
    try:
        assert kernel.run(first) == ("ok", [])
        for cell in solved_cells():
            kernel.run(cell)
        _, shown = kernel.run("from autograder import check\nprint('points', check('qos'))")
    finally:
        kernel.close()
    assert ("stdout", "points 10.0\n") in shown
