"""Kill the engine at random moments, a hundred times, and compare the grades in the end.

Run it as ``python -m tests.benchmarks.kills --kills 100`` in the root of the repository; ``--json``
prints the figures for machines, ``--seed`` repeats a run's moments. A small class is graded once
undisturbed; then again and again by engines that are ended at a random moment (``kill -9`` of the
engine or of its whole process group, Ctrl-C, ``kill``) and started again until the class is done.
Every second class has its outcomes already, so that the moments fall into the entering of grades.
After every end the gradebook must be whole, no process left, and no kept outcome made again; at
the end of every class the grades must be those of the undisturbed run. ``--workers`` compares in
addition the grades of so many notebooks at a time.
"""

from __future__ import annotations

import argparse
import json
import random
import signal
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

import nbformat

from autograder import corpus
from autograder.assignments import submission
from autograder.assignments.build_notebooks import build
from autograder.corpus.trials import one_notebook
from autograder.gradebook.course_gradebook import Grade
from autograder.gradebook.release import make_release
from tests.killing import Engine, LostError, copy_outcomes, episode, fresh_copy

ASSIGNMENT, NOTEBOOK = "ch05", "qos-design"
CASES = ("right-chapter", "right-sensor-data", "wrong-stub", "broken-syntax")
SIGNALS = [signal.SIGKILL] * 4 + [signal.SIGINT, signal.SIGTERM]


@dataclass
class Figures:
    """What came out: how often an engine was ended at work, and what did not survive."""

    seed: int
    kills: dict[str, int] = field(default_factory=dict)
    classes: int = 0
    undisturbed_seconds: float = 0.0
    seconds: float = 0.0
    lost: list[str] = field(default_factory=list)
    workers: dict[int, bool] = field(default_factory=dict)


def class_root(folder: Path) -> Path:
    """Return a course in which a small class has handed in one exercise."""
    root = one_notebook(folder, "qos", ASSIGNMENT)
    build(root)
    make_release(root, ASSIGNMENT)
    cases = {case.name: case for case in corpus.load_cases("qos")}
    source, released = (
        submission.read_notebook(root / step / ASSIGNMENT / f"{NOTEBOOK}.ipynb")
        for step in ("source", "release")
    )
    for name in CASES:
        own = root / "submitted" / name / ASSIGNMENT
        own.mkdir(parents=True)
        nbformat.write(cases[name].make_submission(source, released), own / f"{NOTEBOOK}.ipynb")
    return root


def run(kills: int, workers: list[int], figures: Figures, folder: Path) -> None:
    """Do it all, noting what is found in ``figures``."""
    chance = random.Random(figures.seed)
    ungraded = class_root(folder / "ungraded")
    first = Engine(fresh_copy(ungraded, folder / "undisturbed"), ASSIGNMENT, folder / "scratch")
    figures.undisturbed_seconds = timed(first)
    expected = first.grades()
    for count in workers:
        engine = Engine(
            fresh_copy(ungraded, folder / "course"), ASSIGNMENT, folder / "scratch", jobs=count
        )
        engine.finish()
        figures.workers[count] = engine.grades() == expected
    entering = 0.0
    while sum(figures.kills.values()) < kills:
        root = fresh_copy(ungraded, folder / "course")
        engine = Engine(root, ASSIGNMENT, folder / "scratch")
        if figures.classes % 2:
            copy_outcomes(first.root, root)
            entering = entering or timed(Engine(fresh_copy(root, folder / "e"), ASSIGNMENT,
                                                folder / "scratch"))  # fmt: skip
        longest = entering if figures.classes % 2 else figures.undisturbed_seconds
        left = kills - sum(figures.kills.values())
        survive(engine, chance, longest, min(left, 8), figures, expected)
        figures.classes += 1
        sys.stderr.write(f"{sum(figures.kills.values())} of {kills} kills\n")


def survive(
    engine: Engine,
    chance: random.Random,
    longest: float,
    most: int,
    figures: Figures,
    expected: dict[str, Grade],
) -> None:
    """Kill one class's engines, let the last one finish, and note what is lost."""
    try:
        signals = [chance.choice(SIGNALS) for _ in range(most)]
        for ended in episode(engine, chance, longest, signals):
            figures.kills[ended] = figures.kills.get(ended, 0) + 1
        before = engine.outcomes()
        engine.finish()
        engine.check(before)
        if engine.grades() != expected:
            figures.lost.append(f"class {figures.classes}: other grades: {engine.grades()}")
    except LostError as error:
        figures.lost.append(f"class {figures.classes}: {error}")


def timed(engine: Engine) -> float:
    """Return how many seconds an engine takes to its end."""
    started = time.monotonic()
    engine.finish()
    return round(time.monotonic() - started, 1)


def main() -> int:
    """Run the command; returns 1 if anything was lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(10**6))
    parser.add_argument("--workers", type=int, nargs="*", default=[])
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    figures = Figures(options.seed)
    started = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="kills-") as folder:
        run(options.kills, options.workers, figures, Path(folder))
    figures.seconds = round(time.monotonic() - started, 1)
    if options.json:
        sys.stdout.write(json.dumps(asdict(figures)) + "\n")
    else:
        for name, value in asdict(figures).items():
            sys.stdout.write(f"{name}: {value}\n")
    return bool(figures.lost) or not all(figures.workers.values())


if __name__ == "__main__":
    sys.exit(main())
