"""A number over the ROS graph: who has it, and what becomes of a wish to set it."""

from __future__ import annotations

from typing import Any

import pytest
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter as RosParameter

from autograder.examination.exam import Failed
from autograder.observe import Parameter
from autograder.observe.stepped_time.declared_parameters import SET_PARAMETERS, DeclaredParameter

LIMIT = Parameter("limit", 0.5)


class FakeObserver:
    """Asks nodes that are dictionaries of parameters, and refuse what is below 0."""

    def __init__(self, own: bool = False, **nodes: dict[str, Any]) -> None:
        self.nodes, self.node = nodes, self
        self.services = [f"/{n}/{kind}_parameters" for n in nodes for kind in ("set", "get")]
        self.services += ["/own/limit"] * own

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        return [
            (name, [SET_PARAMETERS if "/get_" not in name else "rcl_interfaces/srv/GetParameters"])
            for name in self.services
        ]

    def count_services(self, name: str) -> int:
        return self.services.count(name)

    def error_note(self) -> str:
        return " (an error)"

    def call(self, kind: Any, name: str, request: Any) -> Any:
        declared = self.nodes.get(name.split("/")[1], {})
        if kind is GetParameters:
            values = [
                RosParameter("x", value=declared.get(n)).to_parameter_msg().value
                for n in request.names
            ]
            return GetParameters.Response(values=values * declared.get("answers", 1))
        (wanted,) = request.parameters
        good = wanted.value.double_value >= 0
        if good and name != "/own/limit":
            declared[wanted.name] = wanted.value.double_value
        result = SetParametersResult(successful=good, reason="" if good else "too low")
        return SetParameters.Response(results=[result]) if "mute" not in declared else None


def declared(observer: FakeObserver) -> DeclaredParameter:
    return DeclaredParameter(observer, LIMIT, "/own/limit")  # type: ignore[arg-type]


def test_the_node_is_the_one_that_has_a_number_of_this_name() -> None:
    limit = declared(FakeObserver(a={}, b={"limit": "fast"}, c={"limit": True}, d={"limit": 2}))
    assert limit.find_node() == "/d"
    assert limit.get() == 2.0
    limit.require(2.0)
    with pytest.raises(Failed, match=r"`limit` is 0\.5.*It is 2"):
        limit.require(0.5)


def test_who_answers_with_two_values_has_none() -> None:
    assert declared(FakeObserver(a={"limit": 0.5, "answers": 2})).find_node() is None


def test_what_becomes_of_a_wish_is_read_back() -> None:
    limit = declared(FakeObserver(a={"limit": 0.5}))
    limit.set(0.7).require_accepted()
    limit.set(-1.0).require_refused()
    assert limit.get() == limit.last_set == 0.7


def test_a_service_of_its_own_cannot_be_read() -> None:
    limit = declared(FakeObserver(own=True))
    assert limit.get() is None
    limit.require(0.5)
    limit.set(0.7).require_accepted()
    limit.set(-1.0).require_refused()
    assert limit.last_set == 0.7


def test_no_answer_is_a_finding() -> None:
    limit = declared(FakeObserver(a={"limit": 0.5, "mute": True}))
    with pytest.raises(Failed, match="/a/set_parameters did not answer \\(an error\\)"):
        limit.set(0.7)
