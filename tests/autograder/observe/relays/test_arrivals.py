"""Arrivals are told apart by their series, and one that comes again is noted again."""

from __future__ import annotations

from autograder.observe.relays.arrivals import Arrivals


def test_what_came_again_is_counted_but_in_series_that_repeat_by_design() -> None:
    heard = Arrivals()
    for series, number in (("a", 1), ("a", 1), ("b", 1), ("presses", 0), ("presses", 0)):
        heard.note(series, number, 10 * len(heard), 0)
    assert len(heard) == 5
    assert heard.count_repeated() == 2
    assert heard.count_repeated(but=["presses"]) == 1
    assert heard.first_times("a") == {1: 0}
    assert heard.numbers("nothing of it") == []
