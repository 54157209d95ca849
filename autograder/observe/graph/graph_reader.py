"""Reads the graph of the student's nodes off DDS, whole: what is missing then is missing, not late.

Each end of a service or an action is known by its DDS endpoint, as those of topics are: see
https://design.ros2.org/articles/topic_and_service_names.html.
"""

from __future__ import annotations

import re
import secrets
from collections import Counter
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import Failed
from autograder.observe.graph.ros_graph import End, GraphService, GraphTopic, RosGraph
from autograder.observe.participants import (
    NO_NODE,
    count_listening,
    known_participants,
    node_of,
    of_others,
    participant_of,
)
from autograder.observe.patience import SETTLE_S, Patience
from autograder.observe.stillness import Stillness
from course.errors import WaitTimeout
from course.runtime.requests.service_ends import reply_topic, request_topic
from course.runtime.ros_names import full_name

INFRASTRUCTURE = frozenset(
    f"/{name}" for name in ("rosout", "parameter_events", "clock", "tf", "tf_static", "diagnostics")
)
"""Topics that nobody in particular reads or writes."""
USUAL_PARTICIPANTS = 2
"""The examiner's, and the one that all of the student's nodes in one session share."""
COMES_UP_S = 4 * SETTLE_S
"""Seconds after which a small node beside the student's has come up on the busiest of machines."""
AT_REST_S = 3.0
"""Seconds of a busy process after which what it has made counts as discovered."""

_OF_EVERY_NODE = ("rcl_interfaces/", "type_description_interfaces/", "lifecycle_msgs/")
_TRANSITIONS = "lifecycle_msgs/msg/TransitionEvent"
"""What every lifecycle node publishes, whether anybody wants to know or not."""
_OF_ACTION = re.compile(r".*/_action/(feedback|status)")
_REQUEST = re.compile(r"rq(?P<name>/.+)Request")
_SEND_GOAL = "/_action/send_goal"
_OTHER_SERVICES_OF_ACTION = ("/_action/cancel_goal", "/_action/get_result")
_REQUEST_TYPE = re.compile(r"(\w+)::(srv|action)::dds_::(\w+?)(_SendGoal)?_Request_")


class GraphReader:
    """Reads the graph of the student's nodes through a node of the examiner's."""

    def __init__(self, bench: CheckContext, node: Node) -> None:
        """Read nothing yet."""
        self._bench, self._node = bench, node
        self._marks: set[str] = set()

    def read(self) -> RosGraph:
        """Return the graph when all is on it that the student's nodes have by now.

        DDS announces a process's endpoints in order, so a small node is made beside the student's:
        when it is seen, so is all that was there before it. It is left out of the graph.

        Raises:
            Failed: that node is not seen.
            SubjectGone: the student's process ended or hangs.
        """
        mark = f"_mark_{secrets.token_hex(4)}"
        self._marks.add(f"/{mark}")
        self._bench.subject.mark(mark)
        if not self._wait(lambda: self._sees(mark), COMES_UP_S):
            raise Failed(
                expected="What your program makes comes up on the ROS graph.",
                actual="A small node that was made beside yours did not within "
                f"{COMES_UP_S:.0f} s: does something in the notebook keep the process from talking "
                "to others?",
            )
        self._discover_other_contexts()
        graph = read_graph(self._node, self._marks)
        if NO_NODE in graph.nodes:  # each participant tells its names in its own time
            self._wait(lambda: NO_NODE not in read_graph(self._node, self._marks).nodes, SETTLE_S)
            graph = read_graph(self._node, self._marks)
        return graph

    def _wait(self, condition: Callable[[], bool], seconds: float) -> bool:
        with suppress(WaitTimeout):
            self._bench.session.until(condition, seconds, "the graph")
            return True
        return False

    def _sees(self, mark: str) -> bool:
        sides = (
            self._node.get_publishers_info_by_topic(f"/{mark}"),
            self._node.get_subscriptions_info_by_topic(f"/{mark}"),
        )
        return all(any(end.node_name == mark for end in side) for side in sides)

    def _discover_other_contexts(self) -> None:
        """Wait for what is in participants of other contexts: the mark tells of its own alone."""
        still, session = Stillness(self._bench.outside), self._bench.session
        Patience(still).wait(
            session,
            lambda: len(known_participants(self._node)) >= count_listening(session.domain_id),
        )
        if len(known_participants(self._node)) > USUAL_PARTICIPANTS:
            still.wait_for_rest(timeout=AT_REST_S)


def read_graph(node: Node, left_out: Collection[str] = ()) -> RosGraph:
    """Return what ``node`` sees on the ROS graph now, without the examiner's own endpoints.

    Left out, too, is what every node has (parameters, the log). Hidden nodes count as others do, as
    soon as they have an endpoint here; so do endpoints that no node is known to have.

    Args:
        node: one of the examiner's.
        left_out: topics that do not count.
    """
    reader = _Endpoints(node)
    topics, services, actions = [], [], []
    for name, _ in node.get_topic_names_and_types():
        if name not in INFRASTRUCTURE and name not in left_out and not _OF_ACTION.fullmatch(name):
            topic = reader.read_topic(name, name)
            if topic.readers or topic.types not in ((), (_TRANSITIONS,)):
                topics.append(topic)
    for raw, _ in node.get_topic_names_and_types(no_demangle=True):
        request = _REQUEST.fullmatch(raw)
        if request and (service := reader.read_service(request["name"])) is not None:
            if service.name.endswith(_SEND_GOAL):
                service.name = service.name.removesuffix(_SEND_GOAL)
                actions.append(service)
            else:
                services.append(service)
    # A node has no endpoint itself: of those without any that counts, the name is all there is.
    count = reader.count_names()
    graph = RosGraph.of(topics, services, actions, [name for name in count if "/_" not in name])
    apart = reader.names_apart()
    graph.namesakes = frozenset(name for name in graph.nodes if max(count[name], apart[name]) > 1)
    return graph


class _Endpoints:
    """Reads endpoints off the graph through one node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._participants: dict[str, set[bytes]] = {}

    def read_topic(self, name: str, raw: str, *, no_mangle: bool = False) -> GraphTopic:
        """Return a topic as ``name``; ``raw`` is what it is called, on DDS with ``no_mangle``."""
        return GraphTopic(
            name,
            self._read_ends(self._node.get_publishers_info_by_topic(raw, no_mangle)),
            self._read_ends(self._node.get_subscriptions_info_by_topic(raw, no_mangle)),
        )

    def read_service(self, name: str) -> GraphService | None:
        """Return a service, by the topics that ROS 2 makes of it; None if it does not count."""
        if name.endswith(_OTHER_SERVICES_OF_ACTION):
            return None
        requests = self.read_topic(name, request_topic(name), no_mangle=True)
        replies = self.read_topic(name, reply_topic(name), no_mangle=True)
        types = [_service_type(end.type) for end in (*requests.readers, *requests.writers)]
        if not types or (requests.readers and types[0].startswith(_OF_EVERY_NODE)):
            return None
        servers, clients = set(requests.read_by), set(requests.written_by)
        return GraphService(name, types[0], servers, clients, (requests, replies))

    def _read_ends(self, infos: Iterable[TopicEndpointInfo]) -> tuple[End, ...]:
        ends = []
        for info in of_others(infos):
            node = node_of(info)
            if node != NO_NODE:
                self._participants.setdefault(node, set()).add(participant_of(info))
            ends.append(End(node, info.topic_type, info.qos_profile))
        return tuple(ends)

    def count_names(self) -> Counter[str]:
        """Return how many nodes there are of each full name, without the reading one."""
        count = Counter(
            full_name(name, space) for name, space in self._node.get_node_names_and_namespaces()
        )
        count[self._node.get_fully_qualified_name()] -= 1  # another of this name is not ours
        return +count

    def names_apart(self) -> Counter[str]:
        """Return in how many participants each name has endpoints."""
        return Counter({name: len(found) for name, found in self._participants.items()})


def _service_type(dds_type: str) -> str:
    """Return the ROS type of a service or an action of which DDS knows the type of its requests."""
    found = _REQUEST_TYPE.fullmatch(dds_type)
    return f"{found[1]}/{found[2]}/{found[3]}" if found else dds_type
