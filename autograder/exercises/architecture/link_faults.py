"""Why a job is not done or a link does not connect: sentences for the student, from the graph."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from autograder.exercises.architecture.robot_graph import Offer, RobotGraph, Topic
from autograder.exercises.architecture.robot_roles import (
    ACTION,
    CLOUDS,
    IMAGES,
    MAP,
    MAP_SERVICES,
    MAP_TYPE,
    MOTORS,
    NO_PLACE,
    NOT_OBSTACLES,
    ONWARD,
    POSES,
    SENSORS,
    WHEELS,
    Jobs,
    is_told_others,
)
from autograder.observe.marked_types import TypeNotInstalledError, bears_marks, load_type
from autograder.observe.qos_refusal import find_refusal
from course.design import message_tags


def similar_name(name: str, graph: RobotGraph) -> str:
    """Return a remark on a topic whose name is nearly ``name``, or nothing."""
    last = name.rsplit("/", 1)[-1]
    close = [other for other in graph.topics if other != name and other.endswith(f"/{last}")]
    return f" (there is {close[0]}, but the name is {name})" if close else ""


def describe_substitute(graph: RobotGraph) -> str:
    """Return a remark on what stands in the place of the navigation action, or nothing."""
    if service := graph.services.get(ACTION):
        return f"; {name_nodes(service.servers) or 'nobody'} serves {ACTION} as a service"
    if ACTION in graph.topics:
        return f"; {ACTION} is a topic"
    if others := [name for name, offer in graph.actions.items() if offer.servers]:
        return f"; there is an action {join_names(others)}"
    return ""


def is_carried(topic: Topic) -> str:
    """Say where obstacle information is."""
    short = join_names([name.rsplit("/", 1)[-1] for name in topic.types])
    return f"It is on {topic.name} ({short}), from {name_nodes(topic.written_by)}."


def why_no_obstacles(jobs: Jobs) -> str:
    """Return why no topic counts as obstacle information."""
    graph = jobs.graph
    if not jobs.eye_readers:
        return "No node subscribes to /scan or /camera/image."
    if not jobs.detectors:
        return (
            f"Only {who_does(jobs.eye_readers, 'read')} /scan or /camera/image: navigation or "
            "control does the detection as well."
        )
    outputs = {t.name: t for node in sorted(jobs.detectors) for t in graph.published_topics(node)}
    tried = [t for t in outputs.values() if t.name not in SENSORS and not set(t.types) & POSES]
    if tried:
        reasons = [f"{topic.name} {_why_no_obstacle(topic, jobs)}" for topic in tried[:3]]
        arrives = any(jobs.leads_to_motors(topic, ONWARD) for topic in tried)
        asked = "" if arrives else _asked_for(jobs)
        return f"{who_does(jobs.detectors, 'read')} the sensors, but {'; '.join(reasons)}.{asked}"
    for offer in _handed_out(jobs):
        return (
            f"{name_nodes(offer.servers)} hands it out by the service {offer.name} to "
            f"{name_nodes(offer.clients)}: it comes all the time, so it is a stream, not an answer."
        )
    reading = f"{who_does(jobs.detectors, 'read')} the sensors, but"
    if found := [
        f"{t.name} ({join_names(t.types)})" for t in outputs.values() if set(t.types) & POSES
    ]:
        return f"{reading} all that comes of it is a pose: {join_names(found)}."
    if busy := [t for t in graph.topics.values() if _of_busy(t, jobs)]:
        return (
            f"{name_nodes(busy[0].written_by)}, not {name_nodes(jobs.detectors)}, publishes "
            f"{busy[0].name}: navigation and control do not do the detection."
        )
    return f"{reading} nothing of the kind is published."


def _handed_out(jobs: Jobs) -> list[Offer]:
    """Return the services by which detectors may hand out what they have found."""
    return [
        offer
        for offer in jobs.graph.services.values()
        if offer.servers & jobs.detectors and offer.clients and not offer.servers & jobs.knowing_map
    ]


def _of_busy(topic: Topic, jobs: Jobs) -> bool:
    """Whether a topic would be obstacle information if navigation or control did not write it."""
    return bool(
        topic.written_by
        and topic.written_by <= jobs.eye_readers - jobs.detectors
        and is_told_others(topic)
    )


def _asked_for(jobs: Jobs) -> str:
    """Return, as a sentence, by which service of a detector's its findings may get to the motors.

    What the services of std_srvs answer is no obstacle information.
    """
    for offer in _handed_out(jobs):
        askers = offer.clients - jobs.detectors
        onward = jobs.graph.reachable_nodes(askers, ("topic", "request", "goal"))
        if onward & jobs.controllers and not offer.type.startswith("std_srvs/"):
            return (
                f" It gets to {MOTORS} only by way of the service {offer.name}, which "
                f"{who_does(askers, 'call')}: it has to come as a stream, over topics or action "
                "goals."
            )
    return ""


def _why_no_obstacle(topic: Topic, jobs: Jobs) -> str:
    types = set(topic.types)
    if types & NO_PLACE:
        return f"({join_names(topic.types)}) cannot say where the obstacle is"
    if not bears_marks(types):
        return (
            f"({join_names(topic.types)}) has no room for a mark: take a type with a number of 32 "
            "bits or a text"
        )
    if types & NOT_OBSTACLES or topic.name in (MAP, MOTORS):
        return f"({join_names(topic.types)}) is no obstacle information"
    if not topic.read_by - topic.written_by:
        return "is read by no other node"
    return f"ends at {name_nodes(topic.read_by)}, from where nothing leads to {MOTORS}"


def why_no_pose(jobs: Jobs) -> str:
    """Return why no topic counts as the robot's pose."""
    graph = jobs.graph
    poses = [t for t in graph.topics.values() if set(t.types) & POSES and t.name not in SENSORS]
    poses = [t for t in poses if t.writers]
    for topic in poses:
        if topic.written_by <= jobs.navigators:
            return f"{topic.name} comes from {name_nodes(topic.written_by)}, the navigation node."
        return f"{who_does(topic.written_by, 'publish')} {topic.name} without reading any sensor."
    asked = [
        o for o in graph.services.values()
        if "pose" in f"{o.name} {o.type}".lower() and o.servers & jobs.sensing_nodes and o.clients
    ]  # fmt: skip
    if asked:
        return f"The pose can only be asked for, by the service {asked[0].name}: it is a stream."
    wheels = graph.get_topic(WHEELS)
    if own := wheels.written_by & jobs.find_readers(SENSORS, IMAGES | CLOUDS):
        return (
            f"{who_does(own, 'publish')} {'its' if len(own) == 1 else 'their'} pose on {WHEELS}, "
            "the encoders' topic: it needs one of its own."
        )
    return "No node publishes a topic with a pose type."


def why_no_planner(jobs: Jobs) -> str:
    """Return why no service counts as path planning; empty if one does."""
    if any(_gets_goal(offer, jobs) for offer in jobs.planning_services):
        return ""
    if jobs.planning_services:
        offer = jobs.planning_services[0]
        return f"{offer.name} ({offer.type}): its request has no room for a goal."
    graph, readers = jobs.graph, jobs.map_readers
    services = [o for o in graph.services.values() if o.servers]
    known = [o for o in services if o.servers & jobs.knowing_map and o.type not in MAP_SERVICES]
    fitting = [o for o in known if _gets_goal(o, jobs)]
    if not readers:
        types = graph.get_topic(MAP).types
        if types and MAP_TYPE not in types:
            return f"{MAP} has type {join_names(types)}, not {MAP_TYPE}."
        if not known:
            return f"No node reads {MAP}."
    # What a node with the goal calls comes first: it is what the student takes for the planner.
    called = [o for o in services if _goal_callers(o, jobs)] if not fitting else []
    for offer in called if known else ():
        if not offer.servers & jobs.knowing_map and _gets_goal(offer, jobs):
            return (
                f"{who_does(_goal_callers(offer, jobs), 'call')} {offer.name} of "
                f"{name_nodes(offer.servers)}, "
                "which does not know the map."
            )
    for offer in called:
        if offer.type in MAP_SERVICES and offer.servers & readers:
            kind = offer.type.rsplit("/", 1)[-1]
            return f"{offer.name} is a {kind}: it hands out the map and takes no goal."
    actions = [o for o in graph.actions.values() if o.servers & readers and o.name != ACTION]
    if not known and actions:
        return (
            f"{who_does(readers, 'plan')} by the action {actions[0].name}: the task is a service."
        )
    if not known:
        others = [o.name for o in services if not o.servers & jobs.knowing_map]
        serving = (
            f" ({join_names(others)} {'does' if len(others) == 1 else 'do'} not know it)"
            if others
            else ""
        )
        return f"{who_does(readers, 'read')} the map, but no service comes from there{serving}."
    offer = (fitting or known)[0]
    if not offer.clients - offer.servers:
        return f"{who_does(offer.servers, 'serve')} {offer.name}, but no other node calls it."
    return (
        f"{who_does(offer.clients, 'call')} {offer.name}, but no navigation goal gets there: "
        f"nothing leads to it from {ACTION}."
    )


def _goal_callers(offer: Offer, jobs: Jobs) -> set[str]:
    """Return the nodes with the goal that call a service of another's."""
    return (offer.clients - offer.servers) & jobs.goal_reaches


def _gets_goal(offer: Offer, jobs: Jobs) -> bool:
    """Whether the goal can come with the request, or has come to the server by a topic before."""
    try:
        in_request = message_tags.has_room(load_type(offer.type).Request)
    except TypeNotInstalledError:
        in_request = True  # a type of the student's own: what it holds cannot be seen from here
    return in_request or bool(
        offer.servers & jobs.graph.reachable_nodes(jobs.navigators, ("topic",))
    )


def link_faults(graph: RobotGraph) -> list[str]:
    """Return what is wrong with the links of a design, a sentence each."""
    twins = [
        f"More than one node is called {name_nodes([name])}: on the graph nobody can tell them "
        "apart."
        for name in sorted(graph.namesakes)
    ]
    return [*twins, *_topic_faults(graph), *_offer_faults(graph)]


def _topic_faults(graph: RobotGraph) -> Iterator[str]:
    for topic in graph.topics.values():
        if len(topic.types) > 1:
            yield f"{topic.name} has more than one type: {join_names(topic.types)}."
        elif not topic.writers:
            yield f"{who_does(topic.read_by, 'read')} {topic.name}, but nobody publishes on it."
        elif not topic.readers and topic.name != MOTORS:
            yield f"{who_does(topic.written_by, 'publish')} {topic.name}, but nobody reads it."
        else:
            yield from _qos_refusals(topic)


def _qos_refusals(topic: Topic) -> Iterator[str]:
    for writer in topic.writers:
        for reader in topic.readers:
            if reason := find_refusal(writer.qos, reader.qos):
                yield reason.as_sentence(
                    name_nodes([writer.node]), name_nodes([reader.node]), topic.name
                )


def _offer_faults(graph: RobotGraph) -> Iterator[str]:
    for offers, verb in ((graph.services, "call"), (graph.actions, "send")):
        for offer in offers.values():
            if not offer.servers:
                goals = "goals to " if verb == "send" else ""
                yield (
                    f"{who_does(offer.clients, verb)} {goals}{offer.name}, but no node is its "
                    "server."
                )
            elif len(offer.servers) > 1 and offer.name != ACTION:
                both = "both" if len(offer.servers) == 2 else "all"
                yield (
                    f"{name_nodes(offer.servers)} are {both} servers of {offer.name}: one is right."
                )
            for way in offer.ways:
                yield from _qos_refusals(way)


def name_nodes(names: Iterable[str]) -> str:
    """Return the names of nodes as a phrase."""
    return join_names(sorted(name.removeprefix("/") for name in names))


def name_all_nodes(names: Collection[str]) -> str:
    """Return the names of several nodes as the subject of a sentence: “a and b both”."""
    return f"{name_nodes(names)} {'both' if len(names) == 2 else 'all'}"


def join_names(names: Iterable[str], last: str = "and") -> str:
    """Return names as a phrase."""
    *first, end = [*names] or ["none"]
    return f"{', '.join(first)} {last} {end}" if first else end


def who_does(names: Iterable[str], verb: str) -> str:
    """Return who does it, with the verb in singular or plural."""
    doers = list(names)
    ending = ("es" if verb.endswith("sh") else "s") if len(doers) == 1 else ""
    return f"{name_nodes(doers)} {verb}{ending}"
