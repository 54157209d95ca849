"""Chapter 5's program: its five nodes run outside Jupyter, and end cleanly."""

from __future__ import annotations

import itertools
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

from .chapter_five import environment, read_chapter


@pytest.fixture(scope="module")
def notebook(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("chapter") / "ch05-building-blocks.ipynb"
    nbformat.write(read_chapter(), path)
    return path


@pytest.fixture(scope="module")
def prose(notebook: Path) -> str:
    cells = nbformat.read(notebook, as_version=4).cells
    return "\n\n".join(cell.source for cell in cells if cell.cell_type == "markdown")


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
    [ending] = re.findall(r"```python\n(.*?)```", prose, re.DOTALL)
    nodes = program.read_text(encoding="utf-8").partition("NODE_CLASSES =")[0]
    lines = [
        "import signal",
        "import rclpy",
        "from rclpy.executors import MultiThreadedExecutor",
        "from rclpy.signals import SignalHandlerOptions",
        *ending.splitlines(),
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
        assert "Leaked: nothing" in output  # of the finale, which comes after main
        assert "Traceback" not in output
        assert running.errors.read_text() == ""
