"""Which pattern each part of a robot's interface really is, as the ROS graph shows it."""

from __future__ import annotations

from contextlib import suppress

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters

from autograder.examination.exam import Failed
from autograder.exercises.patterns.rig import SETTLE, RobotRig
from autograder.exercises.patterns.scenarios import NAMES, SCENARIOS, Scenario, would_mean
from autograder.observe.participants import of_others

SET_PARAMETERS = "rcl_interfaces/srv/SetParameters"
SPEED = "max_speed"
HARDWARE = ("/hardware/position", "/hardware/charge", "/hardware/speed")

SETTLE_AT_ONCE, SETTLE_OTHER = 1.0, 3.0
"""Seconds for what comes up with the node, and for a pattern beside another of the same name."""
WAKES, COARSE = 1.0, 0.1
"""Seconds of the node's clock for what is made by a timer, and between two moments of them."""
CHARGE_AT_START = 0.95

Patterns = dict[str, str]
"""{pattern: type on the graph} of one name."""


def find_patterns(rig: RobotRig, scenario: Scenario) -> Patterns:
    """Return the patterns that the subject offers for a scenario now, with their types."""
    name = f"/{NAMES[scenario]}"
    found = {}
    others = of_others(
        [
            *rig.node.get_publishers_info_by_topic(name),
            *rig.node.get_subscriptions_info_by_topic(name),
        ]
    )
    if others:
        found["topic"] = str(others[0].topic_type)
    services = dict(rig.node.get_service_names_and_types())
    if name in services and rig.node.count_services(name):
        found["service"] = str(services[name][0])
    goals = f"{name}/_action/send_goal"
    if goals in services and rig.node.count_services(goals):
        found["action"] = str(services[goals][0]).removesuffix("_SendGoal")
    if scenario == "parameters" and "service" not in found and parameter_node(rig) is not None:
        found["service"] = SET_PARAMETERS
    return found


def wait_for_patterns(
    rig: RobotRig, wanted: dict[Scenario, tuple[str, ...]]
) -> dict[Scenario, Patterns]:
    """Return what is seen of every scenario, once all that is wanted is there or had its time.

    What never came the last time is not waited for again while the notebook has not moved on.
    """
    known: set[Scenario] = rig.memory.setdefault("missing", set())
    found: dict[Scenario, Patterns] = {}

    def missing() -> list[Scenario]:
        for scenario in SCENARIOS:
            if not set(found.get(scenario, ())) & set(wanted[scenario]):
                found[scenario] = find_patterns(rig, scenario)
        return [s for s in SCENARIOS if not set(found[s]) & set(wanted[s])]

    if not rig.wait(lambda: known.issuperset(missing()), SETTLE_AT_ONCE):
        trigger_creation(rig)
        if not rig.wait(lambda: known.issuperset(missing()), SETTLE_OTHER - SETTLE_AT_ONCE):
            # Where something else is offered under the name, the wanted one has had its time.
            patience = rig.start_patience(SETTLE - SETTLE_OTHER, stepped=SETTLE_OTHER)
            patience.wait(rig.session, lambda: all(found[s] for s in missing()))
    known.update(missing())
    return found


def trigger_creation(rig: RobotRig) -> None:
    """Give what is made a moment later, or when it is first needed, a reason to be made."""
    with suppress(Failed):  # a callback that holds the clock up is another check's affair
        rig.report("charge", CHARGE_AT_START)
        rig.report("position", 0.0)
        rig.step(WAKES, COARSE)


def require_pattern(rig: RobotRig, scenario: Scenario, wanted: dict[str, str], needed: str) -> str:
    """Return which of the ``wanted`` {pattern: type or types} it is; the first of several.

    Raises:
        Failed: it is something else, or of another type.
    """
    found: Patterns = rig.memory["offers"][scenario]
    name = NAMES[scenario]
    for pattern, types in wanted.items():
        if pattern not in found:
            continue
        if found[pattern] not in types.split(" or "):
            raise Failed(
                expected=f"Made as {_a_or_an(pattern)}, {name} has the type {types}.",
                actual=f"On the ROS graph it is {_a_or_an(pattern)} of type {found[pattern]}.",
            )
        return pattern
    if not found and scenario == "parameters":
        actual = f"No node has a parameter {SPEED} with a number as its value, and there is no "
        actual += f"service or topic {name}{rig.error_note()}.{_near_miss(rig, name)}"
    elif not found:
        actual = f"Nothing of the name {name} is on the ROS graph{rig.error_note()}."
        actual += _near_miss(rig, name)
    else:
        pattern = next(iter(found))
        actual = f"On the ROS graph {name} is {_a_or_an(pattern)}. {would_mean(scenario, pattern)}"
    raise Failed(expected=needed, actual=actual)


def _near_miss(rig: RobotRig, name: str) -> str:
    """Return a remark on a name that somebody may have meant to be ``name``, or nothing.

    Of the same ending, such as a private one has, or with something added.
    """
    node = rig.node
    seen = [*node.get_topic_names_and_types(), *node.get_service_names_and_types()]
    last = name.rsplit("/", 1)[-1]
    for other in sorted(str(found).partition("/_action/")[0] for found, _ in seen):
        if other == f"/{name}":
            continue  # the examiner's own listener
        if f"/{name}/" in f"{other}/" or (other.endswith(f"/{last}") and other not in HARDWARE):
            return f" There is {other}, but the name is {name}."
    return ""


def _a_or_an(pattern: str) -> str:
    return "an action" if pattern == "action" else f"a {pattern}"


def parameter_node(rig: RobotRig) -> str | None:
    """Return the name under which the parameter can be set, or None if nobody has it (yet).

    The prefix of the service's name: of a node that declares it, say.
    """
    services = rig.node.get_service_names_and_types()
    for name, types in services:
        if types == [SET_PARAMETERS] and rig.node.count_services(name):
            prefix = str(name).removesuffix("/set_parameters")
            if prefix == name:
                continue  # an own service, which is found under its own name
            value = speed_limit(rig, prefix)
            if value is not None:
                return prefix
    return None


def speed_limit(rig: RobotRig, prefix: str) -> float | None:
    """Return the value of the parameter on a node, or None if it has none there.

    Whoever answers with something else than one value for one name has none.
    """
    name = f"{prefix}/get_parameters"
    if not rig.node.count_services(name):
        return None
    answer = rig.call(GetParameters, name, GetParameters.Request(names=[SPEED]))
    if answer is None or len(answer.values) != 1:
        return None
    value = answer.values[0]
    kinds = {
        ParameterType.PARAMETER_DOUBLE: "double_value",
        ParameterType.PARAMETER_INTEGER: "integer_value",
    }
    return float(getattr(value, kinds[value.type])) if value.type in kinds else None


def set_speed_limit(rig: RobotRig, value: float) -> tuple[bool, str]:
    """Set the parameter; return whether it was taken, and the reason that was given.

    Raises:
        Failed: there was no answer, or not one result for one parameter.
    """
    rig.untouched = False
    prefix = parameter_node(rig)
    service = f"{prefix}/set_parameters" if prefix is not None else f"/{NAMES['parameters']}"
    parameter = Parameter(
        name=SPEED,
        value=ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value),
    )
    answer = rig.call(SetParameters, service, SetParameters.Request(parameters=[parameter]))
    if answer is None or len(answer.results) != 1:
        what = "did not answer" if answer is None else f"gave {len(answer.results)} results"
        raise Failed(
            expected="A request to set max_speed gets one answer: taken, or refused with a reason.",
            actual=f"Asked for {value:g} m/s, {service} {what}{rig.error_note()}.",
        )
    (result,) = answer.results
    return bool(result.successful), str(result.reason)
