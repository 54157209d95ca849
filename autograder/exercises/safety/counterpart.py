"""The examiner's end of one part of the error-handling exam: what it hears, says and serves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from autograder.exercises.safety.deferred_replies import Held
from autograder.observe.qos_refusal import find_refusal
from autograder.observe.quiet_node import QuietNode

# Which QoS a student's subscription has is free: what is offered meets every demand but a deadline.
# Only one that joins later and demands it is sent the last message again.
LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
LOSSLESS = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)
UNDEMANDING = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT)


class Player(QuietNode):
    """The examiner's end of one part of the task: plays the world around the student's node."""

    def __init__(self, name: str) -> None:
        """Create no endpoints yet.

        ``now`` is simulated time in s, which the rig keeps; ``took`` is how long something took
        where it is timed, by its name in `plain_program_times`.
        """
        super().__init__(name)
        self.now = 0.0
        self.took: dict[str, float] = {}
        self._ears: dict[str, tuple[Any, Callable[[Any], None]]] = {}
        self.spoken: list[str] = []
        self.used: list[str] = []
        self._paused = Held()

    async def pause(self, server: Node) -> None:
        """Let a server of the examiner's wait until the subject has come to rest.

        rclpy's action client registers a request after it has sent it, and drops an answer that
        another thread takes in between. Where the student's node runs in several threads, an
        answer must not be faster than the line that asks.
        """
        await self._paused.wait(server)

    def resume(self) -> bool:
        """Let all go on that wait in `pause`; return whether there were any."""
        return self._paused.release()

    def add_listener(self, msg_type: Any, topic: str, note: Callable[[Any], None]) -> None:
        """Listen to a topic that the student's node publishes on, once it does."""
        self._ears[topic] = (msg_type, note)

    @property
    def heard_topics(self) -> list[str]:
        """The topics that the student's node publishes on."""
        return list(self._ears)

    def subscribe_all(self) -> None:
        """Subscribe, with what is offered: lossless wherever that is possible."""
        for topic, (msg_type, note) in self._ears.items():
            offers = [end.qos_profile for end in self.get_publishers_info_by_topic(topic)]
            reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offers)
            self.create_subscription(msg_type, topic, note, LOSSLESS if reliable else UNDEMANDING)

    def add_publisher(self, msg_type: Any, topic: str) -> Any:
        """Return a publisher on a topic that the student's node listens to."""
        self.spoken.append(topic)
        return self.create_publisher(msg_type, topic, LATCHED)

    def describe_unheard(self) -> str:
        """Return which of the node's subscriptions cannot be served, and why; empty if none."""
        for topic in self.spoken:
            offers = [end.qos_profile for end in self.get_publishers_info_by_topic(topic)]
            demands = [end.qos_profile for end in self.get_subscriptions_info_by_topic(topic)]
            why = [find_refusal(offer, demand) for offer in offers for demand in demands]
            if why and (first := why[0]) is not None and all(why):
                return (
                    f"Its subscription to {topic} demands more than any publisher offers: "
                    f"{first.requested}, where {first.offered} is offered."
                )
        return ""

    def add_used_service(self, service: str) -> None:
        """Say that the examiner is a client of a service that the student's node serves."""
        self.used.append(service)

    def describe_missing(self) -> str:
        """Return what the student's node lacks, a sentence each; empty if all is connected."""
        lacking = [
            f"no publisher on {t}" for t in self.heard_topics if not self.count_publishers(t)
        ]
        lacking += [f"no subscription to {t}" for t in self.spoken if not self.count_subscribers(t)]
        lacking += self.missing_servers()
        return "There is " + ", ".join(lacking) + "." if lacking else ""

    def missing_servers(self) -> list[str]:
        """Return which of the student's servers and clients are not there, a phrase each."""
        return []


def following_phrase(before: list[str]) -> str:
    """Return which request a request follows, to put behind it; empty if it is the first one."""
    return f", the next one after “{before[0]}”" if before else ""
