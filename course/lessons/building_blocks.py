"""Checks of chapter 5's small tasks: each looks at what the learner's cell does, on real DDS."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rclpy.publisher import Publisher
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32, String
from std_srvs.srv import Trigger

from course.errors import WaitTimeout
from course.lessons.checkpoint import (
    PATIENCE_S,
    Checkpoint,
    keep_looking,
    say_not_yet,
    say_yes,
)
from course.lessons.spiral import spiral_is_driven as spiral_is_driven
from course.runtime.core_session import CoreSession
from course.runtime.requests.actions import GoalRun, GoalState
from course.runtime.requests.recorder import Recorder

MOVED_M = 0.02
"""How far a robot must have come to have moved: more than noise, less than a second's drive."""

NEAREST_TOLERANCE_M = 0.3
"""How far two distances may differ: people walk, and the scans are not the same one."""


def robot_drives(session: CoreSession, track: Recorder) -> Checkpoint:
    """Say whether the robot has moved since `track`, a recording of its odometry, began."""

    def look() -> Checkpoint:
        places = [stamped.message.pose.pose.position for stamped in track.messages]
        if places and math.dist(*((at.x, at.y) for at in (places[0], places[-1]))) > MOVED_M:
            return say_yes("the robot drives. A message is one order, so it soon stops again.")
        return say_not_yet("the robot stands still. Its speed is 0.0: put 0.3 in its place.")

    return keep_looking(session, look)


def nearest_is_published(session: CoreSession) -> Checkpoint:
    """Say whether /nearest carries the smallest distance of /scan."""
    with (
        session.record("nearest", Float32) as said,
        session.record("scan", LaserScan) as scans,
    ):

        def look() -> Checkpoint:
            if not said.count or not scans.count:
                return say_not_yet("nothing was heard on /nearest. look() has to publish.")
            heard = said.messages[-1].message.data
            seen = [min(stamped.message.ranges) for stamped in scans.messages[-5:]]
            if any(math.isclose(heard, one, abs_tol=NEAREST_TOLERANCE_M) for one in seen):
                return say_yes(f"/nearest says {heard:.2f} m, for anybody who wants to know.")
            return say_not_yet(f"/nearest says {heard:.2f} m, the scan {seen[-1]:.2f} m.")

        return keep_looking(session, look)


def node_is_gone(session: CoreSession, name: str) -> Checkpoint:
    """Say whether a node has left the graph."""

    def look() -> Checkpoint:
        if name in session.observer.get_node_names():
            return say_not_yet(f"{name} is still there. Take the # away from the line above.")
        return say_yes(f"{name} is gone, with its publisher and its subscription.")

    return keep_looking(session, look)


def logger_hears(session: CoreSession, logger: Any, topic: str) -> Checkpoint:
    """Say whether a logger, which counts in `logger.count`, hears anything on its topic."""

    def look() -> Checkpoint:
        if logger.count:
            return say_yes("the logger hears the scans, and nobody else had to be changed.")
        return say_not_yet(f"nobody publishes what the logger listens for, /{topic}.")

    return keep_looking(session, look)


def images_arrive(session: CoreSession, publisher: Publisher, seen: Sequence[Any]) -> Checkpoint:
    """Publish five images, and say whether they arrive in `seen`."""

    def matched() -> Checkpoint:
        if publisher.get_subscription_count():
            return say_yes("the two ends fit.")
        return say_not_yet("the display is not connected: it requests more than is offered.")

    found = keep_looking(session, matched)
    for number in range(1, 6):
        publisher.publish(String(data=f"image {number}"))
    if not found.passed:
        return found

    def look() -> Checkpoint:
        if len(seen) == 5:
            return say_yes("the offer is as good as the request, and five images arrived.")
        return say_not_yet(f"{len(seen)} of 5 images arrived.")

    return keep_looking(session, look)


def late_reader_remembers(session: CoreSession, reader: Recorder) -> Checkpoint:
    """Say whether a late reader was given the notices that had been posted before it came."""

    def look() -> Checkpoint:
        if any(stamped.message.data == "notice 3" for stamped in reader.messages):
            return say_yes("the reader came late, and has the notices 3, 4 and 5 all the same.")
        return say_not_yet("the reader knows only what was posted after it came.")

    return keep_looking(session, look)


def latest_five_are_kept(kept: Sequence[Any]) -> Checkpoint:
    """Say whether these messages are the scans 26 to 30."""
    numbers = [message.data for message in kept]
    if numbers == ["26", "27", "28", "29", "30"]:
        return say_yes("the planner found the five latest scans, and nothing older.")
    scans = "scan" if len(numbers) == 1 else "scans"
    return say_not_yet(f"the planner found {len(numbers)} {scans}. The depth is that number.")


def guess_holds(guess: Any, seen: int, things: str) -> Checkpoint:
    """Say whether a number that was said before is the one that was seen."""
    if guess is ...:
        return say_not_yet("no guess yet. Put a number in place of the three dots.")
    if guess == seen:
        return say_yes(f"{seen} {things}, as you said.")
    return say_not_yet(f"you said {guess!r}. It is another number of {things}: look again.")


def diagram_is_counted(guess: Any) -> Checkpoint:
    """Say whether this is the number of nodes in the chapter's diagram."""
    return guess_holds(guess, 7, "nodes in the diagram")


def emergency_is_noted(session: CoreSession, text: Any) -> Checkpoint:
    """Publish a text on /emergency/stop, and say whether ProcessingNode notes it as critical."""
    if text is ...:
        return say_not_yet("no button was pressed. Put a text in quotes in place of the dots.")
    session.publish("emergency/stop", String(data=str(text)))

    def look() -> Checkpoint:
        if f"CRITICAL: {text}" in session.logs("processing_node", level="WARN").messages:
            return say_yes(f"ProcessingNode noted “CRITICAL: {text}”.")
        return say_not_yet("ProcessingNode has not noted it.")

    return keep_looking(session, look)


def robot_is_active(response: Any) -> Checkpoint:
    """Say whether the response of /set_robot_mode is that the robot is ACTIVE."""
    if response.message.endswith("ACTIVE"):
        return say_yes("the robot is ACTIVE, and the client knows it: it has the response.")
    return say_not_yet(f"the answer was “{response.message}”. ACTIVE is data=True.")


def how_far_answers(session: CoreSession) -> Checkpoint:
    """Say whether the service /how_far answers with a distance."""
    try:
        response = session.call(Trigger, "how_far", Trigger.Request(), timeout=2 * PATIENCE_S)
    except WaitTimeout as error:
        return say_not_yet(str(error))
    if not response.message:
        return say_not_yet("the service answered, with an empty message.")
    return say_yes(f"the service answered “{response.message}”.")


def callback_got_its_answer(answers: Sequence[Any]) -> Checkpoint:
    """Say whether a blocking call inside a callback had its answer."""
    if answers and answers[0] is not None:
        return say_yes("the response had a group of its own, and could be processed.")
    return say_not_yet("the node waited for an answer that it kept itself from reading.")


def goal_ends_with(goal: GoalRun, number: int) -> Checkpoint:
    """Say whether the last number of a goal's result is this one."""
    if not goal.accepted or goal.result is None:
        return say_not_yet("the goal was rejected: an order is a number from 0 to 46.")
    last = goal.result.sequence[-1]
    if last == number:
        return say_yes(f"{number} it is, after {len(goal.feedback)} feedback messages.")
    return say_not_yet(f"the last number is {last}, not {number}.")


def goal_was_canceled(goal: GoalRun) -> Checkpoint:
    """Say whether a goal was canceled on its way."""
    if goal.status == GoalState.CANCELED and goal.result is not None:
        done = len(goal.result.sequence)
        return say_yes(f"it was canceled when {done} of its numbers were there.")
    return say_not_yet(f"it ran to its end, {goal.status}.")


def hospital_patterns(choice: Mapping[str, Any]) -> Checkpoint:
    """Say whether vital signs, a lab result and a surgery were given their patterns, in order."""
    reasons = {
        "topic": "a stream for many readers, all day",
        "service": "one question and one answer",
        "action": "long, and followed from start to finish",
    }
    for (case, chosen), (pattern, reason) in zip(choice.items(), reasons.items(), strict=True):
        if chosen is ...:
            return say_not_yet(f"choose one for “{case}”.")
        if str(chosen).strip().lower() != pattern:
            return say_not_yet(f"not {chosen!r} for “{case}”: think of {reason}.")
    return say_yes("a stream is a topic, a question is a service, a task is an action.")


def client_made_two_rounds(session: CoreSession) -> Checkpoint:
    """Say whether ClientNode has had two responses of the service."""

    def look() -> Checkpoint:
        said = session.logs("client_node", last=None).messages
        rounds = sum(text.startswith("Service response") for text in said)
        done = sum(text.startswith("Action result") for text in said)
        if rounds >= 2 and done >= 1:
            return say_yes(f"{rounds} rounds, and every one without waiting.")
        return say_not_yet(f"the client made {rounds} round in that time. Two take 10 s.")

    return keep_looking(session, look, 2 * PATIENCE_S)
