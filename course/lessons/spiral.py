"""The check of chapter 5's finale: five nodes drive a robot along a Fibonacci spiral."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from course.lessons.checkpoint import Checkpoint, keep_looking, say_not_yet, say_yes
from course.runtime.core_session import CoreSession
from course.runtime.requests.recorder import Recorder

ROUND_TRIP_DEG = (270.0, 540.0)
"""How much four quarter circles may turn a robot that needs time to speed up and to brake."""

SPIRAL_PATIENCE_S = 120.0
"""Seconds for five of waiting and a drive of eleven, also on a busy machine."""


def spiral_is_driven(session: CoreSession, world: Any, track: Recorder) -> Checkpoint:
    """Wait for ClientNode's first goal, and say whether the robot drove a spiral for it.

    Args:
        session: the session of the five nodes.
        world: the robot's world.
        track: a recording of the robot's odometry since before it moved.
    """

    def has_result() -> Checkpoint:
        said = session.logs("client_node", last=None).messages
        if any(text.startswith("Action result") for text in said):
            return say_yes("the drive is over.")
        return say_not_yet("ClientNode has no result yet. Is the emergency stop pressed?")

    if not (found := keep_looking(session, has_result, SPIRAL_PATIENCE_S)).passed:
        return found
    turned = math.degrees(turning_of([stamped.message for stamped in track.messages]))
    least, most = ROUND_TRIP_DEG
    if not least <= turned <= most:
        return say_not_yet(
            f"the robot turned by {turned:.0f}° on its way; four quarter circles are 360°. It "
            "turns with speed / radius."
        )
    if world.simulation.describe_moment()["robot"]["touching"]:
        return say_not_yet("the robot has driven into something. Run the cell again.")
    return say_yes(f"a spiral: the robot turned by {turned:.0f}° on its way.")


def turning_of(track: Sequence[Any]) -> float:
    """Return by how much a robot turned to the left over all, in rad.

    Args:
        track: nav_msgs/Odometry messages in order, less than half a turn from each to the next.
    """
    headings = [
        2.0 * math.atan2(message.pose.pose.orientation.z, message.pose.pose.orientation.w)
        for message in track
    ]
    steps = itertools.pairwise(headings)
    return sum(math.remainder(later - earlier, 2.0 * math.pi) for earlier, later in steps)
