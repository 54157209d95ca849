"""``%%interface`` in a real kernel: what a learner sees."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from course.interfaces.building.toolchain import compiler_problem
from tests.left_out import leave_out

SETUP = """
from course import interfaces
from course.interfaces import magic
interfaces.install()
magic.register(get_ipython())
"""


def run(cells: list[str], folder: Path) -> list[list[Any]]:
    """Run cells in a kernel and return the outputs of each."""
    notebook = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_code_cell(source) for source in [SETUP, *cells]]
    )
    client = NotebookClient(
        notebook,
        timeout=120,
        kernel_name="python3",
        allow_errors=True,
        resources={"metadata": {"path": str(folder)}},
    )
    client.execute()
    assert notebook.cells[0].outputs == []
    return [cell.outputs for cell in notebook.cells[1:]]


def test_an_import_that_builds_says_so_before_and_only_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if problem := compiler_problem():
        leave_out(problem)
    monkeypatch.setenv("COURSE_INTERFACES_CACHE", str(tmp_path / "cache"))
    said = "print('imported')\nfrom example_interfaces.srv import SetBool\nprint(SetBool.__name__)"
    first, again = run([said], tmp_path)[0], run([said], tmp_path)[0]
    text = "".join(output.text for output in first)
    assert text.index("example_interfaces is being compiled on this machine") < text.index(
        "SetBool"
    )
    assert "once: it is kept for the next time." in text
    assert "".join(output.text for output in again) == "imported\nSetBool\n"


def only_error(outputs: list[Any]) -> str:
    """Return the sentence of a failed cell, which shows nothing else."""
    (output,) = outputs
    assert output.output_type == "error"
    assert output.traceback == [f"{output.ename}: {output.evalue}"]
    return str(output.evalue)


@pytest.mark.usefixtures("here")
def test_cells_define_types_and_say_how_to_import_them(tmp_path: Path) -> None:
    ready, use, wrong, bad_name, changed, same, help_text = run(
        [
            "%%interface robot_msgs/srv/GetPose\nstring robot\n---\ngeometry_msgs/Pose pose\n",
            "from robot_msgs.srv import GetPose\nGetPose.Request(robot='r2').robot",
            "%%interface robot_msgs/msg/Wrong\nint32 first\nfloat65 second\n",
            "%%interface robot_msgs/GetPose\nint32 x\n",
            "%%interface robot_msgs/srv/GetPose\nstring robot\nint32 n\n---\n",
            "%%interface robot_msgs/srv/GetPose\nstring robot\n---\ngeometry_msgs/Pose pose\n",
            "get_ipython().find_cell_magic('interface').__doc__.splitlines()[0]",
        ],
        tmp_path,
    )
    said = "robot_msgs/srv/GetPose is ready: from robot_msgs.srv import GetPose\n"
    for outputs in (ready, same):
        (output,) = outputs
        assert (output.name, output.text) == ("stdout", said)
    assert use[0].data["text/plain"] == "'r2'"
    assert only_error(wrong) == (
        "robot_msgs/msg/Wrong, line 2 (`float65 second`): there is no type float65; "
        "did you mean float64 or float32?"
    )
    assert "write package/kind/Name" in only_error(bad_name)
    assert "restart the kernel" in only_error(changed)
    assert "importable" in help_text[0].data["text/plain"]


def test_without_a_compiler_a_kernel_says_so_in_a_sentence(
    environment: dict[str, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("COURSE_INTERFACES_CACHE", environment["COURSE_INTERFACES_CACHE"])
    monkeypatch.setenv("PATH", "/nonexistent")
    ready, again, lacking = run(
        [
            "from example_interfaces.srv import SetBool",
            "from example_interfaces.action import Fibonacci",
            "from example_interfaces.srv import AddTwoInts",
        ],
        tmp_path,
    )
    assert ready[0].name == "stdout"
    assert ready[0].text.startswith("Note: example_interfaces could not be built")
    assert again == []
    assert only_error(lacking).startswith("example_interfaces/srv/AddTwoInts is not available")
