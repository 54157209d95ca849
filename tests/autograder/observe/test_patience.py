"""Patience is for a busy machine: where all sleep, little of it is enough."""

from __future__ import annotations

import time

import pytest

from autograder.corpus.trials import busy_loops
from autograder.exercises.qos.backlogs import Backlog
from autograder.exercises.qos.readings import IMU, LIDAR, STOP, Sensor
from autograder.observe.patience import Patience
from autograder.observe.stillness import Stillness
from autograder.processes.outside.asking import Here
from course import Session
from tests.autograder.processes.outside.test_kernel_stillness import ASLEEP, BUSY, process

LONG_S = 600.0


def test_what_nobody_is_at_work_on_is_not_waited_for_to_the_end() -> None:
    with process(ASLEEP) as other, Session() as session:
        assert not Patience(Stillness(Here(other.pid)), LONG_S, 0.3).wait(session, lambda: False)


def test_what_comes_is_waited_for() -> None:
    with process(ASLEEP) as other, Session() as session:
        due = time.monotonic() + 0.5
        assert Patience(Stillness(Here(other.pid)), LONG_S, LONG_S).wait(
            session, lambda: time.monotonic() > due
        )


def test_a_process_that_is_at_work_is_waited_for_to_the_end() -> None:
    with process(BUSY) as other, Session() as session:
        patience = Patience(Stillness(Here(other.pid)), 1.0, 0.2)
        began = time.monotonic()
        assert not patience.wait(session, lambda: False)
        assert time.monotonic() - began >= 1.0


def test_a_machine_that_is_busy_with_others_takes_nothing_from_a_wait_that_ends() -> None:
    with busy_loops(4), process(ASLEEP) as other, Session() as session:
        assert not Patience(Stillness(Here(other.pid)), LONG_S, 0.3).wait(session, lambda: False)


def left(sensor: Sensor = LIDAR, count: int = 15, **seen: object) -> Backlog:
    """Return what a right consumer leaves, but for what was ``seen``."""
    right = {"published": count, "kept": [count - 1], "replayed": 1, "oldest": 0.1, "early": False}
    right |= {"expires": False, "altered": False, "again": 0}
    return Backlog(sensor, count, **{**right, **seen})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("found", "decided"),
    [
        (left(), False),
        (left(early=True), True),
        (left(altered=True), True),
        (left(published=8), True),
        (left(published=12), False),
        (left(STOP, 100, published=99), True),
        (left(replayed=10, oldest=1.0), True),
        (left(replayed=10, oldest=0.4), False),
        (left(IMU, 150, replayed=49, oldest=1.0), False),
        (left(kept=[14, 13]), True),
        # The newest may still come out, on a busy machine.
        (left(kept=[3, 2], replayed=10, oldest=1.0), False),
        (left(kept=[]), False),
    ],
)
def test_what_a_pause_has_decided_is_told_from_what_comes_after_it(
    found: Backlog, decided: bool
) -> None:
    assert found.is_decided is decided


@pytest.mark.parametrize(
    ("found", "may_have"),
    [
        # As seen of a reader with a LIFESPAN of 0.5 s: Fast DDS once let it keep 68 readings.
        (left(IMU, 90, replayed=68, oldest=0.74, expires=True), True),
        (left(IMU, 90, replayed=50, oldest=0.56, expires=True), False),
        (left(IMU, 90, replayed=68, oldest=0.74), False),
    ],
)
def test_readings_too_old_may_have_expired_late_only_where_they_expire(
    found: Backlog, may_have: bool
) -> None:
    assert found.may_have_expired_late is may_have
