"""A topic heard by two subscriptions at once, so that every publisher is heard and nothing is lost.

A best-effort subscription matches every publisher (DDS 1.4, table in 2.2.3: offered and requested
reliability), but may lose the newest message. A reliable one loses nothing, but does not match a
best-effort publisher, and may have matched later. Neither alone has all.
"""

from __future__ import annotations

from bisect import insort
from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

from rclpy.qos import QoSProfile

from autograder.observe.examiner.examiner_end import LOSSLESS, UNDEMANDING
from autograder.observe.examiner.publication_times import published_at
from autograder.observe.nouns import Topic


class Publication(NamedTuple):
    """What was published on a topic.

    Attributes:
        published_ns: when, in ns of this machine's time (see `publication_times.published_at`).
        number: its writer's count, which goes on where a message is lost on the way; 0 if the
            middleware has none.
        value: what it says, as `Topic.value` has it.
    """

    published_ns: int
    number: int
    value: Any


class Subscriber(Protocol):
    """A node, as far as it is needed here."""

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Any, qos_profile: QoSProfile
    ) -> Any:
        """Subscribe."""


class MergedSubscription:
    """What two subscriptions to a topic hear, each message once, in order of publication.

    Example:
        >>> from std_msgs.msg import Float64
        >>> class Recorder:
        ...     def create_subscription(self, msg_type, topic, callback, qos):
        ...         self.callback = callback
        >>> speed = Topic("hardware/speed", Float64, value=lambda message: message.data)
        >>> node = Recorder()
        >>> speeds = MergedSubscription(node, speed)
        >>> times = {"source_timestamp": 5, "received_timestamp": 6}
        >>> for _ in range(2):  # by the one and by the other
        ...     node.callback(Float64(data=0.5), {**times, "publication_sequence_number": 1})
        >>> speeds.publications
        [Publication(published_ns=5, number=1, value=0.5)]
        >>> speeds.last, speeds.newest_ns
        (0.5, 5)
    """

    def __init__(self, node: Subscriber, topic: Topic) -> None:
        """Subscribe a ``node`` of the examiner's to a ``topic``, for as long as the node is."""
        self.topic = topic
        self._heard: list[Publication] = []
        self._stamps: set[int] = set()
        self._forgotten_ns = 0
        for qos in (UNDEMANDING, LOSSLESS):
            node.create_subscription(topic.type, str(topic), self._note, qos)

    def _note(self, message: Any, info: Mapping[str, Any]) -> None:
        published_ns = published_at(info)
        # The writer's own stamp is the same for both subscriptions, whatever it says.
        stamp = int(info["source_timestamp"])
        if published_ns > self._forgotten_ns and stamp not in self._stamps:
            self._stamps.add(stamp)
            number = int(info["publication_sequence_number"] or 0)
            publication = Publication(published_ns, number, self.topic.value(message))
            insort(self._heard, publication, key=lambda heard: heard.published_ns)

    @property
    def publications(self) -> list[Publication]:
        """What was published so far, in that order."""
        return list(self._heard)

    @property
    def values(self) -> list[Any]:
        """What the messages say, in the order in which they were published."""
        return [heard.value for heard in self.publications]

    @property
    def last(self) -> Any:
        """What the newest message says, or None."""
        return self._heard[-1].value if self._heard else None

    @property
    def newest_ns(self) -> int:
        """When the newest was published (ns), or 0: it says what came after a moment.

        To count says less: what is still under way at that moment comes in later.
        """
        return self._heard[-1].published_ns if self._heard else 0

    def count_since(self, moment_ns: int) -> int:
        """Return how many have come that were published after a moment."""
        return sum(heard.published_ns > moment_ns for heard in self.publications)

    @property
    def same_since_ns(self) -> int:
        """When the first of the messages that say the same as the newest was published, or 0.

        Those at the end are meant, without another one between them.
        """
        since_ns = 0
        for heard in reversed(self.publications):
            if heard.value != self.last:
                break
            since_ns = heard.published_ns
        return since_ns

    def clear(self) -> None:
        """Forget all, and what the other subscription may still hear of it."""
        self._forgotten_ns = self.newest_ns
        self._heard = []
