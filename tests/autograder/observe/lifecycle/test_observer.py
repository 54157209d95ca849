"""How long an observer waits, and what it takes for the end of what it waits for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from autograder.observe.lifecycle.observer import Observer
from course.errors import WaitTimeout


class Asleep:
    """Processes whose threads all sleep, for ever; one of them wakes up in so many s."""

    usual_patience = patience = 1.0

    def __init__(self, wakes: list[float]) -> None:
        self.wakes = wakes

    def ask(self, what: str, **given: Any) -> Any:
        """Answer as `autograder.processes.outside` does."""
        sleepers = [(1, left, "") for left in self.wakes]
        return {"asleep": True, "threads": [1], "sleepers": sleepers, "others": []}.get(what)


class Impatient:
    """A session in which nothing happens."""

    def until(self, condition: Callable[[], Any], timeout: float, what: str) -> Any:
        """Look once."""
        if not condition():
            raise WaitTimeout(what)
        return True


class Ends(Observer):
    """An observer of a program that ends while it is looked at."""

    looks = 0

    def is_gone(self) -> bool:
        """Whether it was looked at before."""
        self.looks += 1
        return self.looks > 1


def observer_of(kind: type[Observer], wakes: list[float]) -> Any:
    return kind(Impatient(), Asleep(wakes), None)  # type: ignore[arg-type]


def test_the_end_of_a_program_is_seen_where_it_is_waited_for_and_ends_any_other_wait() -> None:
    observer = observer_of(Ends, [])
    assert observer.wait(observer.is_gone, timeout=1.0)
    gone = observer_of(Ends, [])
    gone.looks = 1
    assert not gone.wait(lambda: False)


@pytest.mark.parametrize(("wakes", "waits"), [([], False), ([60.0], False), ([1.0], True)])
def test_only_what_may_wake_up_by_itself_is_waited_for(wakes: list[float], waits: bool) -> None:
    observer = observer_of(Observer, wakes)
    waited: list[float] = []
    observer.wait = lambda over, idle: waited.append(idle)
    assert not observer.wait_for_end(lambda: False)
    assert len(waited) == 1 + waits
