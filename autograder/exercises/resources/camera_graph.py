"""The graph as it concerns a camera driver: which of its endpoints and nodes are there."""

from __future__ import annotations

import re

from autograder.exercises.resources.camera_examiner import IMAGE, SNAPSHOT, ZOOM, ExaminerNode
from autograder.observe.participants import GUID_PREFIX_BYTES, NAMELESS
from autograder.observe.phrases import as_phrase
from course.runtime.ros_names import full_name

PUBLISHER = f"a publisher on {IMAGE}"
SUBSCRIPTION = f"a subscription to {ZOOM}"
SERVICE = f"a service {SNAPSHOT}"
NODE = "the node "
GUID_PROCESS = 8
"""Of these, the bytes that all participants of one process share, as Fast DDS makes them."""
SESSIONS_OWN = re.compile(r"/_course_\d+_[0-9a-f]+")
"""The one hidden node that a session of the course has (`course.runtime.requests.hidden_node`)."""
TYPES = {
    PUBLISHER: "sensor_msgs/msg/Image",
    SUBSCRIPTION: "std_msgs/msg/Int32",
    SERVICE: "std_srvs/srv/Trigger",
}


def describe_node(name: str) -> str:
    """Return one of the nodes that a graph gives for a reader.

    Of two that have one name, one is forgotten with the other, and its endpoints may stay.
    """
    if name.endswith(NAMELESS):
        return (
            "an endpoint of a node whose name is no longer known (its publisher on "
            "/parameter_events, which every node has)"
        )
    return f"{NODE}{name}"


class CameraGraph:
    """What the examiner's node sees of the driver, whatever an earlier one left there aside."""

    def __init__(self, node: ExaminerNode) -> None:
        """Look through the eyes of ``node``; as yet nothing is left of anybody."""
        self._node = node
        self._ghosts: set[bytes] = set()
        self._started: set[str] = set()
        self._participants: set[bytes] = set()
        self._marks: set[str] = set()

    def ignore_present(self) -> None:
        """Take what is there by now for ghosts."""
        self._ghosts = {end for _, end in self._find_endpoints()}

    def note_started(self, node: str) -> None:
        """Note that ``node`` is one of the subject's: so is its participant."""
        self._started.add(node)

    def note_mark(self, node: str) -> None:
        """Note that ``node`` was made because the examiner asked for it."""
        self._marks.add(f"/{node}")

    def count_publishers(self) -> int:
        """Return how many publishers there are on the image topic."""
        return sum(
            what == PUBLISHER and end not in self._ghosts for what, end in self._find_endpoints()
        )

    def list_endpoints(self, node: str = "") -> list[str]:
        """Return the driver's endpoints that are on the graph, and whether ``node`` is."""
        ours = (*TYPES, f"{NODE}{node}")
        there = {what for what, end in self._find_endpoints() if end not in self._ghosts}
        return [what for what in ours if what in there]

    def list_nodes(self, *, process: bool = False) -> list[str]:
        """Return the nodes that were made since this check began, in the driver's participant.

        Not those of ours, nor the one hidden node that each session has. With ``process`` also
        those of other contexts in the driver's process: there is a node that a callback makes
        without a context.
        """
        size = GUID_PROCESS if process else GUID_PREFIX_BYTES
        ours = {participant[:size] for participant in self._participants}
        sessions: set[bytes] = set()
        made = []
        for what, end in self._find_endpoints():
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
        """Return what is left of the driver on the graph: endpoints, ``node``, helper nodes."""
        there = self.list_endpoints(node)
        helpers = dict.fromkeys(describe_node(name) for name in self.list_nodes())
        return [*there, *(what for what in helpers if what not in there)]

    def list_missing(self, node: str) -> list[str]:
        """Return what the driver ``node`` lacks on the graph, or has with another type."""
        services = dict(self._node.get_service_names_and_types())
        types = {
            PUBLISHER: {e.topic_type for e in self._node.get_publishers_info_by_topic(IMAGE)},
            SUBSCRIPTION: {e.topic_type for e in self._node.get_subscriptions_info_by_topic(ZOOM)},
            SERVICE: set(services.get(f"/{SNAPSHOT}", [])),
        }
        there = self.list_endpoints(node)
        found = [f"There is no {what[2:]} on the graph." for what in TYPES if what not in there]
        found += [
            f"There is {what} of the type {as_phrase(sorted(types[what]))}, not {wanted}."
            for what, wanted in TYPES.items()
            if what in there and wanted not in types[what]
        ]
        if not found and f"{NODE}{node}" not in there:
            found = [f"The node {node} is not on the graph."]
        return found

    def _find_endpoints(self) -> list[tuple[str, bytes]]:
        found = {
            PUBLISHER: self._node.get_publishers_info_by_topic(IMAGE),
            SUBSCRIPTION: self._node.get_subscriptions_info_by_topic(ZOOM),
            # A service has no endpoints in ROS's eyes; in DDS it reads its requests.
            SERVICE: self._node.get_subscriptions_info_by_topic(f"rq/{SNAPSHOT}Request", True),
        }
        # Every node announces changes of its parameters: a node itself has no endpoint.
        for end in self._node.get_publishers_info_by_topic("/parameter_events"):
            name = full_name(end.node_name, end.node_namespace)
            found.setdefault(f"{NODE}{name}", []).append(end)
            if name in self._started:
                self._participants.add(bytes(end.endpoint_gid)[:GUID_PREFIX_BYTES])
        return [(what, bytes(end.endpoint_gid)) for what, ends in found.items() for end in ends]
