"""What a sandbox costs a submission, and how long an attack delays its neighbour.

Run it as ``python -m tests.benchmarks.bench_sandbox`` for the cost: the same right submission is
graded in a sandbox and without one, by turns. ``--attacks`` shows for each attack of
``tests/hostile`` (or those that are named) how much longer a right submission takes beside it than
beside another right one, by turns as well. Nothing here is a test: timing is shown, never asserted.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from autograder import sandbox
from autograder.examination.program import Program
from autograder.running import runner
from tests.hostile.test_hostile import SEED, Attack, Class, attacks, class_in

RIGHT = "right-chapter"


def seconds(run: Callable[[], object]) -> float:
    """Return how long a function takes."""
    began = time.monotonic()
    run()
    return time.monotonic() - began


def beside(class_: Class, other: Program, seconds_a_cell: float) -> float:
    """Return how long a right submission takes while another one is graded."""
    with ThreadPoolExecutor(2) as pool:
        hostile = pool.submit(
            runner.run, other, hidden=[class_.root], cell_timeout=seconds_a_cell, seed=SEED
        )
        right = pool.submit(seconds, lambda: grade(class_.program(RIGHT), class_))
        hostile.result()
        return right.result()


def grade(program: Program, class_: Class, *, trust: bool = False) -> None:
    """Grade a submission, and require that nothing went wrong."""
    outcome = runner.run(program, hidden=[class_.root], trust=trust, seed=SEED)
    assert not outcome.has_grader_error


def cost(class_: Class, rounds: int) -> None:
    """Show what a submission takes in a sandbox and without, by turns."""
    program = class_.program(RIGHT)
    took: dict[bool, list[float]] = {False: [], True: []}
    for _ in range(rounds):
        for trust, found in took.items():
            found.append(seconds(lambda trust=trust: grade(program, class_, trust=trust)))  # type: ignore[misc]
    confined, bare = (statistics.median(took[trust]) for trust in (False, True))
    pairs = sorted(c - b for c, b in zip(took[False], took[True], strict=True))
    sys.stdout.write(
        f"in a sandbox {confined:.2f} s, without {bare:.2f} s: {statistics.median(pairs):+.2f} s "
        f"({pairs[0]:+.2f} to {pairs[-1]:+.2f} s in {rounds} pairs)\n"
    )


def delay(class_: Class, attack: Attack, rounds: int) -> float:
    """Return for how many s longer a right submission takes beside an attack, the median."""
    text = attack.text.replace("PORT", "9").replace("ROOT", repr(str(class_.root)))
    hostile, right = class_.program(attack.base, text, attack.exercise), class_.program(RIGHT)
    return statistics.median(
        beside(class_, hostile, attack.seconds) - beside(class_, right, attack.seconds)
        for _ in range(rounds)
    )


def main() -> None:
    """Show what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--attacks", nargs="*", metavar="NAME", help="all, if none is named")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        class_ = class_in(Path(folder))
        sandbox.warm_up()
        grade(class_.program(RIGHT), class_)
        if options.attacks is None:
            cost(class_, options.rounds)
        for attack in attacks() if options.attacks is not None else []:
            if not options.attacks or attack.name in options.attacks:
                sys.stdout.write(f"{attack.name}: {delay(class_, attack, options.rounds):+.1f} s\n")
                sys.stdout.flush()


if __name__ == "__main__":
    main()
