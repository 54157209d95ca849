"""The topics of a world: what it publishes and hears, as long as its radio is there."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from course.worlds import messages
from course.worlds.pacing import PacedSimulation

Deliver = Callable[[str, Any], None]
"""Takes the name of a topic and what would be published on it, in the world's thread: a cable."""


@dataclass
class _Topic:
    """A topic of the world: its rate in Hz (0 for events), and the last message or its maker."""

    name: str
    msg_type: Any
    rate: float
    last: Any = None

    def describe(self) -> dict[str, Any]:
        last = self.last() if callable(self.last) else self.last
        return {
            "name": self.name,
            "type": messages.type_name(self.msg_type),
            "rate": round(self.rate, 1),
            "last": "" if last is None else messages.describe_message(last),
        }


class Ports:
    """The topics of a world's node, each with the last message that went over it.

    Attributes:
        node: the node.
        simulation: the world, without ROS; hold ``lock`` while you use it.
        lock: for whoever uses the simulation.
    """

    def __init__(self, node: Node, paced: PacedSimulation, catch_up: Callable[[], None]) -> None:
        """Have no topics yet; ``catch_up`` takes the steps that are due."""
        self.node = node
        self.simulation = paced.simulation
        self.lock = paced.lock
        self.catch_up = catch_up
        self._topics: dict[str, _Topic] = {}
        self._outputs: dict[str, Publisher] = {}
        self._inputs: dict[str, Subscription] = {}
        self._deliver: Deliver | None = None
        self._cables: Collection[str] = ()

    @property
    def has_radio(self) -> bool:
        """Whether anything can be sent and heard."""
        return self.simulation.faults["radio"] == "there"

    def advertise(self, topic: str, msg_type: Any, qos: QoSProfile | int, rate: float) -> None:
        """Publish on ``topic`` from now on; ``rate`` is in Hz, 0 for what comes now and then."""
        self._outputs[topic] = made = self.node.create_publisher(msg_type, topic, qos)
        self._topics[topic] = _Topic(made.topic_name, msg_type, rate)

    def listen(self, msg_type: Any, topic: str, handle: Callable[[Any], None]) -> None:
        """Have messages handled, with the lock held and the simulation up to date."""

        def receive(message: Any) -> None:
            with self.lock:
                self.catch_up()  # a command holds from now on, whether or not the timer came first
                if self.has_radio:
                    entry.last = message
                    handle(message)

        self._inputs[topic] = made = self.node.create_subscription(msg_type, topic, receive, 10)
        entry = self._topics[topic] = _Topic(made.topic_name, msg_type, 0.0)

    def hand_over(self, deliver: Deliver, cables: Collection[str]) -> None:
        """Leave all topics to other nodes: publish and hear nothing from now on.

        Args:
            deliver: gets what would be published.
            cables: the topics whose messages are worth making.
        """
        self._deliver, self._cables = deliver, cables
        for publisher in self._outputs.values():
            self.node.destroy_publisher(publisher)
        self._outputs.clear()
        for topic, subscription in self._inputs.items():
            self.node.destroy_subscription(subscription)
            del self._topics[topic]
        self._inputs.clear()

    def publish(self, topic: str, message: Any) -> None:
        """Publish, and show, a message."""
        self._topics[topic].last = message
        if self._deliver is None:
            self._outputs[topic].publish(message)
        else:
            self._deliver(topic, message)

    def publish_value(self, topic: str, value: Any) -> None:
        """Publish a message of a type that has nothing but ``data``."""
        self.publish(topic, self._topics[topic].msg_type(data=value))

    def publish_if_heard(self, topic: str, make: Callable[[], Any]) -> None:
        """Publish what ``make`` returns if somebody listens; show it in any case, when asked."""
        if self.is_heard(topic):  # at 100 Hz a message that nobody gets is worth saving
            self.publish(topic, make())
        self._topics[topic].last = make

    def is_heard(self, topic: str) -> bool:
        """Return whether somebody listens to a topic of the world's, or has its cable."""
        if self._deliver is not None:
            return topic in self._cables
        return self._outputs[topic].get_subscription_count() > 0

    def describe(self) -> list[dict[str, Any]]:
        """Return name, type, rate (Hz, 0 for what comes now and then) and last message of each."""
        return [topic.describe() for topic in self._topics.values()]
