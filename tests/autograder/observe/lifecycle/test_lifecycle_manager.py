"""A lifecycle node is driven through its states, and what keeps it from them is told."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import pytest
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

from autograder.examination.exam import Failed
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.lifecycle.lifecycle_manager import LifecycleManager, find_lifecycle_node
from autograder.observe.lifecycle.observer import Observer
from autograder.observe.nouns import Parameter
from autograder.processes.outside.asking import Here
from course import Session


class Lamp(LifecycleNode):  # type: ignore[misc]
    """A managed node whose volts must be below 50."""

    def __init__(self) -> None:
        super().__init__("lamp")
        self.declare_parameter("volts", 12.0)

    def on_configure(self, state: Any) -> TransitionCallbackReturn:
        """Refuse what would burn it."""
        good = self.get_parameter("volts").value < 50.0
        return TransitionCallbackReturn.SUCCESS if good else TransitionCallbackReturn.FAILURE


@pytest.fixture
def observer() -> Iterator[Observer]:
    with Session() as session:
        session.run(Lamp)
        yield Observer(session, Here(os.getpid()), session.run(QuietNode, "examiner"))


def test_it_goes_through_its_states_and_is_shut_down_from_any(observer: Observer) -> None:
    lamp = LifecycleManager(observer, "/lamp", "Lamp")
    assert find_lifecycle_node(observer, "/lamp", lambda: ["/lamp", "/examiner"]) == "/lamp"
    lamp.require_defaults(Parameter("volts", 12.0))
    lamp.make_transitions("configure", "activate", "deactivate", "cleanup", "configure")
    assert lamp.get_state() == "inactive"
    assert lamp.attempt_transition("shutdown") == "finalized"
    with pytest.raises(Failed, match="It says that its state is “finalized”"):
        lamp.attempt_transition("shutdown")


def test_what_it_refuses_is_told(observer: Observer) -> None:
    lamp = LifecycleManager(observer, "/lamp", "Lamp")
    with pytest.raises(Failed, match=r"volts was 12\.0"):
        lamp.require_defaults(Parameter("volts", 24.0))
    with pytest.raises(Failed, match="device was not there"):
        lamp.require_defaults(Parameter("device", "front"))
    assert not lamp.set_parameters(amps=1.0)
    lamp.require_parameters(volts=230.0)
    assert lamp.attempt_transition("configure") == "unconfigured"
    with pytest.raises(Failed, match="After “configure” with volts=230 your node is inactive"):
        lamp.make_transitions("configure")
