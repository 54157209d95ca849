"""Where the robot is: asking for it, overhearing it, and whether what comes is right."""

from __future__ import annotations

from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from autograder.exercises.patterns.discovery import LateJoiner, find_numbers, wait_for_discovery
from autograder.exercises.patterns.rig import Asker, RobotRig
from autograder.exercises.patterns.scenarios import NAMES

AGE = 0.5
"""Seconds of the node's time that a position may be old."""
CLOSE = 0.011  # m
NO_ANSWER = "nobody answered"
MOST_NUMBERS = 12
"""In an answer that says where the robot is: a date and a time, say, and a pose."""
LONGEST = 200  # characters of an answer that are shown


def position_fault(rig: RobotRig, asker: Asker, position: float, age: float = AGE) -> str:
    """Return what whoever wants to know the position learns if it is wrong, or an empty string.

    It is the end of a sentence, with its full stop. The hardware has reported the ``position``, and
    says no more: a callback may take its time over each report. ``age`` is how old it may be (s).
    """
    answer, right = "", False

    def is_settled() -> bool:
        nonlocal answer, right
        answer, found = asker(rig)
        right = any(abs(number - position) < CLOSE for number in found)
        return right or answer == NO_ANSWER

    rig.wait_stepping(is_settled, age)
    if right:
        return ""
    return answer if answer.endswith("?") else f"{answer}{rig.error_note()}."


def asker_by(rig: RobotRig, pattern: str) -> Asker:
    """Return a new way of finding out the position, by a service or a topic."""
    return ask_position if pattern == "service" else Overhearing(rig)


def ask_position(rig: RobotRig) -> tuple[str, list[float]]:
    """Ask by the service."""
    answer = rig.call(Trigger, NAMES["position"], Trigger.Request())
    if answer is None:
        return NO_ANSWER, []
    found = find_numbers(answer.message) if answer.success else []
    if len(found) > MOST_NUMBERS:
        return f"the answer holds {len(found)} numbers: which one is the position?", []
    text = answer.message[:LONGEST]
    return f"the answer was success={answer.success}, message={text!r}", found


class Overhearing:
    """Listens to the topic, from now on."""

    def __init__(self, rig: RobotRig) -> None:
        """Subscribe, and be known to the publisher."""
        self._late = LateJoiner(rig, Float64, NAMES["position"])
        wait_for_discovery(rig)

    def __call__(self, _: RobotRig) -> tuple[str, list[float]]:
        """Tell the newest message."""
        heard = [message.data for message in self._late.heard[-1:]]
        said = f"the newest message was {heard[0]:g}" if heard else "no message came"
        return f"{said} within {AGE:g} s", heard
