"""What a working node publishes, by what it means."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher

from course.design.at_work.meanings import Meaning
from course.design.at_work.places import messages as places
from course.design.at_work.places.place import Place
from course.design.endpoints import DesignEndpoint


class Outlets:
    """The publishers of a node."""

    def __init__(self, node: Node) -> None:
        """Have none yet."""
        self._node = node
        self._publishers: dict[Meaning, list[tuple[DesignEndpoint, Publisher]]] = {}

    def __contains__(self, meaning: Meaning) -> bool:
        """Return whether the node publishes anything of a meaning."""
        return meaning in self._publishers

    def add(self, end: DesignEndpoint, meaning: Meaning) -> None:
        """Make the publisher of an endpoint."""
        publisher = self._node.create_publisher(end.type, end.full_name, end.qos)
        self._publishers.setdefault(meaning, []).append((end, publisher))

    def names_of(self, meaning: Meaning) -> list[str]:
        """Return the topics of a meaning."""
        return [end.full_name for end, _ in self._publishers.get(meaning, ())]

    def hand_on(self, meaning: Meaning, message: Any) -> None:
        """Publish a message as it is, where its type fits."""
        for end, publisher in self._publishers.get(meaning, ()):
            if isinstance(message, end.type):
                publisher.publish(message)

    def tell_places(
        self, meaning: Meaning, found: Sequence[Place], frame: str, topic: str = ""
    ) -> None:
        """Publish places, which are in a frame; on one topic, or on all of that meaning."""

        def write(message: Any) -> bool:
            return places.write_places(message, found, frame)

        self._tell(meaning, write, topic)

    def tell_velocity(self, meaning: Meaning, speed: float, turn: float) -> None:
        """Publish a velocity, in m/s and rad/s."""

        def write(message: Any) -> bool:
            if (twist := places.find_twist(message)) is not None:
                twist.linear.x, twist.angular.z = speed, turn
            return twist is not None

        self._tell(meaning, write)

    def tell_map(self, write_map: Callable[[Any], None]) -> None:
        """Publish the map that ``write_map`` writes into a message."""

        def write(message: Any) -> bool:
            write_map(message)
            return True

        self._tell(Meaning.MAP, write)

    def _tell(self, meaning: Meaning, write: Callable[[Any], bool], topic: str = "") -> None:
        for end, publisher in self._publishers.get(meaning, ()):
            if topic not in ("", end.full_name):
                continue
            message = end.type()
            if hasattr(message, "header"):
                message.header.stamp = self._node.get_clock().now().to_msg()
            if write(message):
                publisher.publish(message)
