"""Chapter 5 as its tests need it: its cells, a learner's right answers, and what must be seen.

The chapter shows no asserts to a reader. What each of its cells must have come to stands here, and
is put behind the cell in the copy that the tests run.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import jupytext
import nbformat
from nbformat import NotebookNode

SOURCE = (
    Path(__file__).parents[2] / "notebooks/authoring/chapters/ch05-building-blocks.py"
)  # fmt: skip

ANSWERS = {
    "command.linear.x = 0.0": "command.linear.x = 0.3",
    "...  # YOURS: self.publisher": "self.publisher",
    '# YOURS: session.stop("nearest")': 'session.stop("nearest")',
    'topic = "scans"': 'topic = "scan"',
    "requested = ReliabilityPolicy.RELIABLE": "requested = ReliabilityPolicy.BEST_EFFORT",
    "wanted = DurabilityPolicy.VOLATILE": "wanted = DurabilityPolicy.TRANSIENT_LOCAL",
    "depth = 1  # YOURS": "depth = 5",
    "my_guess = ...": "my_guess = 200",
    "my_text = ...": "my_text = 'Button pressed'",
    "request = SetBool.Request(data=False)": "request = SetBool.Request(data=True)",
    "...  # YOURS: response.message": "response.message",
    "own_group = False": "own_group = True",
    "order = 5": "order = 7",
    "# long_goal.cancel": "long_goal.cancel",
    'vital signs all day": ...': 'vital signs all day": "topic"',
    'one particular lab result": ...': 'one particular lab result": "service"',
    'from start to finish": ...': 'from start to finish": "action"',
    "nodes_in_the_diagram = ...": "nodes_in_the_diagram = 7",
    "seconds = 5.0": "seconds = 10.0",
    "command.angular.z = 0.0": "command.angular.z = speed / radius",
}
"""What a learner changes, and into what: the first of each pair is there once."""

EXPECTED = {
    "check.robot_drives": "assert 0.1 < seen['nearest'] < 10.0",
    "image = session.next_message": "assert (image.width, image.height) == (160, 120)",
    "offered = {}": """
assert offered == {
    "camera/data": ("BEST_EFFORT", "VOLATILE"),
    "emergency/stop": ("RELIABLE", "VOLATILE"),
    "environment/data": ("RELIABLE", "VOLATILE"),
}""",
    "lab.sim.advance(20.0)": (
        'assert arrived == {"camera/data": 200, "emergency/stop": 20, "environment/data": 10}'
    ),
    "asked_for = {}": """
assert asked_for == {
    "camera/data": "BEST_EFFORT",
    "emergency/stop": "RELIABLE",
    "environment/data": "BEST_EFFORT",
}
processed = crew.next_message(String, "processed/data", timeout=30.0).data
assert processed.startswith("Processed: Camera frame")
assert processed.endswith("- RGB-D data - Objects detected")""",
    "crew.run(ServiceNode)": """
assert state.success
assert state.message == "Robot is operational - Mode: True"
assert mode.message in ("Robot mode set to: ACTIVE", "Robot mode set to: STANDBY")""",
    "class AskingNode": "assert asking.answers == [None] or asking.answers[0].success",
    "goal.wait(timeout=60.0)\nfor feedback": """
assert goal.status == GoalStatus.STATUS_SUCCEEDED
assert list(goal.result.sequence)[:6] == [0, 1, 1, 2, 3, 5]
assert [len(one.sequence) for one in goal.feedback][:4] == [3, 4, 5, 6]""",
    "zero = crew.send_goal": """
assert long_goal.status in (GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_CANCELED)
assert list(zero.result.sequence) == [0]
assert zero.status == GoalStatus.STATUS_SUCCEEDED
assert not absurd.accepted""",
    "observer = outside.run": """
assert frame.data.endswith("Objects detected")
assert answer.message == "Robot is operational - Mode: True\"""",
    "first_round = {": "assert crew.errors == []",
    "report = crew.close()": "assert not report.leaked and not outside_report.leaked and not left",
    "class DrivingActionNode": "assert system.errors == []",
    "system_report = system.close()": "assert not system_report.leaked",
    "%ros node list": """
import threading

assert session.errors == []
mine = f"ROS domain {session.domain_id} "
threads = [f"{thread.name} " for thread in threading.enumerate()]
assert not [name for name in threads if name.startswith("ROS domain") and mine not in name]""",
}
"""What must hold behind a cell, whether or not the learner has answered: {part of it: asserts}."""


def read_chapter() -> NotebookNode:
    """Return the chapter as it is written."""
    return jupytext.read(SOURCE)


def tags(cell: NotebookNode) -> list[str]:
    """Return a cell's tags."""
    return list(cell.metadata.get("tags", []))


def with_answers(chapter: NotebookNode) -> NotebookNode:
    """Return a copy in which a learner has done all that there is to do."""
    notebook = nbformat.from_dict(chapter)
    for before, after in ANSWERS.items():
        [cell] = [cell for cell in notebook.cells if is_try(cell) and before in cell.source]
        assert cell.source.count(before) == 1
        cell.source = cell.source.replace(before, after)
    return notebook


def is_try(cell: NotebookNode) -> bool:
    """Return whether a cell has something for the learner to change, and a check of it."""
    return "try" in tags(cell)


def with_asserts(chapter: NotebookNode, verdict: bool) -> NotebookNode:
    """Return a copy with the asserts behind its cells, and each check's verdict asserted, too."""
    notebook = nbformat.from_dict(chapter)
    cells = []
    for cell in notebook.cells:
        cells.append(cell)
        if cell.cell_type != "code":
            continue
        lines = [text for part, text in EXPECTED.items() if part in cell.source]
        if is_try(cell):
            lines.append(f"assert _.passed is {verdict}, _")
        if lines:
            # `_` is what the cell before came to: it has to be looked at first.
            cells.append(nbformat.v4.new_code_cell("\n".join(reversed(lines))))
    notebook.cells = cells
    return notebook


def environment() -> dict[str, str]:
    """Return what a child needs: the warnings filter of this run is not the child's."""
    return {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST_", "PYTHONWARN"))}


def run_with_nbval(notebook: NotebookNode, path: Path) -> subprocess.CompletedProcess[str]:
    """Write a notebook and run all of its cells, in a kernel of their own."""
    nbformat.write(notebook, path)
    return subprocess.run(
        [sys.executable, "-m", "pytest", "--nbval-lax", "-q", "-p", "no:cacheprovider", path],
        cwd=path.parent,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=380,
        check=False,
    )
