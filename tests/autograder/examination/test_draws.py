"""The numbers of an examination: repeatable, and different from run to run."""

from __future__ import annotations

from autograder.examination.draws import USUAL_SEED, Draws, fresh_seed


def numbers(seed: int) -> list[float]:
    draws = Draws(seed)
    return [draws.number(f"level {n}", 0.5, 0.1, 0.9) for n in range(20)]


def test_a_seed_gives_the_same_numbers_again_and_another_one_others() -> None:
    assert numbers(36) == numbers(36) != numbers(37)
    assert all(0.1 <= number <= 0.9 for number in numbers(36))
    assert len(set(numbers(36))) > 5


def test_a_purpose_gets_its_number_whatever_was_drawn_before() -> None:
    draws = Draws(36)
    draws.whole("something else", 1, 1, 9)
    assert draws.number("level 3", 0.5, 0.1, 0.9) == numbers(36)[3]


def test_the_usual_seed_gives_what_tests_are_worded_for() -> None:
    draws = Draws(USUAL_SEED)
    assert draws.number("a limit", 0.33, 0.0, 1.0) == 0.33
    assert draws.whole("metres", 4, 3, 5) == 4
    assert draws.flag("a grip")
    assert not draws.flag("nonsense", usual=False)
    assert draws.shuffled("ends", "abc") == ["a", "b", "c"]
    assert USUAL_SEED not in {fresh_seed() for _ in range(100)}


def test_an_order_is_drawn_and_loses_nothing() -> None:
    orders = {"".join(Draws(seed).shuffled("ends", "abc")) for seed in range(1, 40)}
    assert len(orders) == 6
    assert {"".join(sorted(order)) for order in orders} == {"abc"}
