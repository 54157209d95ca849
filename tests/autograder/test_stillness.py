"""Proof that nothing is under way: threads that run and sleep, in two processes.

What is looked at is the process that looks, too: each test runs in one of its own, where no other
test has left a thread.
"""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from autograder.rigs.stillness import Stillness

BUSY = "import sys; print(flush=True)\nwhile True: pass"
ASLEEP = "import sys; print(flush=True); sys.stdin.read()"


@contextmanager
def process(program: str) -> Iterator[subprocess.Popen[bytes]]:
    running = subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with running:
        try:
            assert running.stdout is not None
            running.stdout.readline()
            yield running
        finally:
            running.kill()


def two_processes_that_sleep_are_still() -> None:
    with process(ASLEEP) as other:
        assert Stillness(other.pid).reached(timeout=30.0)


def a_process_that_computes_is_not() -> None:
    with process(BUSY) as other:
        assert not Stillness(other.pid).reached(timeout=0.2)


def a_thread_of_the_examiners_own_counts() -> None:
    stop = threading.Event()

    def compute(until: Callable[[], bool] = stop.is_set) -> None:
        while not until():
            pass

    thread = threading.Thread(target=compute)
    thread.start()
    try:
        with process(ASLEEP) as other:
            assert not Stillness(other.pid).reached(timeout=0.2)
            stop.set()
            thread.join()
            assert Stillness(other.pid).reached(timeout=30.0)
    finally:
        stop.set()
        thread.join()


def a_process_that_has_ended_leaves_the_examiners_own() -> None:
    with process(ASLEEP) as other:
        pass
    assert Stillness(other.pid).reached(timeout=30.0)


@pytest.mark.parametrize(
    "case",
    [
        two_processes_that_sleep_are_still,
        a_process_that_computes_is_not,
        a_thread_of_the_examiners_own_counts,
        a_process_that_has_ended_leaves_the_examiners_own,
    ],
)
def test_stillness(case: Callable[[], None]) -> None:
    ran = subprocess.run(
        [sys.executable, __file__, case.__name__], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr


if __name__ == "__main__":
    globals()[sys.argv[1]]()
