"""Patience is for a busy machine: where all sleep, little of it is enough."""

from __future__ import annotations

import time

from autograder.corpus.trials import busy_loops
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
