"""How fast a class is graded: `autograder grade` against stock `nbgrader autograde`.

Run it as ``python tests/benchmarks/bench_grading.py``; ``--json`` prints the figures for machines.
A class is made from the corpus: every submission differs, so that nothing is graded just once. The
same released assignment and the same submissions are then graded by both, turn by turn in one run,
so that a busy machine is busy for both. Stock nbgrader executes each notebook, whose check cells
grade in its kernel; `autograder grade` also sandboxes every submission and writes feedback. Their
scores must be equal. ``--sizes 100,1000`` shows instead what one submission costs in classes of
these sizes, where all submissions of one case must have the same score. ``--keep FOLDER`` keeps the
courses whose scores differ. Nothing here is a test: timing is shown, never asserted.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

import nbformat

from autograder import corpus
from autograder.assignments import submission
from autograder.assignments.build_notebooks import build
from autograder.corpus import Case
from autograder.corpus.trials import one_notebook
from autograder.examination import points
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.release import make_release

MIB = 1024 * 1024
NEED_LOSS = {"camera_moves_on", "stop_repaired"}
"""Checks that a kernel cannot make, as nobody can lose its packets: there they cost no points."""
STOCK = """
c = get_config()
c.CourseDirectory.course_id = "stock"
c.Execute.timeout = 300
c.ClearSolutions.code_stub = {"python": "# Your work goes here."}
"""
"""nbgrader as it comes, but for the time that a check may take."""


@dataclass
class Run:
    """What grading a class took. Processor time and memory are those of all processes."""

    submissions: int
    wall: float
    cpu: float
    mean_mib: float
    peak_mib: float
    own_peak_mib: float
    load: float

    @property
    def rate(self) -> float:
        """Submissions a second."""
        return self.submissions / self.wall


class Memory:
    """Looks now and then at how much memory a process and all its descendants hold."""

    PERIOD = 5.0
    """Seconds. A look walks the page tables of dozens of processes: work on what it measures."""

    def __init__(self, pid: int) -> None:
        """Begin to look."""
        self._pid = pid
        self.own_peak = 0.0
        self._seen: list[float] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def stop(self) -> None:
        """Look no more."""
        self._over.set()
        self._thread.join()

    @property
    def mean(self) -> float:
        """What was held on average; the highest of many looks is higher than that of few."""
        return statistics.fmean(self._seen or [0.0])

    @property
    def peak(self) -> float:
        """The most that was seen."""
        return max(self._seen, default=0.0)

    def _run(self) -> None:
        while not self._over.wait(self.PERIOD):
            tree = list(descendants(self._pid))
            # Memory that processes share counts in parts.
            self._seen.append(sum(proportional(pid) for pid in tree))
            self.own_peak = max(self.own_peak, proportional(self._pid))


def descendants(pid: int) -> Iterator[int]:
    """Yield a process and all that descend from it."""
    yield pid
    for task in Path(f"/proc/{pid}/task").glob("*"):
        with suppress(OSError):
            for child in (task / "children").read_text().split():
                yield from descendants(int(child))


def proportional(pid: int) -> float:
    """Return a process's fair share of the memory it uses, in MiB."""
    with suppress(OSError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return int(line.split()[1]) / 1024
    return 0.0


@dataclass(frozen=True)
class Assignment:
    """A released assignment of one exercise, and what can be handed in for it."""

    root: Path
    name: str
    notebook: str
    cases: list[Case]

    def hand_in(self, number: int) -> Path:
        """Copy the course, with ``number`` submissions that all differ; return the copy."""
        root = Path(tempfile.mkdtemp(prefix="class-", dir=self.root.parent)) / "course"
        shutil.copytree(self.root, root)
        source, released = (
            submission.read_notebook(root / step / self.name / f"{self.notebook}.ipynb")
            for step in ("source", "release")
        )
        texts = [case.make_submission(source, released) for case in self.cases]
        for place, notebook in zip(range(number), itertools.cycle(texts)):
            folder = root / "submitted" / f"student{place:05}" / self.name
            folder.mkdir(parents=True)
            for cell in notebook.cells:
                if submission.nbgrader_metadata(cell).get("solution") and cell.cell_type == "code":
                    cell.source = f"{cell.source.partition(SIGNED)[0]}{SIGNED}{place}"
            nbformat.write(notebook, folder / f"{self.notebook}.ipynb")
        return root


ASSIGNMENT = "ch05"
SIGNED = "\n# handed in by student "


@contextmanager
def assignment(exercise: str) -> Iterator[Assignment]:
    """Build and release the assignment of one exercise in a folder of its own."""
    entry = points.table()[exercise]
    with tempfile.TemporaryDirectory(prefix="bench-grading-") as folder:
        root = one_notebook(Path(folder) / "course", exercise, ASSIGNMENT)
        build(root)
        make_release(root, ASSIGNMENT)
        # A cell that ends its process ends stock nbgrader's batch: that is not what is compared.
        cases = [
            case
            for case in corpus.load_cases(exercise)
            if not case.name.startswith("broken") and not case.must_fail & NEED_LOSS
        ]
        yield Assignment(root, ASSIGNMENT, entry.notebook, cases)


def grade(root: Path, command: list[str], number: int) -> Run:
    """Run a grading command in a course and return what it took."""
    load = os.getloadavg()[0]
    started = time.perf_counter()
    with (root / "output.txt").open("wb") as output:
        process = subprocess.Popen(command, cwd=root, stdout=output, stderr=output)
        memory = Memory(process.pid)
        try:
            _, status, usage = os.wait4(process.pid, 0)
        finally:
            memory.stop()
    wall = time.perf_counter() - started
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise SystemExit((root / "output.txt").read_text()[-3000:])
    cpu = usage.ru_utime + usage.ru_stime
    return Run(number, wall, cpu, memory.mean, memory.peak, memory.own_peak, load)


def ours(root: Path, name: str, number: int, jobs: int) -> Run:
    """Grade with `autograder grade`."""
    options = ["--jobs", str(jobs)] if jobs else []
    return grade(root, ["autograder", "grade", name, "--json", *options], number)


def stock(root: Path, name: str, number: int) -> Run:
    """Grade with nbgrader as it comes."""
    (root / "nbgrader_config.py").write_text(STOCK)
    return grade(root, ["nbgrader", "autograde", name, "--create"], number)


def scores(root: Path, name: str) -> dict[str, float]:
    """Return {student: points} of a graded course."""
    return {grade.student: grade.score for grade in CourseGradebook(root).read_grades(name)}


def case_of(given: Assignment, student: str) -> str:
    """Return which case of the corpus a student has handed in."""
    return given.cases[int(student.removeprefix("student")) % len(given.cases)].name


def put_away(root: Path, keep: Path | None) -> None:
    """Remove a graded course, or keep it."""
    if keep is None:
        shutil.rmtree(root.parent)
    else:
        keep.mkdir(parents=True, exist_ok=True)
        shutil.move(root.parent, keep)


def compare(
    given: Assignment, number: int, rounds: int, jobs: int, keep: Path | None
) -> dict[str, object]:
    """Grade a class by both, turn by turn; return the runs and the ratio of their throughputs."""
    pairs, differing = [], {}
    for turn in range(rounds):
        before = len(differing)
        roots = {name: given.hand_in(number) for name in ("ours", "stock")}
        runs = {}
        for name in roots if turn % 2 else reversed(roots):
            if name == "ours":
                runs[name] = ours(roots[name], given.name, number, jobs)
            else:
                runs[name] = stock(roots[name], given.name, number)
        pairs.append(runs)
        expected, actual = (scores(roots[name], given.name) for name in ("stock", "ours"))
        for student, score in expected.items():
            if actual.get(student) != score:
                differing[f"{student}, {case_of(given, student)}"] = {
                    "stock": score, "ours": actual.get(student),
                }  # fmt: skip
        for root in roots.values():
            put_away(root, keep if len(differing) > before else None)
    return {
        "runs": [{name: asdict(run) for name, run in pair.items()} for pair in pairs],
        "throughput ratio": statistics.median(p["ours"].rate / p["stock"].rate for p in pairs),
        "cpu ratio": statistics.median(p["stock"].cpu / p["ours"].cpu for p in pairs),
        "scores that differ": differing,
    }


def growth(given: Assignment, sizes: list[int], jobs: int, keep: Path | None) -> dict[str, object]:
    """Grade classes of growing size; return what one submission takes in each."""
    rows = {}
    by_case: dict[str, dict[float, list[str]]] = defaultdict(lambda: defaultdict(list))
    for number in sizes:
        root = given.hand_in(number)
        run = ours(root, given.name, number, jobs)
        for student, score in scores(root, given.name).items():
            by_case[case_of(given, student)][score].append(f"{student} of {number}")
        put_away(root, keep if any(len(found) > 1 for found in by_case.values()) else None)
        rows[str(number)] = {
            "s a submission": run.wall / number,
            "cpu s a submission": run.cpu / number,
            "mean MiB, all processes": run.mean_mib,
            "peak MiB, all processes": run.peak_mib,
            "peak MiB, the engine": run.own_peak_mib,
            "load": run.load,
        }
    differing = {
        case: {str(score): students[:5] for score, students in found.items()}
        for case, found in by_case.items()
        if len(found) > 1
    }
    return {"sizes": rows, "scores that differ": differing}


def shown(results: dict[str, object]) -> str:
    """Return the figures as text."""
    lines = []
    for number, pair in enumerate(results.get("runs", []), start=1):  # type: ignore[arg-type, var-annotated]
        for name, run in pair.items():
            count = run["submissions"]
            lines.append(
                f"round {number} {name:6} {count:5} submissions {run['wall']:8.1f} s, "
                f"{count / run['wall']:.3f}/s, cpu {run['cpu'] / count:.2f} s each, "
                f"peak {run['peak_mib']:.0f} MiB, load {run['load']:.1f}"
            )
    lines += [
        f"{name}: {value}" for name, value in results.items() if name not in ("runs", "sizes")
    ]
    for size, row in results.get("sizes", {}).items():  # type: ignore[attr-defined]
        lines.append(f"{size:>6}: " + ", ".join(f"{name} {v:.2f}" for name, v in row.items()))
    return "\n".join(lines)


def main() -> int:
    """Measure and print; returns 1 if the scores differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--exercise", default="architecture", help="whose notebook is graded")
    parser.add_argument("--students", type=int, default=8, help="submissions in the class")
    parser.add_argument("--rounds", type=int, default=2, help="turns of each side")
    parser.add_argument("--jobs", type=int, default=0, help="as for autograder grade")
    parser.add_argument("--sizes", help="sizes of classes, as in 100,1000: only ours, growing")
    parser.add_argument("--keep", type=Path, help="where courses go whose scores differ")
    options = parser.parse_args()
    with assignment(options.exercise) as given:
        if options.sizes:
            sizes = [int(size) for size in options.sizes.split(",")]
            results = growth(given, sizes, options.jobs, options.keep)
        else:
            results = compare(given, options.students, options.rounds, options.jobs, options.keep)
    results["cores"] = os.cpu_count()
    results["load at the end"] = os.getloadavg()[0]
    text = json.dumps(results, indent=2) if options.json else shown(results)
    sys.stdout.write(text + "\n")
    return 1 if results.get("scores that differ") else 0


if __name__ == "__main__":
    sys.exit(main())
