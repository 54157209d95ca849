"""Proof that nothing is under way: threads that run and sleep, in two processes."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from autograder.processes.descriptors import readable_descriptors
from autograder.processes.outside import kernel_stillness
from autograder.processes.outside.kernel_stillness import ENDLESS_S, RESTLESS_S, KernelStillness
from autograder.processes.process_folders import SingleProcess

BUSY = "import sys; print(flush=True)\nwhile True: pass"
# Two threads: one computes from the first line of input on to the second, the other answers "?".
BESIDE = """
import sys, threading
computes = threading.Event()
def compute():
    while True:
        computes.wait()
def answer():
    for line in sys.stdin:
        if line == "?\\n":
            sum(range(10**5))
            print("!", flush=True)
        elif computes.is_set():
            computes.clear()
        else:
            computes.set()
threading.Thread(target=compute, daemon=True).start()
print(flush=True)
answer()
"""
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


def watching(other: subprocess.Popen[bytes]) -> KernelStillness:
    return KernelStillness(SingleProcess(other.pid), SingleProcess(os.getpid()))


def test_two_processes_that_sleep_are_still() -> None:
    with process(ASLEEP) as other:
        assert watching(other).wait_for_rest(timeout=30.0)


def test_a_process_that_computes_is_not() -> None:
    with process(BUSY) as other:
        assert not watching(other).wait_for_rest(timeout=0.2)


def test_a_thread_of_the_examiners_own_counts() -> None:
    stop = threading.Event()

    def compute(until: Callable[[], bool] = stop.is_set) -> None:
        while not until():
            pass

    thread = threading.Thread(target=compute)
    thread.start()
    try:
        with process(ASLEEP) as other:
            assert not watching(other).wait_for_rest(timeout=0.2)
            stop.set()
            thread.join()
            assert watching(other).wait_for_rest(timeout=30.0)
    finally:
        stop.set()
        thread.join()


def test_a_thread_that_takes_the_place_of_an_ended_one_counts() -> None:
    stop = threading.Event()

    def compute() -> None:
        while not stop.is_set():
            pass

    first = threading.Thread(target=stop.wait)
    first.start()
    with process(ASLEEP) as other:
        still = watching(other)
        assert still.wait_for_rest(timeout=30.0)
        stop.set()
        first.join()
        stop.clear()
        second = threading.Thread(target=compute)
        second.start()
        try:
            assert not still.wait_for_rest(timeout=0.2)
        finally:
            stop.set()
            second.join()
        assert still.wait_for_rest(timeout=30.0)


def test_a_kernel_that_keeps_no_account_of_run_times_tells_enough(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(kernel_stillness, "_COUNTS", "status")
    with process(BESIDE) as other:
        still = watching(other)
        require_that_answers_are_waited_for(still, other)
        tell(other, "compute")
        assert rests_not_reached(still) > 0


def test_a_process_that_has_ended_leaves_the_examiners_own() -> None:
    with process(ASLEEP) as other:
        pass
    assert watching(other).wait_for_rest(timeout=30.0)


def tell(other: subprocess.Popen[bytes], line: str) -> None:
    assert other.stdin is not None
    other.stdin.write(f"{line}\n".encode())
    other.stdin.flush()


def rests_not_reached(still: KernelStillness) -> int:
    return next(n for n in range(100) if still.wait_for_rest(timeout=30.0))


def require_that_answers_are_waited_for(
    still: KernelStillness, other: subprocess.Popen[bytes]
) -> None:
    assert other.stdout is not None
    for _ in range(10):
        tell(other, "?")
        assert still.wait_for_rest(timeout=30.0)
        assert readable_descriptors([other.stdout], 0.0)
        assert other.stdout.readline() == b"!\n"


def test_a_thread_that_computes_for_ever_costs_the_patience_but_once() -> None:
    with process(BUSY) as other:
        still = watching(other)
        assert 0 < rests_not_reached(still) <= ENDLESS_S / RESTLESS_S + 1
        assert rests_not_reached(still) == 0


def test_beside_a_thread_that_computes_for_ever_others_are_waited_for() -> None:
    with process(BESIDE) as other:
        tell(other, "compute")
        still = watching(other)
        rests_not_reached(still)
        require_that_answers_are_waited_for(still, other)


def test_a_thread_that_has_fallen_asleep_counts_again() -> None:
    with process(BESIDE) as other:
        tell(other, "compute")
        still = watching(other)
        assert rests_not_reached(still) > 0
        tell(other, "sleep")
        assert rests_not_reached(still) == 0
        assert still.wait_for_rest(timeout=30.0)
        tell(other, "compute")
        assert rests_not_reached(still) > 0
