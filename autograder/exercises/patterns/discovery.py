"""Listening to the robot: who knows whom, late joiners, and the numbers in an answer."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from autograder.exercises.patterns.rig import RobotRig

_NUMBER = r"-?\d+(?:\.\d+)?(?:[eE][-+]?\d{1,2})?"


class LateJoiner:
    """A subscription that begins now and asks for what was published before, if that is kept.

    Attributes:
        durable: whether it is kept for those who join late.
        unkept: if not, why, as a phrase.
    """

    def __init__(self, rig: RobotRig, msg_type: Any, topic: str) -> None:
        """Subscribe to ``topic``."""
        offers = [e.qos_profile for e in rig.node.get_publishers_info_by_topic(topic)]
        reliable = bool(offers) and all(
            offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers
        )
        self.durable = reliable and all(
            offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers
        )
        kept = any(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
        self.unkept = "TRANSIENT_LOCAL, but BEST_EFFORT" if kept else "VOLATILE"
        self.heard: list[Any] = []
        rig.node.listen(msg_type, topic, self.heard.append, durable=self.durable, reliable=reliable)


def find_numbers(text: str) -> list[float]:
    """Return the numbers that stand in a text."""
    return [float(number) for number in re.findall(_NUMBER, text[:1000])]


def wait_for_discovery(rig: RobotRig) -> None:
    """Return when the subject knows every endpoint that the examiner has made so far.

    DDS makes endpoints known in the order in which they were made. So once a client that is newer
    than all of them gets an answer, the subject's writers know the earlier readers, too.
    """
    if name := _answering_service(rig):
        client = rig.node.create_client(GetParameters, name)
        if rig.wait(client.service_is_ready):
            rig.wait(client.call_async(GetParameters.Request()).done)
        rig.node.destroy_client(client)


def hear_out(rig: RobotRig) -> None:
    """Return when what the subject has sent so far has come in: it has answered since."""
    if name := _answering_service(rig):
        rig.call(GetParameters, name, GetParameters.Request())


def wait_for_arrival(
    rig: RobotRig, condition: Callable[[], bool], seconds: float, step: float
) -> bool:
    """Let the student's clock run until what was sent makes ``condition`` hold; return if it did.

    For a moment from which another is reckoned: on a busy machine `RobotRig.wait_stepping` may
    notice some steps late. ``seconds`` and ``step`` are of simulated time.
    """
    began = rig.elapsed
    hear_out(rig)
    while not condition():
        if seconds - (rig.elapsed - began) <= step / 2:
            return rig.wait(condition)
        rig.step(step)
        hear_out(rig)
    return True


def _answering_service(rig: RobotRig) -> str | None:
    """Return a service that every node of the subject's has, unless it was made without."""
    for name, types in rig.node.get_service_names_and_types():
        if types == ["rcl_interfaces/srv/GetParameters"] and rig.node.count_services(name):
            return name
    return None
