"""Two subscriptions to a topic: each message once, in the order of publication."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from autograder.observe import Topic
from autograder.observe.examiner.merged_subscriptions import MergedSubscription
from autograder.observe.examiner.publication_times import TRANSIT_NS

RECEIVED = 10 * TRANSIT_NS


class Recorder:
    """A node that hands on what a test says its subscriptions have received."""

    def __init__(self) -> None:
        self.callbacks: list[Callable[..., None]] = []

    def create_subscription(self, _type: Any, _topic: str, callback: Any, _qos: Any) -> None:
        self.callbacks.append(callback)

    def hear(self, value: object, stamp: int, received: int, by: int = 0) -> None:
        info = {"source_timestamp": stamp, "received_timestamp": received,
                "publication_sequence_number": 3}  # fmt: skip
        self.callbacks[by](value, info)


def merged() -> tuple[Recorder, MergedSubscription]:
    node = Recorder()
    return node, MergedSubscription(node, Topic("topic", object))


def test_a_message_of_both_counts_once_whatever_its_stamp_says() -> None:
    node, heard = merged()
    forged = RECEIVED * 100
    node.hear("forged", forged, RECEIVED)
    node.hear("forged", forged, RECEIVED + 7, by=1)
    node.hear("later", RECEIVED + 5, RECEIVED + 8)
    assert heard.values == ["forged", "later"]
    assert heard.newest_ns == RECEIVED + 5
    assert heard.count_since(RECEIVED) == 1


def test_what_one_hears_late_has_its_place() -> None:
    node, heard = merged()
    node.hear("second", RECEIVED + 2, RECEIVED + 2)
    node.hear("first", RECEIVED + 1, RECEIVED + 3, by=1)
    assert heard.values == ["first", "second"]
    assert heard.last == "second"


def test_since_when_the_same_is_said_counts_back_from_the_end() -> None:
    node, heard = merged()
    assert heard.last is None
    assert heard.same_since_ns == heard.newest_ns == 0
    for at, value in enumerate((0.0, 0.5, 0.0, 0.0), RECEIVED):
        node.hear(value, at, at)
    assert heard.same_since_ns == RECEIVED + 2


def test_what_is_forgotten_is_not_heard_by_the_other_one() -> None:
    node, heard = merged()
    node.hear("old", RECEIVED, RECEIVED)
    heard.clear()
    node.hear("old", RECEIVED, RECEIVED, by=1)
    assert not heard.publications
    node.hear("new", RECEIVED + 1, RECEIVED + 1)
    assert heard.values == ["new"]
