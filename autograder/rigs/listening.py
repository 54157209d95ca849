"""Listening to the robot: late joiners, the rate of the camera, what is in a message."""

# mypy: allow-untyped-calls

from __future__ import annotations

import math
import re
import time
from typing import Any

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from autograder.rigs.robot import STEP, Picture, RobotRig

MOST_NUMBERS = 4
"""In an answer that says where the robot is: a position has three, and perhaps a station."""
PATIENCE = 1.0
"""Seconds of wall time that a stream may lag behind its clock in all, while it is counted."""


class LateJoiner:
    """A subscription that begins now and asks for what was published before, if that is kept.

    Attributes:
        durable: whether it is kept for those who join late.
        unkept: if not, why, as a phrase.
    """

    def __init__(self, rig: RobotRig, msg_type: Any, topic: str) -> None:
        """Subscribe to ``topic``."""
        offers = [e.qos_profile for e in rig.node.get_publishers_info_by_topic(topic)]
        self.durable = bool(offers) and all(
            offer.durability == DurabilityPolicy.TRANSIENT_LOCAL
            and offer.reliability == ReliabilityPolicy.RELIABLE
            for offer in offers
        )
        kept = any(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
        self.unkept = "TRANSIENT_LOCAL, but BEST_EFFORT" if kept else "VOLATILE"
        self.heard: list[Any] = []
        rig.node.listen(msg_type, topic, self.heard.append, durable=self.durable)


def rate(rig: RobotRig, seconds: float, expected: float) -> float:
    """Return how many pictures a second are published, by the node's clock.

    The clock goes on step by step, and each step waits for the picture that is due: a publisher in
    a thread of its own gets its turn as well as a timer does. A picture that was published after
    the last step proves that all before it have arrived.
    """
    pictures = rig.node.pictures
    before, budget = len(pictures), PATIENCE
    began = time.time_ns()
    for step in range(1, round(seconds / STEP) + 1):
        rig.step()
        due = before + math.floor(step * STEP * expected + 1e-6) - 1  # one may be on its way
        started = time.monotonic()
        rig.wait(lambda due=due: len(pictures) >= due, budget)  # type: ignore[misc]
        budget = max(0.0, budget - (time.monotonic() - started))
    ended = time.time_ns()
    rig.wait_stepping(lambda: pictures[-1].published >= ended, 1.0)
    return sum(began <= picture.published < ended for picture in list(pictures)) / seconds


def picture_fault(picture: Picture) -> str:
    """Return what is wrong with a picture, or an empty string."""
    if not picture.height or not picture.width or not picture.size:
        return f"It is empty: {picture.width} x {picture.height}, {picture.size} bytes."
    if picture.size != picture.height * picture.step:
        return (
            f"It has {picture.size} bytes, which are not {picture.height} rows of "
            f"{picture.step} bytes (step)."
        )
    return ""


def numbers(text: str) -> list[float]:
    """Return the numbers that stand in a text; none of a text that is a whole list of them."""
    found = re.findall(r"-?\d+(?:\.\d+)?(?:[eE][-+]?\d{1,2})?", text[:1000])
    return [float(number) for number in found] if len(found) <= MOST_NUMBERS else []
