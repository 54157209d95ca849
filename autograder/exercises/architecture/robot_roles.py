"""Who does which of the robot's jobs: read off the graph by what goes in and what comes out.

Nodes and topics inside the robot have whatever names the student likes. Only the boundary is fixed:
the sensors' topics, the map, the motors' topic and the action.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import cached_property

from autograder.exercises.architecture.robot_graph import Offer, RobotGraph, Topic
from autograder.observe.marked_types import bears_marks

ACTION = "/navigate_to"
MAP, MAP_TYPE = "/map", "nav_msgs/msg/OccupancyGrid"
MOTORS, MOTORS_TYPE = "/motors/command", "geometry_msgs/msg/Twist"
SENSORS = {
    "/scan": "sensor_msgs/msg/LaserScan",
    "/camera/image": "sensor_msgs/msg/Image",
    "/wheel/odometry": "nav_msgs/msg/Odometry",
}
EYES = ("/scan", "/camera/image")
WHEELS = "/wheel/odometry"
GET_MAP = "nav_msgs/srv/GetMap"
MAP_SERVICES = frozenset(f"nav_msgs/srv/{name}" for name in ("GetMap", "LoadMap", "SetMap"))
"""Types of services that hand the map out or take one: none of them plans."""

POSES = frozenset(
    ["nav_msgs/msg/Odometry"]
    + [
        f"geometry_msgs/msg/{name}"
        for name in ("PoseStamped", "PoseWithCovarianceStamped", "Pose", "PoseWithCovariance")
    ]
)
VELOCITIES = frozenset(
    f"geometry_msgs/msg/{name}"
    for name in ("Twist", "TwistStamped", "TwistWithCovariance", "TwistWithCovarianceStamped")
)
IMAGES = frozenset(
    f"sensor_msgs/msg/{name}" for name in ("LaserScan", "Image", "CompressedImage", "CameraInfo")
)
CLOUDS = frozenset(["sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/PointCloud"])
OTHER_READINGS = frozenset(["sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry"])
NO_PLACE = frozenset(
    ["builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"]
    + [f"std_msgs/msg/{name}" for name in ("Bool", "Empty", "Header", "ColorRGBA")]
)
"""Types that cannot say where something is."""
NOT_OBSTACLES = (
    POSES | VELOCITIES | IMAGES | OTHER_READINGS | NO_PLACE
    | {"nav_msgs/msg/Path", "diagnostic_msgs/msg/DiagnosticArray"}
)  # fmt: skip

STREAMS = ("topic", "goal")
"""What can carry information that comes all the time: a new goal replaces the one before."""
ONWARD = ("topic", "request", "response", "goal")
"""The ways in which a goal can get from the action server to the motors."""


def is_told_others(topic: Topic) -> bool:
    """Whether a topic's name and type allow for obstacle information, and another node reads it."""
    return bool(
        topic.name not in {*SENSORS, MAP, MOTORS}
        and not set(topic.types) & NOT_OBSTACLES
        and topic.read_by - topic.written_by
    )


class Jobs:
    """The robot's jobs in one graph."""

    def __init__(self, graph: RobotGraph) -> None:
        """Look at ``graph``."""
        self.graph = graph

    @cached_property
    def navigators(self) -> set[str]:
        """The nodes that are the action's server."""
        return self.graph.get_action(ACTION).servers

    @cached_property
    def controllers(self) -> frozenset[str]:
        """The nodes that publish on the motors' topic."""
        return self.graph.get_topic(MOTORS).written_by

    @cached_property
    def drivers(self) -> set[str]:
        """The nodes that publish a sensor's readings."""
        return {node for name in SENSORS for node in self.graph.get_topic(name).written_by}

    @cached_property
    def eye_readers(self) -> set[str]:
        """The nodes that read the LIDAR or the camera."""
        return self.find_readers(EYES, IMAGES | CLOUDS)

    @cached_property
    def sensor_topics(self) -> set[str]:
        """The topics of sensors: the three, and what others a design has."""
        return set(SENSORS) | {
            topic.name
            for topic in self.graph.topics.values()
            if topic.writers and any(name.startswith("sensor_msgs/msg/") for name in topic.types)
        }

    @cached_property
    def sensing_nodes(self) -> set[str]:
        """The nodes that know of some sensor: they read one, or drive one."""
        read = self.find_readers(self.sensor_topics, IMAGES | CLOUDS | OTHER_READINGS)
        return read | {
            node for name in self.sensor_topics for node in self.graph.get_topic(name).written_by
        }

    @cached_property
    def informed_navigators(self) -> set[str]:
        """The navigation nodes to which topics bring what a sensor sees.

        The last of these topics must be able to say it: that somebody is alive is no reading. Where
        no pose is estimated, one that another node makes up stands in: that node is at fault.
        """
        read = {node for name in self.sensor_topics for node in self.graph.get_topic(name).read_by}
        aware = self.graph.reachable_nodes(read | self.sensing_nodes - self.navigators, ("topic",))
        return {
            node
            for topic in self.graph.topics.values()
            if (others := topic.written_by - self.navigators)
            and (others & aware or (set(topic.types) & POSES and not self.pose_topics))
            and set(topic.types) - NO_PLACE
            for node in topic.read_by & self.navigators
        } | (read & self.navigators)

    def find_readers(self, topics: Collection[str], readings: Collection[str]) -> set[str]:
        """Return who reads ``topics``, also where a node filters and hands on raw readings."""
        found: set[str] = set()
        names = set(topics)
        while new := {n for name in names for n in self.graph.get_topic(name).read_by} - found:
            found |= new
            names = {
                topic.name
                for node in new
                for topic in self.graph.published_topics(node)
                if set(topic.types) & set(readings)
            }
        return found

    @cached_property
    def detectors(self) -> set[str]:
        """The nodes that read LIDAR or camera and are neither navigation nor control."""
        return self.eye_readers - self.navigators - self.controllers

    @cached_property
    def obstacle_topics(self) -> list[Topic]:
        """The topics that carry obstacle information from a detector to another node."""
        return [
            topic
            for topic in self.graph.topics.values()
            if topic.written_by & self.detectors
            and is_told_others(topic)
            and bears_marks(topic.types)
            and self.leads_to_motors(topic, ONWARD)
        ]

    def source_sensor(self, topics: Iterable[Topic]) -> str:
        """Return the sensor that these topics are made from: the LIDAR where it is one of them."""
        writers = {node for topic in topics for node in topic.written_by}
        made = [eye for eye in EYES if writers & self.find_readers([eye], IMAGES | CLOUDS)]
        return (made or EYES)[0]

    def leads_to_motors(self, topic: Topic, kinds: Collection[str]) -> bool:
        """Whether what is on a topic can get to the motors' node, or anywhere if there is none."""
        reached = self.graph.reachable_nodes(topic.read_by - topic.written_by, kinds)
        return bool(reached & (self.controllers or reached))

    def services_on_the_way(self) -> list[str]:
        """Return the services without which no obstacle information gets to the motors."""
        streamed = self.graph.reachable_nodes(
            {node for topic in self.obstacle_topics for node in topic.read_by}, STREAMS
        )
        return sorted(
            {
                name
                for source, target, name in self.graph.iterate_links(("request", "response"))
                if source in streamed
                and target not in streamed
                and self.graph.reachable_nodes({target}, ("topic", "request", "goal"))
                & self.controllers
            }
        )

    @cached_property
    def pose_topics(self) -> list[Topic]:
        """The topics on which a node that knows of a sensor publishes the pose."""
        return [
            topic
            for topic in self.graph.topics.values()
            if set(topic.types) & POSES
            and topic.name not in SENSORS
            and topic.written_by & (self.sensing_nodes - self.navigators)
        ]

    @cached_property
    def pose_of_wheels(self) -> bool:
        """Whether odometry (and scans and a map) is all that any of the poses is made from.

        Then nothing is missing where only those come in.
        """
        writers = {node for topic in self.pose_topics for node in topic.written_by}
        read = {node: {t.name for t in self.graph.topics.values() if node in t.read_by}
                for node in writers}  # fmt: skip
        return all({WHEELS} <= read[node] <= {WHEELS, "/scan", MAP} for node in writers)

    @cached_property
    def map_readers(self) -> set[str]:
        """The nodes that read the map: from its topic, from its service, or from a costmap."""
        asking = {
            node
            for offer in self.graph.services.values()
            if offer.type == GET_MAP and offer.servers
            for node in offer.clients
        }
        maps = {
            topic.name
            for topic in self.graph.topics.values()
            if MAP_TYPE in topic.types and (topic.name == MAP or topic.written_by & asking)
        }
        return self.find_readers(maps, [MAP_TYPE]) | asking

    @cached_property
    def knowing_map(self) -> set[str]:
        """The nodes that know the map: who reads it, and who publishes it or hands it out."""
        publishers = {end.node for end in self.graph.get_topic(MAP).writers if end.type == MAP_TYPE}
        offers = [offer for offer in self.graph.services.values() if offer.type == GET_MAP]
        return self.map_readers.union(publishers, *(offer.servers for offer in offers))

    @cached_property
    def goal_reaches(self) -> set[str]:
        """The nodes that a goal can get to from the action's server.

        A design without that server fails the check that asks for it, and no other for its sake:
        it is then every node to which anything leads from another.
        """
        if not self.navigators:
            return {target for _, target, _ in self.graph.iterate_links(ONWARD)}
        return self.graph.reachable_nodes(self.navigators, ONWARD)

    @cached_property
    def planning_services(self) -> list[Offer]:
        """The services that know the map and are called, elsewhere, by a node that has the goal."""
        return [
            offer
            for offer in self.graph.services.values()
            if offer.servers & self.knowing_map
            and offer.type not in MAP_SERVICES
            and (offer.clients - offer.servers) & self.goal_reaches
        ]

    def of_each_node(self) -> dict[str, list[str]]:
        """Return {node: the jobs that it does}.

        Several nodes may publish what looks like a pose or like obstacle information (a target, a
        debugging view): these two jobs count for those of them that have the least else to do.
        """
        certain = {
            "drives sensors": set(self.drivers),
            "plans paths": {n for offer in self.planning_services for n in offer.servers},
            "navigates": set(self.navigators),
            "controls the motors": set(self.controllers),
        }

        def least_busy(topics: list[Topic], who: set[str]) -> set[str]:
            load = {
                node: sum(node in nodes for nodes in certain.values())
                for topic in topics
                for node in topic.written_by & who
            }
            return {node for node in load if load[node] == min(load.values())}

        doing = {
            "drives sensors": certain["drives sensors"],
            "estimates the state": least_busy(
                self.pose_topics, self.sensing_nodes - self.navigators
            ),
            "detects obstacles": least_busy(self.obstacle_topics, self.detectors),
            **certain,
        }
        return {
            node: [job for job, nodes in doing.items() if node in nodes]
            for node in sorted(self.graph.nodes)
        }
