"""What exercises tell students to try works on the exemplar, word for word, and does something."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from nbformat import NotebookNode

from autograder.assignments import submission
from autograder.assignments.cells import without_markers
from course.workspace.content import content_root
from tests.kernel import Kernel

TEXT_WORDS = 200
"""Words above the fine print, code not counted: the first screen of an exercise."""

Run = Callable[[str], str]


@pytest.fixture
def run() -> Iterator[Run]:
    """Return a function that runs a cell in a kernel, and returns what it has shown."""
    kernel = Kernel()

    def run_cell(source: str) -> str:
        status, said = kernel.run(source)
        assert status == "ok", said
        assert not [text for kind, text in said if kind == "stderr"], said
        return "\n".join(text for _, text in said)

    yield run_cell
    kernel.close()


def read(name: str) -> NotebookNode:
    return submission.read_notebook(content_root() / "source" / "ch05" / f"{name}.ipynb")


def run_work(run: Run, name: str, *, stub: bool = False) -> list[str]:
    """Run an exercise's cells with its exemplar, or as handed out; return its cells to try."""
    notebook, code = read(name), re.compile(r"```python\n(.*?)```", re.DOTALL)
    for cell in notebook.cells:
        if cell.cell_type == "code" and "check(" not in cell.source:
            solution = re.compile(r"[ ]*### BEGIN SOLUTION.*?### END SOLUTION\n?", re.DOTALL)
            run(solution.sub("", cell.source) if stub else without_markers(cell.source))
    (text,) = (cell.source for cell in notebook.cells if "## Try it" in cell.source)
    return code.findall(text)


def value_of(run: Run, expression: str) -> Any:
    """Return what an expression gives in the kernel: numbers, texts, lists of these."""
    return ast.literal_eval(run(f"print(repr({expression}))"))


@pytest.mark.parametrize("name", ["architecture", "patterns", "resources", "error-handling"])
def test_the_first_screen_is_short(name: str) -> None:
    above, _ = "\n".join(
        cell.source for cell in read(name).cells if cell.cell_type == "markdown"
    ).split("<details>", 1)
    text = re.sub(r"```.*?```|!\[.*?\]\(.*?\)", "", above, flags=re.DOTALL)
    assert len(re.findall(r"\S*\w\S*", text)) <= TEXT_WORDS


def test_exercise_3_has_a_robot_on_its_line_and_five_instruments_beside_it(run: Run) -> None:
    (cell,) = run_work(run, "patterns")
    run(cell)
    run("panel = _")
    assert value_of(run, "[view.label for view in panel.views]") == [
        "World", "Action view", "Service console", "Parameter panel", "Timeline", "Timeline",
    ]  # fmt: skip
    run("panel.views[1].send(order=1)\npanel.views[2].call()")
    run("course.until(lambda: panel.views[1].goals and panel.views[1].goals[-1].is_over, 60)")
    run("course.until(lambda: panel.views[2].calls[-1].answer, 60)")
    assert "SUCCEEDED" in run("print(panel.views[1].words())")
    assert value_of(run, "world.make_frame()['robot']['x']") >= 1.2 + 1.0
    assert "% left" in run("print(panel.views[4].words())")


def test_exercise_3_takes_the_stub_as_it_is_handed_out(run: Run) -> None:
    (cell,) = run_work(run, "patterns", stub=True)
    run(cell)
    assert value_of(run, "[view.label for view in _.views]").count("Timeline") == 4
    (command,) = re.findall(
        r"`(%ros [^`]*)`", next(c.source for c in read("patterns").cells if "Try it" in c.source)
    )
    run(command.replace("\n", " "))
    run("course.until(lambda: world.make_frame()['robot']['speed'] > 0.4, 60)")


@pytest.mark.parametrize("stub", [False, True])
def test_exercise_4_shows_what_lives_leave_behind(run: Run, stub: bool) -> None:
    (cell,) = run_work(run, "resources", stub=stub)
    assert "left behind" in run(cell)
    threads, files, ends = value_of(run, "[sum(each) for each in zip(*_.left)]")
    assert ends == 0
    if stub:
        assert threads >= 3, "a notebook's own threads come and go"
        assert files >= 8
    else:
        assert threads <= 1
        assert files <= 1


PRESS = "world.handle_control({{'fault': {}}})"
"""What a button of the world sends."""

ADVANCE = "course.session().sim.advance({})"
OUTCOMES = """
grips = course.record('grip/outcome', String)
drives = course.record('navigate/outcome', String)
faults = course.record('drive/fault', String)
"""


def test_exercise_5_fails_as_the_buttons_say(run: Run) -> None:
    panel, requests = run_work(run, "error-handling")
    run("import course\ncourse.session(sim_time=True)")
    run(panel)
    run(OUTCOMES)
    words = "[stamped.message.data for stamped in {}.messages]"
    for state, outcome, navigator, end in (
        ("works", "done", "works", "arrived"),
        ("slow", "failed", "rejects", "rejected"),
        ("dead", "failed", "stalls", "stalled"),
        ("refuses", "refused", "dead", "lost"),
        ("works", "done", "aborts", "aborted"),
    ):
        run("world.reset()")
        run(PRESS.format(["gripper", state]))
        run(PRESS.format(["navigator", navigator]))
        run(requests)
        run(ADVANCE.format(9.0))
        assert value_of(run, words.format("grips"))[-1] == outcome, state
        assert value_of(run, words.format("drives"))[-1] == end, navigator
        assert value_of(run, "world.make_frame()['robot']['speed']") == 0.0


def test_exercise_5_hears_of_jammed_wheels_and_of_limits(run: Run) -> None:
    panel, _ = run_work(run, "error-handling")
    run("import course\ncourse.session(sim_time=True)")
    run(panel)
    run(OUTCOMES)
    run("goal = course.send_goal(Drive, 'drive', Drive.Goal(order=8))")
    run(ADVANCE.format(2.0))
    assert value_of(run, "world.make_frame()['robot']['speed']") > 0.9
    run(PRESS.format(["wheels", "jammed"]))
    run(ADVANCE.format(2.0))
    assert "ABORTED" in run("goal.wait()\nprint(goal.status)")
    assert "jammed" in value_of(run, "faults.messages[-1].message.data")
    run(PRESS.format(["wheels", "free"]))
    run(
        "from rcl_interfaces.msg import Parameter, ParameterValue\n"
        "value = ParameterValue(type=3, double_value=0.3)\n"
        "limit = Parameter(name='linear', value=value)\n"
        "request = SetParametersAtomically.Request(parameters=[limit])\n"
        "assert course.call(SetParametersAtomically, 'speed/set', request).result.successful\n"
        "course.until(lambda: '0.3 m/s' in world.words())"
    )
    run("goal = course.send_goal(Drive, 'drive', Drive.Goal(order=5))")
    run(ADVANCE.format(2.0))
    assert value_of(run, "world.make_frame()['robot']['speed']") == 0.3
