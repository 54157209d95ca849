"""How long a check takes in a student's notebook: right designs, the untouched stub, wrong ones.

Run it as ``python -m tests.benchmarks.bench_checks`` on a machine with nothing else to do;
``--json`` prints the figures for machines. Each case of the corpus is a notebook in a kernel of its
own, as a student has it, and the cell of the visible check is timed once. Nothing here is a test:
timing is shown, never asserted.
"""

from __future__ import annotations

import argparse
import itertools
import json
import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass

from autograder.assignments import submission
from autograder.corpus import corpus_files
from autograder.corpus.case import Case
from autograder.corpus.trials import Notebooks, make_notebooks
from autograder.util import exercise_folders
from tests.kernel import Kernel


@dataclass(frozen=True)
class Timing:
    """How many seconds the check's cell took for one case, of kind right, stub or wrong."""

    exercise: str
    case: str
    kind: str
    seconds: float


def time_check(case: Case, notebooks: Notebooks) -> float:
    """Run the notebook of a case in a new kernel; return the seconds of its visible check."""
    kernel = Kernel()
    try:
        for cell in case.make_submission(*notebooks).cells:
            if cell.cell_type != "code":
                continue
            start = time.perf_counter()
            kernel.run(cell.source)
            if submission.grade_id(cell).endswith("-visible"):
                return time.perf_counter() - start
    finally:
        kernel.close()
    raise LookupError(f"The notebook of {case.exam} has no cell of a visible check.")


def pick_cases(exercise: str, of_each: int) -> Iterator[tuple[str, Case]]:
    """Yield the kind and the case: the stub, and ``of_each`` of the right and the wrong ones."""
    stub = Case(exercise, "stub", "the untouched notebook", frozenset())
    yield "stub", stub
    cases = corpus_files.load_cases(exercise)
    for kind in ("right", "wrong"):
        found = [case for case in cases if case.name.startswith(kind)]
        step = max(1, len(found) // of_each)
        yield from ((kind, case) for case in itertools.islice(found[::step], of_each))


def main() -> None:
    """Time them all and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--exercise", action="append", help="only this one; may be repeated")
    parser.add_argument("--cases", type=int, default=6, help="right and wrong cases of each")
    chosen = parser.parse_args()
    timings: list[Timing] = []
    for exercise in chosen.exercise or sorted(exercise_folders.current_exercises().folders):
        notebooks = make_notebooks(exercise)
        for kind, case in pick_cases(exercise, chosen.cases):
            timings.append(Timing(exercise, case.name, kind, time_check(case, notebooks)))
    if chosen.json:
        sys.stdout.write(json.dumps([asdict(timing) for timing in timings], indent=2) + "\n")
        return
    sys.stdout.write(f"{'exercise':14}{'kind':7}{'median s':>9}{'most s':>8}  slowest\n")
    by_kind = itertools.groupby(timings, key=lambda timing: (timing.exercise, timing.kind))
    for (exercise, kind), group in by_kind:
        taken = list(group)
        slowest = max(taken, key=lambda timing: timing.seconds)
        median = statistics.median(timing.seconds for timing in taken)
        sys.stdout.write(
            f"{exercise:14}{kind:7}{median:9.1f}{slowest.seconds:8.1f}  {slowest.case}\n"
        )


if __name__ == "__main__":
    main()
