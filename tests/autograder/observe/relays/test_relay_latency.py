"""A node that keeps messages back is told from a machine that is busy."""

from __future__ import annotations

from autograder.observe.relays.arrivals import Arrivals
from autograder.observe.relays.relay_latency import FORGIVEN, HELD, PROMPT, SLOW, RelayLatency

AT_ONCE_S = 0.15
SERIES = "single"


def relay(*transit_times_s: float | None) -> RelayLatency:
    """Return what became of messages that took so long, or never came out."""
    sent, out = Arrivals(), Arrivals()
    for number, seconds in enumerate(transit_times_s):
        sent.note(SERIES, number, 0, 0)
        if seconds is not None:
            out.note(SERIES, number, int(seconds * 1e9), 0)
    return RelayLatency(lambda number: None, sent, out, SERIES, AT_ONCE_S)


def test_a_node_that_passes_each_on_at_once_is_soon_known() -> None:
    found = relay(*[0.01] * PROMPT)
    assert found.is_known
    assert not found.is_slow
    assert found.counts == (PROMPT, PROMPT)


def test_late_messages_count_only_if_the_machine_had_come_to_them() -> None:
    found = relay(*[0.3] * SLOW)
    assert not found.is_slow
    found.waited.update(range(SLOW))
    assert found.is_slow
    assert found.late_times_s == [0.3] * SLOW


def test_a_few_that_are_held_at_rest_show_a_node_that_looks_now_and_then() -> None:
    found = relay(*[0.01] * PROMPT, *[0.1] * HELD)
    found.held.update(range(PROMPT, PROMPT + HELD))
    assert found.is_slow
    assert found.late_times_s == [AT_ONCE_S] * HELD


def test_one_message_may_be_missing() -> None:
    assert not relay(0.01, *[None] * FORGIVEN).is_thinned
    assert relay(0.01, None, *[None] * FORGIVEN).is_thinned


def test_a_node_that_waits_for_the_next_one_keeps_two_running_back() -> None:
    found = relay(0.01, 0.01, None, None)
    found.missed.extend([0, 2])
    assert not found.keeps_back
    found.missed.append(3)
    assert found.keeps_back
    found = relay(0.01, 0.01, None, 0.9)  # the machine was late
    found.missed.extend([2, 3])
    assert not found.keeps_back
