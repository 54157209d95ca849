"""When a message was published: the writer's word counts as far as it can be true."""

from __future__ import annotations

import pytest

from autograder.exercises.patterns.merged_subscriptions import Ears
from autograder.observe.publication_times import TRANSIT_NS, published_at

RECEIVED = 10 * TRANSIT_NS


@pytest.mark.parametrize(
    ("stamp", "published"),
    [
        (RECEIVED - 1000, RECEIVED - 1000),
        (RECEIVED + TRANSIT_NS, RECEIVED),
        (0, RECEIVED - TRANSIT_NS),
    ],
)
def test_a_stamp_is_believed_within_the_time_of_its_way(stamp: int, published: int) -> None:
    info = {"source_timestamp": stamp, "received_timestamp": RECEIVED}
    assert published_at(info) == published


@pytest.mark.parametrize(
    ("stamp", "settled", "published"),
    [
        (RECEIVED - 2000, RECEIVED - 1000, RECEIVED - 1000),  # nothing was on its way then
        (RECEIVED - 1000, RECEIVED - 2000, RECEIVED - 1000),
        (RECEIVED - 2000, RECEIVED, RECEIVED - 2000),  # it was here when all had come to rest
    ],
)
def test_what_comes_after_a_rest_was_published_after_it(
    stamp: int, settled: int, published: int
) -> None:
    info = {"source_timestamp": stamp, "received_timestamp": RECEIVED}
    assert published_at(info, settled) == published


def test_a_message_of_two_subscriptions_counts_once_whatever_its_stamp_says() -> None:
    ears = Ears[str]()
    forged = RECEIVED * 100
    for received in (RECEIVED, RECEIVED + 7):  # by the one and by the other
        info = {"source_timestamp": forged, "received_timestamp": received}
        ears.add_message(published_at(info), "forged", forged)
    ears.add_message(RECEIVED + 5, "later", RECEIVED + 5)
    assert list(ears) == ["forged", "later"]
    assert ears.newest_time == RECEIVED + 5
