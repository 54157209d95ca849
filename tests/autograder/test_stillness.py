"""Proof that nothing is under way: threads that run and sleep, in two processes."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

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


def test_two_processes_that_sleep_are_still() -> None:
    with process(ASLEEP) as other:
        assert Stillness(other.pid).reached(timeout=30.0)


def test_a_process_that_computes_is_not() -> None:
    with process(BUSY) as other:
        assert not Stillness(other.pid).reached(timeout=0.2)


def test_a_thread_of_the_examiners_own_counts() -> None:
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


def test_a_process_that_has_ended_leaves_the_examiners_own() -> None:
    with process(ASLEEP) as other:
        pass
    assert Stillness(other.pid).reached(timeout=30.0)
