"""Why one of the robot's jobs is not done: sentences for the student, from the graph."""

from __future__ import annotations

from autograder.exercises.architecture.robot_jobs import (
    ACTION,
    EYES,
    MAP,
    MAP_SERVICES,
    MAP_TYPE,
    MOTORS,
    MOTORS_TYPE,
    NO_PLACE,
    NOT_OBSTACLES,
    ONWARD,
    POSES,
    SEEN,
    SENSORS,
    WHEELS,
    Jobs,
    may_tell_obstacles,
)
from autograder.observe.graph.ros_graph import GraphService, GraphTopic, RosGraph
from autograder.observe.marks.marked_types import TypeNotInstalledError, bears_marks, load_type
from autograder.observe.phrases import as_phrase, name_nodes, who_does
from course.design import message_tags

EYES_PHRASE = as_phrase(EYES, "or")


def why_no_readings(graph: RosGraph) -> str:
    """Return which sensors' readings nobody publishes; empty if each has its driver."""
    faults = []
    for name, wanted in SENSORS.items():
        types = {end.type for end in graph.topic(name).writers}
        if not types:
            faults.append(f"Nobody publishes on {name}{_similar_name(name, graph)}.")
        elif wanted not in types:
            faults.append(f"{name} is published as {as_phrase(sorted(types))}, not as {wanted}.")
    return " ".join(faults)


def _similar_name(name: str, graph: RosGraph) -> str:
    last = name.rsplit("/", 1)[-1]
    close = [other for other in graph.topics if other != name and other.endswith(f"/{last}")]
    return f" (there is {close[0]}, but the name is {name})" if close else ""


def why_no_navigation(jobs: Jobs) -> str:
    """Return why nobody navigates; empty if one node does that hears of a sensor."""
    graph, servers = jobs.graph, jobs.navigators
    if len(servers) > 1:
        return f"It has {len(servers)} servers: {name_nodes(servers)}."
    if servers and not jobs.informed_navigators:
        return (
            f"{name_nodes(servers)} is the server, but no topic brings it readings, obstacle "
            "information or the pose: it would drive blind."
        )
    if servers:
        return ""
    others = [name for name, action in graph.actions.items() if action.servers]
    if service := graph.services.get(ACTION):
        instead = f"; {name_nodes(service.servers) or 'nobody'} serves {ACTION} as a service"
    elif ACTION in graph.topics:
        instead = f"; {ACTION} is a topic"
    else:
        instead = f"; there is an action {as_phrase(others)}" if others else ""
    return f"No node is its server{instead}."


def why_no_driving(jobs: Jobs) -> str:
    """Return why the motors are not driven by order of navigation; empty if they are."""
    drivers = jobs.controllers
    types = sorted({end.type for end in jobs.graph.topic(MOTORS).writers})
    if not drivers:
        return f"Nobody publishes on {MOTORS}{_similar_name(MOTORS, jobs.graph)}."
    if types != [MOTORS_TYPE]:
        return f"It is published as {as_phrase(types)}."
    if len(drivers) > 1:
        both = "both" if len(drivers) == 2 else "all"
        return f"{name_nodes(drivers)} {both} command the motors."
    if drivers & jobs.graph.namesakes:
        return f"Two nodes called {name_nodes(drivers)} command them."
    if not drivers & jobs.goal_reaches:
        return (
            f"{name_nodes(drivers)} drives the motors, but nothing leads there from the server of "
            f"{ACTION}."
        )
    return ""


def why_no_obstacles(jobs: Jobs) -> str:
    """Return why no topic counts as obstacle information; empty if one does."""
    if jobs.obstacle_topics:
        return ""
    graph, detectors = jobs.graph, jobs.detectors
    if not jobs.eye_readers:
        return f"No node subscribes to {EYES_PHRASE}."
    if not detectors:
        return (
            f"Only {who_does(jobs.eye_readers, 'read')} {EYES_PHRASE}: navigation or control does "
            "the detection as well."
        )
    reading = f"{who_does(detectors, 'read')} the sensors, but"
    outputs = [topic for topic in graph.topics_from(detectors) if topic.name not in SENSORS]
    poses = [f"{t.name} ({as_phrase(t.types)})" for t in outputs if not POSES.isdisjoint(t.types)]
    tried = [topic for topic in outputs if POSES.isdisjoint(topic.types)]
    reasons = "; ".join(f"{topic.name} {_why_no_obstacle(topic)}" for topic in tried[:3])
    if asked := _why_asked_for(jobs, tried):
        return f"{reading} {reasons}. {asked}" if tried else asked
    if tried:
        return f"{reading} {reasons}."
    if poses:
        return f"{reading} all that comes of it is a pose: {as_phrase(poses)}."
    for topic in graph.topics_from(jobs.eye_readers - detectors):
        if may_tell_obstacles(topic):
            return (
                f"{name_nodes(topic.written_by)}, not {name_nodes(detectors)}, publishes "
                f"{topic.name}: navigation and control do not do the detection."
            )
    return f"{reading} nothing of the kind is published."


def _why_asked_for(jobs: Jobs, topics: list[GraphTopic]) -> str:
    """Return by which service detectors hand out what they have found; empty if by none.

    Beside topics that may be it, a service of std_srvs is for something else.
    """
    if any(jobs.leads_to_motors(topic, ONWARD) for topic in topics):
        return ""
    for service in jobs.graph.services.values():
        found = service.servers & jobs.detectors and not service.servers & jobs.knowing_map
        if found and service.clients and not (topics and service.type.startswith("std_srvs/")):
            return (
                f"{name_nodes(service.servers)} hands it out by the service {service.name} to "
                f"{name_nodes(service.clients)}: it comes all the time, so it is a stream, not an "
                "answer."
            )
    return ""


def _why_no_obstacle(topic: GraphTopic) -> str:
    types = as_phrase(topic.types)
    if not NO_PLACE.isdisjoint(topic.types):
        return f"({types}) cannot say where the obstacle is"
    if not bears_marks(topic.types):
        return f"({types}) has no room for a mark: take a type with a number of 32 bits or a text"
    if not NOT_OBSTACLES.isdisjoint(topic.types) or topic.name in (MAP, MOTORS):
        return f"({types}) is no obstacle information"
    if not topic.other_readers:
        return "is read by no other node"
    return f"ends at {name_nodes(topic.read_by)}, from where nothing leads to {MOTORS}"


def why_no_pose(jobs: Jobs) -> str:
    """Return why no topic counts as the robot's pose; empty if one does."""
    if jobs.pose_topics:
        return ""
    for topic in jobs.poses:
        if topic.written_by <= jobs.navigators:
            return f"{topic.name} comes from {name_nodes(topic.written_by)}, the navigation node."
        return f"{who_does(topic.written_by, 'publish')} {topic.name} without reading any sensor."
    for name, service in jobs.graph.services.items():
        about_pose = "pose" in f"{name} {service.type}".lower()
        if about_pose and service.servers & jobs.sensing_nodes and service.clients:
            return f"The pose can only be asked for, by the service {name}: it is a stream."
    if own := jobs.graph.topic(WHEELS).written_by & jobs.graph.readers_through(SENSORS, SEEN):
        return (
            f"{who_does(own, 'publish')} {'its' if len(own) == 1 else 'their'} pose on {WHEELS}, "
            "the encoders' topic: it needs one of its own."
        )
    return "No node publishes a topic with a pose type."


def why_no_planner(jobs: Jobs) -> str:
    """Return why no service counts as path planning; empty if one does."""
    if any(_gets_goal(service, jobs) for service in jobs.planning_services):
        return ""
    for service in jobs.planning_services:
        return f"{service.name} ({service.type}): its request has no room for a goal."
    readers, knowing = jobs.map_readers, jobs.knowing_map
    services = [service for service in jobs.graph.services.values() if service.servers]
    known = [s for s in services if s.servers & knowing and s.type not in MAP_SERVICES]
    fitting = [service for service in known if _gets_goal(service, jobs)]
    if not readers and not known:
        types = jobs.graph.topic(MAP).types
        wrong = types and MAP_TYPE not in types
        return (
            f"{MAP} has type {as_phrase(types)}, not {MAP_TYPE}."
            if wrong
            else (f"No node reads {MAP}.")
        )
    for action in jobs.graph.actions.values():
        if action.servers & readers and action.name != ACTION and not known:
            return (
                f"{who_does(readers, 'plan')} by the action {action.name}: the task is a service."
            )
    # What a node with the goal calls: the student takes it for the planner.
    for service in () if fitting else services:
        callers = service.other_clients & jobs.goal_reaches
        if callers and not service.servers & knowing and _gets_goal(service, jobs):
            return (
                f"{who_does(callers, 'call')} {service.name} of {name_nodes(service.servers)}, "
                "which does not know the map."
            )
        if callers and service.type in MAP_SERVICES and service.servers & readers:
            kind = service.type.rsplit("/", 1)[-1]
            return f"{service.name} is a {kind}: it hands out the map and takes no goal."
    if not known:
        return f"{who_does(readers, 'read')} the map, but no service comes from there."
    service = (fitting or known)[0]
    if not service.other_clients:
        return f"{who_does(service.servers, 'serve')} {service.name}, but no other node calls it."
    return (
        f"{who_does(service.clients, 'call')} {service.name}, but no navigation goal gets there: "
        f"nothing leads to it from {ACTION}."
    )


def _gets_goal(service: GraphService, jobs: Jobs) -> bool:
    """Whether the goal can come with the request, or has come to the server by a topic before."""
    try:
        in_request = message_tags.has_room(load_type(service.type).Request)
    except TypeNotInstalledError:
        in_request = True  # a type of the student's own: what it holds cannot be seen from here
    by_topic = jobs.graph.reachable_nodes(jobs.navigators, ("topic",))
    return in_request or bool(service.servers & by_topic)
