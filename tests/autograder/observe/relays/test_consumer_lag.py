"""Whether a consumer keeps up is told from the student's own times, however late they are heard."""

from __future__ import annotations

import re
import time

import pytest

from autograder.observe.relays.arrivals import Arrival, Arrivals
from autograder.observe.relays.consumer_lag import QUIET_S, WATCHED_S, ConsumerLag
from course.runtime.waiting import Pulse, poll_condition

S = 10**9  # ns
PERIOD = S // 100
SERIES = "pause"


def arrivals(times: list[tuple[int, int]], into: Arrivals | None = None) -> Arrivals:
    heard = Arrivals() if into is None else into
    for number, when in times:
        heard.note(SERIES, number, when, when)
    return heard


def watch_lag(published: list[int], handed: Arrivals, resumed: int) -> ConsumerLag:
    return ConsumerLag(
        arrivals(list(enumerate(published))), handed, SERIES, resumed,
        rate_hz=100.0, most_waiting=50, each_counts=True,
    )  # fmt: skip


def lag_of(published: list[int], handed: list[tuple[int, int]], resumed: int) -> ConsumerLag:
    return watch_lag(published, arrivals(handed), resumed)


def at_rate(since: int, seconds: float) -> list[int]:
    return [since + n * PERIOD for n in range(int(seconds * 100))]


def prompt(published: list[int]) -> list[tuple[int, int]]:
    return [(number, when + S // 1000) for number, when in enumerate(published)]


@pytest.mark.parametrize("late", [0, 10])
def test_a_consumer_that_hands_on_fresh_readings_keeps_up(late: int) -> None:
    resumed = time.time_ns() - (late + 2) * S
    published = at_rate(resumed, 2)
    watched = lag_of(published, prompt(published), resumed)
    assert watched.is_settled()
    assert not watched.lag


class Late(Arrivals):
    """Hears of messages that were handed on one by one, long after those that were published."""

    looks = 0

    def of(self, series: str) -> list[Arrival]:
        """Return one more than the last time."""
        self.looks += 1
        return super().of(series)[: self.looks]


def test_a_consumer_of_which_the_examiner_hears_late_is_not_silent() -> None:
    resumed = time.time_ns() - 8 * S
    published = at_rate(resumed, 5)[::2]
    watched = watch_lag(published, arrivals(prompt(published), Late()), resumed)
    assert not poll_condition(watched.is_settled, QUIET_S + 0.5, Pulse())
    assert not watched.lag


def test_an_examiner_that_hears_late_does_not_take_that_for_silence() -> None:
    # Half the rate, handed on at once: it may keep up with that, or with the sensor's rate, too.
    resumed = time.time_ns() - int((QUIET_S + 5) * S)
    published = at_rate(resumed, 3)[::2]
    watched = lag_of(published, prompt(published), resumed)
    assert not watched.is_settled()
    assert not watched.is_able


def test_readings_that_come_at_the_last_moment_do_not_show_that_a_slow_consumer_keeps_up() -> None:
    # A second's readings come within 0.2 s, and one of them is handed on each 20 ms.
    resumed = time.time_ns() - 3 * S
    start = resumed + int(WATCHED_S * S)
    published = [start + n * 2 * S // 1000 for n in range(100)]
    handed = [(n, start + n * 2 * PERIOD) for n in range(9)]
    watched = lag_of(published, handed, resumed)
    assert not watched.is_settled()
    assert not watched.is_able


def test_a_consumer_that_hands_on_nothing_while_readings_go_on_has_shown_all_there_is() -> None:
    resumed = time.time_ns() - 4 * S
    published = at_rate(resumed, 4)
    assert lag_of(published, prompt(published[:100]), resumed).is_settled()


def test_a_list_that_fills_faster_than_it_is_emptied_falls_behind() -> None:
    resumed = time.time_ns() - 8 * S
    published = at_rate(resumed, 8)
    watched = lag_of(published, [(n, resumed + n * 2 * PERIOD) for n in range(400)], resumed)
    assert watched.is_settled()
    assert "fell further and further behind: while messages came in at 100 Hz" in watched.lag


def every_second(published: list[int]) -> list[tuple[int, int]]:
    # As a list of 20 does that is always full, and of which a timer of 50 Hz takes the oldest.
    return [(number, when + S // 5) for number, when in enumerate(published)][::2]


def test_a_list_that_drops_each_second_reading_leaves_them_out() -> None:
    resumed = time.time_ns() - 4 * S
    published = at_rate(resumed, 4)
    watched = lag_of(published, every_second(published), resumed)
    assert watched.is_settled()
    handed, published_count = re.findall(r"handed on (\d+) of (\d+)", watched.omission)[0]
    assert int(published_count) == 2 * int(handed)


def test_what_is_left_out_shows_however_few_readings_a_busy_machine_brings() -> None:
    # At 60 Hz a list that is emptied at 50 Hz leaves out every sixth.
    resumed = time.time_ns() - 4 * S
    published = list(range(resumed + S // 60, resumed + 4 * S, S // 60))
    handed = [(n, when + S // 5) for n, when in enumerate(published) if n % 6]
    watched = lag_of(published, handed, resumed)
    assert watched.is_settled()
    assert watched.omission


@pytest.mark.parametrize("busy", [30, 60])
def test_what_a_busy_moment_costs_is_not_left_out(busy: int) -> None:
    # The drivers' process stands still for that many periods; what came in is caught up with, and a
    # list of the last 50 drops some of it.
    resumed = time.time_ns() - 4 * S
    published = at_rate(resumed, 4)
    start = 350 - busy
    for n in range(start, 350):
        published[n] = resumed + 350 * PERIOD + n * S // 5000
    handed = [(n, when) for n, when in prompt(published) if not start - 30 <= n < 330]
    assert lag_of(published, handed, resumed).omission == ""


@pytest.mark.parametrize(("delay", "able"), [(0.75, False), (0.4, True)])
def test_a_quick_consumer_is_able_only_if_something_it_hands_on_is_not_too_old(
    delay: float, able: bool
) -> None:
    # A timer hands on five at a time. A busy machine leaves out each other half second of readings,
    # so that there is no streak of those that are late.
    resumed = time.time_ns() - 9 * S
    published = [when for when in at_rate(resumed, 9) if (when - resumed) % S < S // 2]
    late = (when - (when - resumed) % (5 * PERIOD) + 5 * PERIOD for when in published)
    handed = [(n, when + int(delay * S)) for n, when in enumerate(late)]
    watched = lag_of(published, handed, resumed)
    assert not watched.is_settled()
    assert watched.is_able is able


def test_a_picture_of_it_shows_how_messages_get_older() -> None:
    resumed = time.time_ns() - 5 * S
    published = at_rate(resumed, 5)
    handed = [(number, resumed + 2 * number * PERIOD) for number in range(1, 250)]
    picture = lag_of(published, handed, resumed).draw()
    assert picture.points[0] == (0.02, 0.01)
    assert picture.points[-1][0] > 4.9
    ages = [age for _, age in picture.points]
    assert ages == sorted(ages)
    assert len(ages) <= 100
