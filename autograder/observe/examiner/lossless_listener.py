"""Hears each message of a topic once, whichever reliability its publishers offer, and knows when.

A node may offer either reliability, or have two publishers: only a best-effort reader then hears
both, while a reliable one loses none. So there are two readers.
"""

from __future__ import annotations

import secrets
from typing import Any, NamedTuple

from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from autograder.observe.examiner.publication_times import published_at
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.nouns import Topic


class Published(NamedTuple):
    """A message that came: what it says, and when it was published, in ns of the machine's time."""

    value: Any
    published: int


class LosslessListener(QuietNode):
    """A node of the examiner's that listens to one topic.

    Attributes:
        settled: a time in ns at which all was at rest: what comes then was not published before it.

    Example::

        node = session.run(LosslessListener, Topic("count", Int32, lambda message: message.data))
        session.until(lambda: [heard.value for heard in node.heard()] == [1, 2, 3])
    """

    def __init__(self, topic: Topic) -> None:
        """Listen.

        Args:
            topic: its ``value`` returns what counts of a message, which can be hashed; or None for
                one that is no message of the task.
        """
        super().__init__(f"examiner_{secrets.token_hex(4)}")
        self._value = topic.value
        self._heard: dict[tuple[int, Any], Published] = {}
        self._strange: set[int] = set()
        self.settled = 0
        for reliability in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT):
            qos = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=reliability)
            self.create_subscription(topic.type, str(topic), self._note, qos)

    def _note(self, message: Any, info: dict[str, int]) -> None:
        # By the writer's stamp it is known when the other reader gets it, too.
        stamp = info["source_timestamp"]
        if (value := self._value(message)) is None:
            self._strange.add(stamp)
        else:
            heard = Published(value, published_at(info, self.settled))
            self._heard.setdefault((stamp, value), heard)

    def heard(self) -> list[Published]:
        """Return what came, in order of arrival: a later call returns more at the end."""
        return list(self._heard.values())

    def count_strange(self) -> int:
        """Return how many messages came that are none of the task."""
        return len(self._strange)
