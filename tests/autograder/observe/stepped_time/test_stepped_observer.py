"""Time that passes only while somebody waits: how far, and what is said where it was too slow."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from autograder.examination.check_context import StudentError
from autograder.examination.exam import Failed, NotExaminable
from autograder.observe.stepped_time.stepped_observer import Host, SteppedObserver
from course.errors import WaitTimeout


class FakeTime:
    """Notes how far it was moved."""

    def __init__(self) -> None:
        self.moves: list[tuple[float, float]] = []

    def advance(self, seconds: float, step: float) -> None:
        self.moves.append((seconds, step))

    def nudge(self) -> None: ...


class FakeSession:
    """Waits for nothing."""

    def until(self, condition: Any, **_: Any) -> Any:
        if value := condition():
            return value
        raise WaitTimeout("in vain")


def observer(source: Any, **options: Any) -> SteppedObserver:
    host = Host(FakeSession(), source, **options)  # type: ignore[arg-type]
    still, node = SimpleNamespace(all_asleep=lambda: True, patience=1.0), SimpleNamespace()
    return SteppedObserver(host, still, node)  # type: ignore[arg-type]


def test_time_passes_until_what_is_waited_for_is_there() -> None:
    source = FakeTime()
    observed = observer(source)
    assert observed.wait_stepping(lambda: len(source.moves) == 3)
    assert observed.elapsed_s == pytest.approx(0.3)


def test_after_a_while_it_passes_in_coarse_steps() -> None:
    source = FakeTime()
    observer(source).wait_stepping(lambda: len(source.moves) == 30)
    assert {step for _, step in source.moves[:19]} == {0.01}
    assert {step for _, step in source.moves[22:]} == {0.1}


def test_what_is_there_takes_no_time() -> None:
    source = FakeTime()
    assert observer(source).wait_stepping(lambda: True)
    assert not source.moves


def test_where_the_wall_time_is_over_first_a_host_may_say_that_nothing_can_be_told() -> None:
    assert not observer(FakeTime()).wait_stepping(lambda: False, seconds=5.0, timeout_s=0.0)
    with pytest.raises(NotExaminable, match="busy"):
        observer(FakeTime(), too_slow="busy").wait_stepping(
            lambda: False, seconds=5.0, timeout_s=0.0
        )


def test_a_moment_was_within_one_step() -> None:
    observed = observer(FakeTime())
    for _ in range(2):
        observed.step(0.1)
    first, second = observed._steps[1][0], observed._steps[2][0]
    assert observed.clock_at(first) == (0.0, 0.1)
    assert observed.clock_at(second) == (0.1, 0.2)
    assert observed.clock_at(second + 1) == (0.2, 0.2)


def test_a_callback_that_holds_up_the_clock_is_a_finding() -> None:
    def stuck(*_: float) -> None:
        raise StudentError("TimeoutError: the clock did not follow.")

    source = FakeTime()
    source.advance = stuck  # type: ignore[method-assign]
    with pytest.raises(Failed, match=r"the clock did not follow\. Does one go on"):
        observer(source).step()


def test_an_error_is_told_once() -> None:
    observed = observer(FakeTime(), errors=lambda: ["Robot.drive: ValueError"])
    assert observed.error_note() == " (a callback raised an error, in Robot.drive: ValueError)"
    assert observed.error_note() == ""
