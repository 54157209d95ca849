"""Which pattern each part of the robot's interface really is, as the ROS graph shows it."""

from __future__ import annotations

from contextlib import suppress

from autograder.examination.exam import Failed
from autograder.exercises.patterns.robot import CHARGE, POSITION, SPEED, Robot
from autograder.exercises.patterns.scenarios import CHOICES, SCENARIOS
from autograder.observe.graph.name_patterns import (
    Patterns,
    find_near_miss,
    find_patterns,
    with_article,
)
from autograder.observe.stepped_time.declared_parameters import SET_PARAMETERS

AT_ONCE_S = 0.4
"""Seconds for what comes up with the node."""
WAKES_S, COARSE_S = 1.0, 0.1
"""Seconds of the node's clock for what is made by a timer, and between two moments of them."""
CHARGE_AT_START = 0.95


def await_patterns(robot: Robot) -> None:
    """Note what is offered, once what can be used is there for every scenario or had its time.

    The node's clock stands still when it returns.
    """
    robot.found.offers = {name: {} for name in SCENARIOS}

    def is_usable(name: str) -> bool:
        if not find_usable(robot, name):
            robot.found.offers[name] = _find_offered(robot, name)
        return bool(find_usable(robot, name))

    # Parameters last: nodes have to be asked for them, and nobody is at rest meanwhile.
    names = sorted(SCENARIOS, key=lambda name: name == "parameters")

    def all_there() -> bool:
        return all(map(is_usable, names))

    if robot.wait(all_there, AT_ONCE_S):
        robot.note_standstill()
        return
    _trigger_creation(robot)
    robot.drain()
    robot.note_standstill()  # what follows is part of the time in which it stands still
    robot.wait(all_there)
    for name in names:  # also those after the first that is missing
        is_usable(name)


def find_usable(robot: Robot, name: str) -> str:
    """Return as which pattern a scenario can be used, the first of several; empty if as none."""
    found, works_as = robot.found.offers[name], SCENARIOS[name].works_as
    usable = [
        pattern for pattern in works_as if found.get(pattern) in works_as[pattern].split(" or ")
    ]
    return usable[0] if usable else ""


def _find_offered(robot: Robot, name: str) -> Patterns:
    found = find_patterns(robot.node, f"/{SCENARIOS[name].topic}")
    if name == "parameters" and "service" not in found and robot.max_speed.find_node():
        found["service"] = SET_PARAMETERS
    return found


def _trigger_creation(robot: Robot) -> None:
    """Give what is made a moment later, or when it is first needed, a reason to be made."""
    with suppress(Failed):  # a callback that holds the clock up is another check's affair
        robot.report(CHARGE, CHARGE_AT_START)
        robot.report(POSITION, 0.0)
        robot.step(WAKES_S, COARSE_S)


def require_pattern(robot: Robot, name: str) -> str:
    """Require that a scenario can be used; return as which pattern."""
    scenario, found = SCENARIOS[name], robot.found.offers[name]
    if usable := find_usable(robot, name):
        return usable
    for pattern, type_name in found.items():
        if types := scenario.works_as.get(pattern):
            raise Failed(
                expected=f"Made as {with_article(pattern)}, {scenario.topic} has the type {types}.",
                actual=f"On the ROS graph it is {with_article(pattern)} of type {type_name}.",
            )
        meaning = CHOICES.questions[name].meanings[pattern]
        raise Failed(
            expected=scenario.needed,
            actual=f"On the ROS graph {scenario.topic} is {with_article(pattern)}. {meaning}",
        )
    actual = f"Nothing of the name {scenario.topic} is on the ROS graph"
    if name == "parameters":
        actual = "No node has a parameter max_speed with a number as its value, and there is no "
        actual += f"service or topic {scenario.topic}"
    actual += f"{robot.error_note()}."
    known = [str(topic) for topic in (POSITION, CHARGE, SPEED)]
    if other := find_near_miss(robot.node, f"/{scenario.topic}", known):
        actual += f" There is {other}, but the name is {scenario.topic}."
    raise Failed(expected=scenario.needed, actual=actual)
