"""Blocked or about to go on: threads that wait, that take naps, and that compute."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from course.runtime.callbacks.idleness import LOOKS, Idleness

DEADLINE = 30.0  # s


@contextmanager
def running(body: Callable[[threading.Event], None]) -> Iterator[tuple[Idleness, threading.Event]]:
    stop = threading.Event()
    thread = threading.Thread(target=body, args=(stop,), daemon=True)
    thread.start()
    assert thread.ident is not None
    try:
        yield Idleness(thread.ident), stop
    finally:
        stop.set()
        thread.join()


def looks(idleness: Idleness, nap: threading.Event) -> Iterator[bool]:
    """Look again and again, and let go of the interpreter's lock in between."""
    while True:
        yield idleness.is_blocked()
        nap.wait(0.0005)


def becomes_blocked(idleness: Idleness) -> bool:
    end = time.monotonic() + DEADLINE
    nap = threading.Event()
    return next(found for found in looks(idleness, nap) if found or time.monotonic() > end)


def wait(stop: threading.Event) -> None:
    stop.wait()


def take_naps(stop: threading.Event) -> None:
    while not stop.wait(0.01):
        pass


def compute(stop: threading.Event) -> None:
    while not stop.is_set():
        pass


def test_a_thread_that_waits_is_blocked() -> None:
    with running(wait) as (idleness, _):
        assert becomes_blocked(idleness)


def test_a_thread_that_takes_naps_is_blocked() -> None:
    with running(take_naps) as (idleness, _):
        assert becomes_blocked(idleness)


def test_a_thread_that_wants_the_interpreter_is_not_though_it_sleeps_at_every_look() -> None:
    with running(compute) as (idleness, _):
        found = looks(idleness, threading.Event())
        assert not any(next(found) for _ in range(5 * LOOKS))


def test_one_look_proves_nothing() -> None:
    with running(wait) as (idleness, _):
        assert not idleness.is_blocked()


def test_a_blocked_thread_that_goes_on_is_not_blocked_any_more() -> None:
    go_on = threading.Event()

    def wait_then_compute(stop: threading.Event) -> None:
        go_on.wait()
        compute(stop)

    with running(wait_then_compute) as (idleness, _):
        assert becomes_blocked(idleness)
        go_on.set()
        end = time.monotonic() + DEADLINE
        assert next(
            not blocked
            for blocked in looks(idleness, threading.Event())
            if not blocked or time.monotonic() > end
        )


def test_a_thread_that_has_ended_is_not_blocked() -> None:
    with running(wait) as (idleness, stop):
        assert becomes_blocked(idleness)
        stop.set()
        end = time.monotonic() + DEADLINE
        assert next(
            not blocked
            for blocked in looks(idleness, threading.Event())
            if not blocked or time.monotonic() > end
        )
