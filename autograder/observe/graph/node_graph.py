"""The ROS graph as it concerns nodes of the student's: what is there, and what is left over.

Endpoints are told apart by their DDS identity, so that what an earlier node has left is not taken
for a later one's of the same name.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from rclpy.node import Node

from autograder.observe.nouns import Service, Topic
from autograder.observe.participants import GUID_PREFIX_BYTES, NAMELESS
from autograder.observe.phrases import as_phrase
from course.messages.types import type_name
from course.runtime.ros_names import full_name

NODE = "the node "
GUID_PROCESS_BYTES = 8
"""Of a participant's bytes those that all of one process share, as Fast DDS makes them."""
SESSIONS_OWN = re.compile(r"/_course_\d+_[0-9a-f]+")
"""The one hidden node that a session of the course has (`course.runtime.requests.hidden_node`)."""
PARAMETER_EVENTS = "/parameter_events"
"""What every node publishes on: a node itself has no endpoint."""


def publisher_on(topic: Topic) -> str:
    """Return what a publisher is called in a sentence."""
    return f"a publisher on {topic.name}"


def subscription_to(topic: Topic) -> str:
    """Return what a subscription is called in a sentence."""
    return f"a subscription to {topic.name}"


def service_called(service: Service) -> str:
    """Return what a service is called in a sentence."""
    return f"a service {service.name}"


def node_phrase(name: str) -> str:
    """Return one of the nodes that a graph gives for a reader.

    Of two that have one name, one is forgotten with the other, and its endpoints may stay.

    Example:
        >>> node_phrase("/camera_driver")
        'the node /camera_driver'
    """
    if name.endswith(NAMELESS):
        return (
            "an endpoint of a node whose name is no longer known (its publisher on "
            f"{PARAMETER_EVENTS}, which every node has)"
        )
    return f"{NODE}{name}"


class NodeGraph:
    """What the examiner's node sees of the student's, whatever earlier ones left there aside.

    Endpoints are named by phrases: "a publisher on camera/image".
    """

    def __init__(
        self,
        node: Node,
        *,
        publishes: Sequence[Topic] = (),
        subscribes: Sequence[Topic] = (),
        serves: Sequence[Service] = (),
    ) -> None:
        """Look through the eyes of ``node``; as yet nothing is left of anybody.

        Args:
            node: the examiner's.
            publishes: topics that the student's nodes publish on.
            subscribes: topics that they listen to.
            serves: their services.
        """
        self._node = node
        self._publishes, self._subscribes, self._serves = publishes, subscribes, serves
        self.types = {
            **{publisher_on(topic): type_name(topic.type) for topic in publishes},
            **{subscription_to(topic): type_name(topic.type) for topic in subscribes},
            **{service_called(service): type_name(service.type) for service in serves},
        }
        self._ghosts: set[bytes] = set()
        self._started: set[str] = set()
        self._participants: set[bytes] = set()
        self._marks: set[str] = set()

    def ignore_present(self) -> None:
        """Take what is there by now for ghosts of earlier nodes."""
        self._ghosts = {end for _, end in self._find_endpoints()}

    def note_started(self, node: str) -> None:
        """Note that ``node`` is one of the subject's: so is its participant."""
        self._started.add(node)

    def note_mark(self, node: str) -> None:
        """Note that ``node`` was made because the examiner asked for it."""
        self._marks.add(f"/{node}")

    def count(self, endpoint: str) -> int:
        """Return how many endpoints of a phrase there are."""
        return sum(
            what == endpoint and end not in self._ghosts for what, end in self._find_endpoints()
        )

    def list_endpoints(self, node: str = "") -> list[str]:
        """Return the endpoints that are on the graph, and whether ``node`` is."""
        there = {what for what, end in self._find_endpoints() if end not in self._ghosts}
        return [what for what in (*self.types, f"{NODE}{node}") if what in there]

    def list_nodes(self, *, process: bool = False) -> list[str]:
        """Return the nodes that are no ghosts, in the participants of those that were started.

        Not those of ours, nor the one hidden node that each session has. With ``process`` also
        those of other contexts in the same process: there is a node that a callback makes without
        a context.
        """
        size = GUID_PROCESS_BYTES if process else GUID_PREFIX_BYTES
        found = self._find_endpoints()
        ours = {participant[:size] for participant in self._participants}
        sessions: set[bytes] = set()
        made = []
        for what, end in found:
            name = what.removeprefix(NODE)
            if not what.startswith(NODE) or end in self._ghosts or end[:size] not in ours:
                continue
            participant = end[:GUID_PREFIX_BYTES]
            if SESSIONS_OWN.fullmatch(name) and participant not in sessions:
                sessions.add(participant)
            elif name not in self._marks:
                made.append(name)
        return made

    def list_leftovers(self, node: str) -> list[str]:
        """Return what is left on the graph: endpoints, ``node``, and helper nodes."""
        there = self.list_endpoints(node)
        helpers = dict.fromkeys(node_phrase(name) for name in self.list_nodes())
        return [*there, *(what for what in helpers if what not in there)]

    def list_missing(self, node: str) -> list[str]:
        """Return what ``node`` lacks on the graph, or has with another type, a sentence each."""
        there = self.list_endpoints(node)
        found = [
            f"There is no {what[2:]} on the graph." for what in self.types if what not in there
        ]
        for what, types in self._found_types().items():
            if what in there and self.types[what] not in types:
                found.append(
                    f"There is {what} of the type {as_phrase(sorted(types))}, "
                    f"not {self.types[what]}."
                )
        if not found and f"{NODE}{node}" not in there:
            found = [f"The node {node} is not on the graph."]
        return found

    def _found_types(self) -> dict[str, set[str]]:
        services = dict(self._node.get_service_names_and_types())
        publishers = self._node.get_publishers_info_by_topic
        subscriptions = self._node.get_subscriptions_info_by_topic
        return {
            **{
                publisher_on(t): {e.topic_type for e in publishers(t.name)} for t in self._publishes
            },
            **{
                subscription_to(t): {e.topic_type for e in subscriptions(t.name)}
                for t in self._subscribes
            },
            **{service_called(s): set(services.get(str(s), [])) for s in self._serves},
        }

    def _find_endpoints(self) -> list[tuple[str, bytes]]:
        publishers = self._node.get_publishers_info_by_topic
        subscriptions = self._node.get_subscriptions_info_by_topic
        found = {publisher_on(topic): publishers(topic.name) for topic in self._publishes}
        for topic in self._subscribes:
            found[subscription_to(topic)] = subscriptions(topic.name)
        for service in self._serves:
            # A service has no endpoints in ROS's eyes; in DDS it reads its requests.
            requests = subscriptions(f"rq/{service.name}Request", True)
            found[service_called(service)] = requests
        for end in publishers(PARAMETER_EVENTS):
            name = full_name(end.node_name, end.node_namespace)
            found.setdefault(f"{NODE}{name}", []).append(end)
            if name in self._started:
                self._participants.add(bytes(end.endpoint_gid)[:GUID_PREFIX_BYTES])
        return [(what, bytes(end.endpoint_gid)) for what, ends in found.items() for end in ends]
