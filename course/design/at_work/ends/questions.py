"""What a node asks by services: for a map, and for a way."""

from __future__ import annotations

from typing import Any, Protocol

from rclpy.client import Client
from rclpy.task import Future

from course.design.at_work.meanings import Meaning, hands_out_map, hands_out_places
from course.design.at_work.places import messages as places
from course.design.at_work.places.place import MAP
from course.design.at_work.worker import Worker
from course.design.endpoints import DesignEndpoint


class AskingNode(Protocol):
    """What is used of a node."""

    @property
    def now_s(self) -> float:
        """What its clock says, in s."""

    def create_client(self, srv_type: Any, srv_name: str, *, qos_profile: Any) -> Client:
        """Make a client, as every node does."""


class Questions:
    """The services that a node calls; what comes back goes to its worker."""

    def __init__(self, node: AskingNode, worker: Worker) -> None:
        """Have none yet."""
        self._node, self._worker = node, worker
        self._map_clients: list[tuple[Client, Any]] = []
        self._plan_clients: list[tuple[Client, Any]] = []

    def add(self, end: DesignEndpoint) -> None:
        """Make the client of an endpoint."""
        client = self._node.create_client(end.type, end.full_name, qos_profile=end.qos)
        if hands_out_map(end.type):
            self._map_clients.append((client, end.type))
        elif hands_out_places(end.type):
            self._plan_clients.append((client, end.type))

    def ask_for_way(self) -> None:
        """Ask for a way from here to the goal, as far as both are known and there is room."""
        goal, pose = self._worker.goal, self._worker.pose(self._node.now_s)
        for client, srv_type in self._plan_clients:
            request = srv_type.Request()
            fields = places.place_fields(request)
            if fields and (goal is None or goal[1] != MAP):
                continue
            if fields[1:]:
                if pose is None:
                    continue
                places.write_places(fields[0], [pose], MAP)
            if fields and goal is not None:
                places.write_places(fields[-1], goal[0], MAP)
            if client.service_is_ready():
                client.call_async(request).add_done_callback(self._take_way)

    def ask_for_map(self) -> None:
        """Ask for a map, until there is one."""
        for client, srv_type in self._map_clients:
            if self._worker.grid is None and client.service_is_ready():
                future = client.call_async(srv_type.Request())
                future.add_done_callback(self._take_map)

    def _take_way(self, future: Future) -> None:
        if not future.cancelled() and future.exception() is None:
            way = places.read_places(future.result(), MAP)
            self._worker.hear_way(Meaning.PATH, way, self._node.now_s)

    def _take_map(self, future: Future) -> None:
        if not future.cancelled() and future.exception() is None:
            self._worker.hear_map(future.result().map)
