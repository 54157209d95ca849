"""What a student costs: memory by part, and the processor time of a check.

Run it as ``python -m tests.benchmarks.bench_student_cost``. A JupyterLab starts, and a real kernel
does, step by step, what a student does. After each step it is seen what its processes hold:
proportional set size (PSS), in which a page that several share is counted once in all. The table is
reckoned from that for classes of 30, 100 and 300, each student with one server and one notebook.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path

import psutil

from tests.kernel import Kernel

ROOT = Path(__file__).parents[2]
EXERCISE = ROOT / "notebooks/source/ch05/qos-design.ipynb"
CLASSES = (30, 100, 300)
AT_ONCE = 0.1  # of a class whose checks run at the same moment
MINUTES_BETWEEN_CHECKS = 5
LOOK_S = 0.2

STEPS = {
    "kernel": "pass",
    "session": (
        "import course\nfrom rclpy.node import Node\n"
        "node = course.session().run(lambda: Node('one'))"
    ),
    "world view": "world = course.world('warehouse'); world",
}


def tree_memory_mb(process: psutil.Process) -> float:
    """Return what a process and all that it has started hold, in MB."""
    held, tree = 0.0, [process]
    with suppress(psutil.Error):  # it has just ended
        tree += process.children(recursive=True)
    for one in tree:
        with suppress(psutil.Error):
            held += one.memory_full_info().pss / 2**20
    return held


def tree_seconds(process: psutil.Process) -> float:
    """Return the processor time of a process and of those that it has started and seen end."""
    times = process.cpu_times()
    return float(times.user + times.system + times.children_user + times.children_system)


class Peak:
    """The most memory that a tree of processes held at once, looked at five times a second."""

    def __init__(self, process: psutil.Process) -> None:
        """Begin to look."""
        self.most_mb = 0.0
        self._process = process
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self._thread.start()

    def _look(self) -> None:
        while not self._over.wait(LOOK_S):
            self.most_mb = max(self.most_mb, tree_memory_mb(self._process))

    def end(self) -> float:
        """Look no more; return the peak in MB."""
        self._over.set()
        self._thread.join()
        return self.most_mb


def solved_cells() -> list[str]:
    """Return the code of the first exercise with its solution, up to its check."""
    notebook = json.loads(EXERCISE.read_text(encoding="utf-8"))
    cells = ["".join(c["source"]) for c in notebook["cells"] if c["cell_type"] == "code"]
    return cells[: next(n for n, cell in enumerate(cells) if 'check("qos")' in cell)]


def server_memory_mb() -> float:
    """Return what a JupyterLab holds when it is ready, and nobody has opened anything."""
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--port=0"]
    with tempfile.TemporaryDirectory() as folder:
        server = subprocess.Popen(command, cwd=folder, text=True, stderr=subprocess.PIPE)
        try:
            assert server.stderr is not None
            next(line for line in server.stderr if "http://" in line)
            return tree_memory_mb(psutil.Process(server.pid))
        finally:
            server.terminate()
            server.communicate()


def measure() -> dict[str, float]:
    """Return MB by part, and "check (s)" and "check (processor s)"."""
    server = server_memory_mb()
    kernel = Kernel()
    try:
        process = psutil.Process(kernel.manager.provisioner.pid)
        found, before = {"JupyterLab's server": server}, 0.0
        for name, cell in STEPS.items():
            status, shown = kernel.run(cell)
            if status != "ok":
                raise RuntimeError(f"{name}: {shown}")
            held = tree_memory_mb(process)
            found[name], before = held - before, held
        for cell in solved_cells():
            kernel.run(cell)
        found["first cells"], before = tree_memory_mb(process) - before, tree_memory_mb(process)
        start, used, peak = time.monotonic(), tree_seconds(process), Peak(process)
        status, shown = kernel.run("from autograder import check\nprint('points', check('qos'))")
        most, used = peak.end(), tree_seconds(process) - used
        if not any("points 10" in text for _, text in shown):
            raise RuntimeError(f"The check found no right answer: {status}, {shown}")
        found["check (s)"] = time.monotonic() - start
        found["check, its examiner included"] = most - before
        found["check (processor s)"] = used
        return found
    finally:
        kernel.close()


def print_tables(found: dict[str, float]) -> None:
    """Print the parts, and what classes need."""
    idle = sum(found[name] for name in ("JupyterLab's server", *STEPS, "first cells"))
    lines = [f"{name:34} {value:8.1f}" for name, value in found.items()]
    lines += ["", "| students | memory (GB) | while a tenth check (GB) | cores for checks |"]
    lines += ["| --- | --- | --- | --- |"]
    for students in CLASSES:
        all_idle = students * idle / 1024
        busy = all_idle + students * AT_ONCE * found["check, its examiner included"] / 1024
        cores = students * found["check (processor s)"] / (60 * MINUTES_BETWEEN_CHECKS)
        lines.append(f"| {students} | {all_idle:.1f} | {busy:.1f} | {cores:.1f} |")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    print_tables(measure())
