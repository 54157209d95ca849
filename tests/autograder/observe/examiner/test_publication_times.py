"""When a message was published: the writer's word counts as far as it can be true."""

from __future__ import annotations

import pytest

from autograder.observe.examiner.publication_times import TRANSIT_NS, published_at

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
