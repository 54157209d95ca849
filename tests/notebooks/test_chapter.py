"""Chapter 5: every section is there, every cell behaves, and its program runs outside Jupyter."""

from __future__ import annotations

import ast
import itertools
import os
import re
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import jupytext
import nbformat
import pytest
from std_msgs.msg import String

from course import Session

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "notebooks" / "authoring" / "chapters" / "ch05-building-blocks.py"

SECTIONS = [
    "# Chapter 5: Nodes, Topics, Services - The Building Blocks of ROS 2",
    "## Introduction",
    "## Learning objectives",
    "## Hook",
    "## Before you learn this",
    "## Common misunderstanding",
    "## Concept",
    "### Nodes: the processing units",
    "### Topics: continuous data sharing (publish-subscribe)",
    "### Services: synchronous request-response",
    "### Actions: long-running operations with feedback",
    "### When to use what",
    "### Quality of Service (QoS) profiles",
    "## Real-world examples and analogies",
    "## Diagram",
    "## Code",
    "### SensorNode: topics with different QoS",
    "### ProcessingNode: subscribers that match",
    "### ServiceNode: answers on request",
    "### ActionNode: a long operation, with feedback",
    "### ClientNode: the one who asks",
    "### main: all five at once",
    "## Exercises",
    "## Exercise solutions",
    "## Summary",
    "## Part 2 Quiz",
    "## Preview: the next chapter",
]
NODE_CLASSES = ["SensorNode", "ProcessingNode", "ServiceNode", "ActionNode", "ClientNode"]
NOTES = {
    "blocking is the client's choice": "Waiting is the *client's* choice",
    "LIDAR, depth 1": "the *latest value*, not *every value*",
    "KEEP_ALL ignores the depth": "With `KEEP_ALL` the depth is ignored",
    "battery": "battery's topic transient-local with depth 1",
    "parameters are services": "read and written through services",
    "waiting in a callback": "holds a thread of the executor",
    "cancel and the executor": "a cancellation comes too late",
    "Ctrl-C": "that call raises an error",
    "order 5 is six numbers": "A goal of order 5 yields **six** numbers",
    "cancel_callback": "declines every one of them",
}


@pytest.fixture(scope="module")
def chapter() -> nbformat.NotebookNode:
    return jupytext.read(SOURCE)


@pytest.fixture(scope="module")
def prose(chapter: nbformat.NotebookNode) -> str:
    return "\n\n".join(cell.source for cell in chapter.cells if cell.cell_type == "markdown")


def tags(cell: nbformat.NotebookNode) -> list[str]:
    return list(cell.metadata.get("tags", []))


def headings(text: str) -> list[str]:
    return [line for line in text.splitlines() if re.match(r"#{1,3} ", line)]


def test_every_section_is_there_in_the_order_of_the_chapter(prose: str) -> None:
    assert headings(prose) == SECTIONS


def test_the_first_code_cell_loads_the_course(chapter: nbformat.NotebookNode) -> None:
    first = next(cell for cell in chapter.cells if cell.cell_type == "code")
    assert first.source.splitlines()[:2] == ["%load_ext course", "import course"]


@pytest.mark.parametrize("sentence", NOTES.values(), ids=NOTES.keys())
def test_each_correction_is_a_note_of_its_own_with_a_source(prose: str, sentence: str) -> None:
    quotes = re.findall(r"(?:^>.*\n?)+", prose, re.MULTILINE)
    notes = [re.sub(r"\s*\n>? ?", " ", quote) for quote in quotes]
    [note] = [note for note in notes if sentence in note]
    assert note.startswith("> **Note** ")
    if sentence != NOTES["order 5 is six numbers"]:  # arithmetic needs no authority
        assert re.search(r"Sources?: ", note)


def test_solutions_stand_in_tagged_cells_and_nowhere_else(chapter: nbformat.NotebookNode) -> None:
    solutions = [cell for cell in chapter.cells if "solutions" in tags(cell)]
    assert [headings(cell.source) for cell in solutions] == [["## Exercise solutions"]]
    rest = "\n".join(cell.source for cell in chapter.cells if cell not in solutions)
    assert "Path planner | map and goal" in solutions[0].source
    assert "Path planner | map and goal" not in rest
    assert "| IMU |" not in rest


def test_the_exercises_are_five_and_the_first_names_its_notebook(prose: str) -> None:
    exercises = prose.partition("## Exercises")[2].partition("## Exercise solutions")[0]
    assert re.findall(r"^\*\*(\d)\. ", exercises, re.MULTILINE) == list("12345")
    assert "`ch05/qos-design.ipynb`" in exercises


def test_the_quiz_has_five_questions_with_four_options_and_no_key(prose: str) -> None:
    quiz = prose.partition("## Part 2 Quiz")[2].partition("## Preview")[0]
    questions = re.split(r"^\*\*Question \d\. ", quiz, flags=re.MULTILINE)
    assert "**4 of 5**" in questions[0]
    assert "3.5" in questions[0]
    assert len(questions) == 6
    for question in questions[1:]:
        options = re.findall(r"^- ([A-D])\. ", question, re.MULTILINE)
        assert options == ["A", "B", "C", "D"]
    assert not re.search(r"correct|solution|key", quiz, re.IGNORECASE)


def test_the_diagram_is_mermaid_with_three_patterns(prose: str) -> None:
    [diagram] = re.findall(r"```mermaid\n(.*?)```", prose, re.DOTALL)
    for box in ("Camera Driver", "Image Processing", "Object Detection", "Navigation Client"):
        assert box in diagram
    for box in ("Path Planner", "Motion Client", "Navigation Server", "QoS"):
        assert box in diagram


def test_each_node_is_followed_by_a_cell_that_asserts_its_behaviour(
    chapter: nbformat.NotebookNode,
) -> None:
    code = [cell.source for cell in chapter.cells if cell.cell_type == "code"]
    for name in NODE_CLASSES:
        [place] = [i for i, source in enumerate(code) if f"class {name}(Node):" in source]
        show = code[place + 1]
        assert f"run({name})" in show
        assert "assert " in show


def test_no_cell_sleeps(chapter: nbformat.NotebookNode) -> None:
    for cell in chapter.cells:
        if cell.cell_type == "code":
            lines = [line for line in cell.source.splitlines() if not line.startswith("%")]
            tree = ast.parse("\n".join(lines))
            calls = {ast.unparse(n.func) for n in ast.walk(tree) if isinstance(n, ast.Call)}
            assert not calls & {"time.sleep", "sleep", "rclpy.spin", "input"}


@pytest.fixture(scope="module")
def notebook(tmp_path_factory: pytest.TempPathFactory, chapter: nbformat.NotebookNode) -> Path:
    path = tmp_path_factory.mktemp("chapter") / "ch05-building-blocks.ipynb"
    nbformat.write(chapter, path)
    return path


def environment() -> dict[str, str]:
    """What a child needs: the warnings filter of this run is not the child's."""
    return {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST_", "PYTHONWARN"))}


@pytest.mark.timeout(400)
def test_every_cell_passes_nbval(notebook: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "--nbval-lax", "-q", "-p", "no:cacheprovider", notebook],
        cwd=notebook.parent,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=380,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]


@pytest.fixture(scope="module")
def program(notebook: Path, prose: str) -> Path:
    """The chapter's program, exported by the very command that the chapter gives."""
    [command] = re.findall(r"jupyter nbconvert.*?=notebook-only", prose, re.DOTALL)
    arguments = command.replace("\\\n", " ").split()
    subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=notebook.parent,
        env=environment(),
        capture_output=True,
        timeout=120,
        check=True,
    )
    return notebook.parent / "building_blocks.py"


class Running:
    """A program in a process of its own, killed after ``deadline`` s whatever happens."""

    def __init__(self, path: Path, deadline: float) -> None:
        self.errors = path.with_suffix(".stderr")
        self._stderr: IO[str] = self.errors.open("w")
        self.process = subprocess.Popen(
            [sys.executable, "-u", path],
            cwd=path.parent,
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=self._stderr,
            text=True,
        )
        self._deadline = threading.Timer(deadline, self.process.kill)
        self._deadline.start()

    def lines(self) -> Iterator[str]:
        assert self.process.stdout is not None
        return iter(self.process.stdout)

    def domain(self) -> int:
        """The domain of the running system, once it says that it is operational."""
        seen = []
        for line in self.lines():
            seen.append(line)
            if found := re.search(r"operational on domain (\d+)", line):
                return int(found.group(1))
        raise AssertionError("".join(seen) + self.errors.read_text())

    def stop(self, number: signal.Signals) -> tuple[int, str]:
        """Send a signal; return the exit code and what was printed from then on.

        What has no handler for it yet is not spinning yet, and would just die of it.
        """
        deadline, never = time.monotonic() + 60, threading.Event()
        while not self._handles(number) and time.monotonic() < deadline:
            never.wait(0.05)
        self.process.send_signal(number)
        output = "".join(self.lines())
        return self.process.wait(), output

    def _handles(self, number: signal.Signals) -> bool:
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        [caught] = re.findall(r"^SigCgt:\s*([0-9a-f]+)$", status, re.MULTILINE)
        return bool(int(caught, 16) >> (number - 1) & 1)

    def close(self) -> None:
        self._deadline.cancel()
        self.process.kill()
        self.process.communicate()
        self._stderr.close()


def run(path: Path, deadline: float) -> Iterator[Running]:
    running = Running(path, deadline)
    try:
        yield running
    finally:
        running.close()


@pytest.fixture
def system(program: Path) -> Iterator[Running]:
    yield from run(program, 150)


def period(texts: list[str], pattern: str, unit: float = 1.0) -> float:
    """The median time between messages, in s, by the publisher's clock as the texts carry it."""
    stamps = [float(re.search(pattern, text).group(1)) * unit for text in texts]  # type: ignore[union-attr]
    return statistics.median(b - a for a, b in itertools.pairwise(stamps))


def test_the_program_publishes_at_its_rates_and_ends_on_ctrl_c(system: Running) -> None:
    with Session(domain_id=system.domain()) as outside:
        tapes = {
            topic: outside.record(topic, String)
            for topic in ("camera/data", "emergency/stop", "environment/data")
        }
        outside.until(
            lambda: tapes["environment/data"].count >= 3 and tapes["camera/data"].count >= 20,
            timeout=90.0,
            what="three readings and twenty frames of the program",
        )
        texts = {
            topic: [stamped.message.data for stamped in tape.messages]
            for topic, tape in tapes.items()
        }
    assert period(texts["camera/data"], r"frame (\d+)", 0.1) == pytest.approx(0.1, rel=0.2)
    assert period(texts["emergency/stop"], r"([\d.]+)$") == pytest.approx(1.0, rel=0.2)
    assert period(texts["environment/data"], r"([\d.]+)$") == pytest.approx(2.0, rel=0.2)

    code, output = system.stop(signal.SIGINT)
    assert code == 0
    assert "Shutting down" in output
    assert "Traceback" not in output
    assert system.errors.read_text() == ""


def test_the_program_ends_cleanly_in_the_middle_of_a_goal(system: Running) -> None:
    with Session(domain_id=system.domain()) as outside:
        outside.until(
            lambda: outside.next_message(String, "processed/data", timeout=60.0),
            timeout=60.0,
            what="the program to run",
        )
        from example_interfaces.action import Fibonacci

        goal = outside.send_goal(
            Fibonacci, "fibonacci_sequence", Fibonacci.Goal(order=40), timeout=60.0
        )
        outside.until(lambda: goal.feedback, timeout=60.0, what="the goal to be under way")
        code, output = system.stop(signal.SIGINT)
    assert code == 0
    assert "Traceback" not in output
    assert system.errors.read_text() == ""


@pytest.fixture
def plain_program(program: Path, prose: str) -> Path:
    """The five nodes, run as the note on a program without `course` says."""
    [note] = [quote for quote in re.findall(r"(?:^>.*\n?)+", prose, re.MULTILINE) if "```" in quote]
    [ending] = re.findall(r"> ```python\n(.*?)> ```", note, re.DOTALL)
    nodes = program.read_text(encoding="utf-8").partition("NODE_CLASSES =")[0]
    lines = [
        "import signal",
        "import rclpy",
        "from rclpy.executors import MultiThreadedExecutor",
        "from rclpy.signals import SignalHandlerOptions",
        *(line.removeprefix(">").removeprefix(" ") for line in ending.splitlines()),
    ]
    path = program.with_name("plain.py")
    path.write_text(nodes + "\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_ending_without_course_is_clean(
    plain_program: Path, number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Session() as outside:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(outside.domain_id))
        for running in run(plain_program, 150):
            outside.next_message(String, "processed/data", timeout=60.0)
            code, _ = running.stop(number)
            assert "Traceback" not in running.errors.read_text()
            assert code == 0


@pytest.mark.timeout(400)
def test_the_whole_notebook_also_runs_as_a_script(notebook: Path) -> None:
    script = notebook.with_name("whole.py")
    jupytext.write(jupytext.read(notebook), script, fmt="py:percent")
    for running in run(script, 300):
        running.domain()
        code, output = running.stop(signal.SIGTERM)
        assert code == 0
        assert "Callback errors: none" in output
        assert "Traceback" not in output
        assert running.errors.read_text() == ""
