"""What a name stands for on the graph, and which name was meant."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from autograder.observe.graph.name_patterns import find_near_miss, find_patterns


class FakeGraph:
    """A graph with what a test says it has."""

    def __init__(self, topics: dict[str, str] | None = None, **services: str) -> None:
        self.topics = topics or {}
        self.services = {f"/{name.replace('__', '/')}": kind for name, kind in services.items()}

    def get_publishers_info_by_topic(self, topic_name: str) -> list[Any]:
        kind = self.topics.get(topic_name)
        return [SimpleNamespace(topic_type=kind, endpoint_gid=bytes(24))] if kind else []

    def get_subscriptions_info_by_topic(self, topic_name: str) -> list[Any]:
        return []

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        return [(name, [kind]) for name, kind in self.topics.items()]

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        return [(name, [kind]) for name, kind in self.services.items()]

    def count_services(self, service_name: str) -> int:
        return int(self.services.get(service_name, "") not in ("", "client/only"))


def test_a_name_may_stand_for_several_patterns() -> None:
    graph = FakeGraph(
        {"/go": "std_msgs/msg/Empty"},
        go="std_srvs/srv/Trigger", go___action__send_goal="a/action/Go_SendGoal",
    )  # fmt: skip
    assert find_patterns(graph, "/go") == {
        "topic": "std_msgs/msg/Empty", "service": "std_srvs/srv/Trigger", "action": "a/action/Go",
    }  # fmt: skip


def test_a_service_that_has_clients_only_is_none() -> None:
    assert find_patterns(FakeGraph(go="client/only"), "/go") == {}


@pytest.mark.parametrize(
    ("there", "meant"),
    [
        ("/robot/go", ""),
        ("/node/robot/go", "/node/robot/go"),
        ("/robot/go/now", "/robot/go/now"),
        ("/other/go", "/other/go"),
        ("/known/go", ""),
        ("/robot/gone", ""),
    ],
)
def test_a_near_miss_ends_alike_or_has_something_added(there: str, meant: str) -> None:
    graph = FakeGraph({there: "std_msgs/msg/Empty"})
    assert find_near_miss(graph, "/robot/go", known=("/known/go",)) == meant
