"""How a simulation follows a clock that this test moves."""

from __future__ import annotations

import pytest

from course.errors import SessionError
from course.worlds.pacing import MAX_BEHIND_NS, STEP_NS, PacedSimulation

T0 = 1_000_000_000_000
MS = 1_000_000


@pytest.fixture
def alive(on_floor):
    paced = PacedSimulation(on_floor(), exact=False)
    paced.start(T0)
    return paced


def stamps(paced, now_ns):
    return [stamp - T0 for stamp, _ in paced.steps_due(now_ns)]


def test_whole_steps_are_taken_and_stamped_with_their_times(alive):
    assert stamps(alive, T0 + 9 * MS) == []
    assert stamps(alive, T0 + 25 * MS) == [10 * MS, 20 * MS]
    assert stamps(alive, T0 + 30 * MS) == [30 * MS]
    assert alive.simulation.time_s == pytest.approx(0.03)


def test_on_wall_time_only_so_much_is_made_up_for(alive):
    now_ns = T0 + 60_000 * MS
    (only,) = stamps(alive, now_ns)
    assert T0 + only == now_ns
    assert stamps(alive, now_ns + MAX_BEHIND_NS)[-1] == 60_000 * MS + MAX_BEHIND_NS


def test_a_clock_that_is_set_back_is_followed(alive):
    assert stamps(alive, T0 - 5_000 * MS) == [-5_000 * MS]
    assert stamps(alive, T0 - 4_990 * MS) == [-4_990 * MS]


def test_on_simulated_time_everything_is_made_up_for(on_floor):
    exact = PacedSimulation(on_floor(), exact=True)
    exact.start(T0)
    assert stamps(exact, T0 + 5_000 * MS) == [10 * MS * n for n in range(1, 501)]
    with pytest.raises(SessionError, match="as fast as you move the clock"):
        exact.speed = 2.0


def test_it_goes_faster_and_slower(alive):
    alive.speed = 4
    assert stamps(alive, T0 + 5 * MS) == [2_500_000, 5 * MS]
    alive.speed = 0.25
    assert stamps(alive, T0 + 90 * MS) == [45 * MS, 85 * MS]
    for wrong in (0.1, 5, "fast", True, float("nan")):
        with pytest.raises(SessionError, match=r"speed is 0\.25 to 4, not"):
            alive.speed = wrong


def test_a_paused_one_stands_still_and_makes_nothing_up(alive):
    alive.paused = True
    assert stamps(alive, T0 + 1_000 * MS) == []
    alive.resume(T0 + 1_000 * MS)
    assert stamps(alive, T0 + 1_010 * MS) == [1_010 * MS]


def test_a_paused_one_takes_a_tenth_of_a_second_on_demand_and_its_times_go_up(alive):
    alive.paused = True
    assert stamps(alive, T0 + 1_000 * MS) == []
    first = [stamp for stamp, _ in alive.steps_of_one_look(T0 + 1_050 * MS)]
    second = [stamp for stamp, _ in alive.steps_of_one_look(T0 + 1_060 * MS)]
    assert len(first) == len(second) == 10
    assert [b - a for a, b in zip(first + second, (first + second)[1:], strict=False)] == (
        [STEP_NS] * 19
    )
    assert alive.simulation.time_s == pytest.approx(0.2)
