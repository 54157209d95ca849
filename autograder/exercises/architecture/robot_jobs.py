"""Who does which of the robot's jobs: read off the graph by what goes in and what comes out.

Nodes and topics inside the robot have whatever names the student likes. Only the boundary is fixed:
the sensors' topics, the map, the motors' topic and the action.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import cached_property

from autograder.observe.graph.ros_graph import GraphService, GraphTopic, RosGraph
from autograder.observe.marks.marked_types import bears_marks


def _messages(package: str, *names: str) -> frozenset[str]:
    return frozenset(f"{package}/msg/{name}" for name in names)


ACTION = "/navigate_to"
MAP, MAP_TYPE = "/map", "nav_msgs/msg/OccupancyGrid"
MOTORS, MOTORS_TYPE = "/motors/command", "geometry_msgs/msg/Twist"
SCAN, IMAGE, WHEELS = "/scan", "/camera/image", "/wheel/odometry"
SENSORS = {
    SCAN: "sensor_msgs/msg/LaserScan",
    IMAGE: "sensor_msgs/msg/Image",
    WHEELS: "nav_msgs/msg/Odometry",
}
EYES = (SCAN, IMAGE)
GET_MAP = "nav_msgs/srv/GetMap"
MAP_SERVICES = (GET_MAP, "nav_msgs/srv/LoadMap", "nav_msgs/srv/SetMap")
"""Types of services that hand the map out or take one: none of them plans."""

POSES = _messages("nav_msgs", "Odometry") | _messages(
    "geometry_msgs", "PoseStamped", "PoseWithCovarianceStamped", "Pose", "PoseWithCovariance"
)
VELOCITIES = _messages(
    "geometry_msgs", "Twist", "TwistStamped", "TwistWithCovariance", "TwistWithCovarianceStamped"
)
SEEN = _messages(
    "sensor_msgs", "LaserScan", "Image", "CompressedImage", "CameraInfo",
    "PointCloud2", "PointCloud",
)  # fmt: skip
"""Types of what LIDAR and camera see."""
CLOUDS = _messages("sensor_msgs", "PointCloud2", "PointCloud")
READINGS = SEEN | _messages("sensor_msgs", "Imu") | _messages("nav_msgs", "Odometry")
NO_PLACE = _messages("builtin_interfaces", "Time", "Duration") | _messages(
    "std_msgs", "Bool", "Empty", "Header", "ColorRGBA"
)
"""Types that cannot say where something is."""
NOT_OBSTACLES = (
    POSES | VELOCITIES | NO_PLACE | (READINGS - CLOUDS)
    | {"nav_msgs/msg/Path", "diagnostic_msgs/msg/DiagnosticArray"}
)  # fmt: skip

STREAMS = ("topic", "goal")
"""What can carry information that comes all the time: a new goal replaces the one before."""
ONWARD = ("topic", "request", "response", "goal")
"""The ways in which a goal can get from the action server to the motors."""


def may_tell_obstacles(topic: GraphTopic) -> bool:
    """Whether a topic's name and type allow for obstacle information, and another node reads it."""
    return bool(
        topic.name not in {*SENSORS, MAP, MOTORS}
        and NOT_OBSTACLES.isdisjoint(topic.types)
        and topic.other_readers
    )


class Jobs:
    """The robot's jobs in one graph."""

    def __init__(self, graph: RosGraph) -> None:
        """Look at ``graph``."""
        self.graph = graph
        self.navigators = graph.action(ACTION).servers
        self.controllers = graph.topic(MOTORS).written_by
        self.drivers = graph.writers_of(SENSORS)
        self.eye_readers = graph.readers_through(EYES, SEEN)
        self.detectors = self.eye_readers - self.navigators - self.controllers

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
        """The nodes but navigation that know of some sensor: they read one, or drive one."""
        read = self.graph.readers_through(self.sensor_topics, READINGS)
        return (read | self.graph.writers_of(self.sensor_topics)) - self.navigators

    @cached_property
    def informed_navigators(self) -> set[str]:
        """The navigation nodes to which topics bring what a sensor sees.

        The last of these topics must be able to say it: that somebody is alive is no reading. Where
        no pose is estimated, one that another node makes up stands in: that node is at fault.
        """
        read = self.graph.readers_of(self.sensor_topics)
        aware = self.graph.reachable_nodes(read | self.sensing_nodes, ("topic",))
        if not self.pose_topics:
            aware |= {node for topic in self.poses for node in topic.written_by}
        sources = self.graph.topics_from(aware - self.navigators)
        telling = [topic.name for topic in sources if set(topic.types) - NO_PLACE]
        return (read | self.graph.readers_of(telling)) & self.navigators

    @cached_property
    def obstacle_topics(self) -> list[GraphTopic]:
        """The topics that carry obstacle information from a detector to another node."""
        return [
            topic
            for topic in self.graph.topics_from(self.detectors)
            if may_tell_obstacles(topic)
            and bears_marks(topic.types)
            and self.leads_to_motors(topic, ONWARD)
        ]

    def source_sensor(self, topics: Iterable[GraphTopic]) -> str:
        """Return the sensor that these topics are made from: the LIDAR where it is one of them."""
        writers = {node for topic in topics for node in topic.written_by}
        made = [eye for eye in EYES if writers & self.graph.readers_through([eye], SEEN)]
        return (made or EYES)[0]

    def leads_to_motors(self, topic: GraphTopic, kinds: Collection[str]) -> bool:
        """Whether what is on a topic can get to the motors' node, or anywhere if there is none."""
        reached = self.graph.reachable_nodes(topic.other_readers, kinds)
        return bool(reached & (self.controllers or reached))

    def services_on_the_way(self) -> list[str]:
        """Return the services without which no obstacle information gets to the motors."""
        readers = self.graph.readers_of(topic.name for topic in self.obstacle_topics)
        streamed = self.graph.reachable_nodes(readers, STREAMS)
        return sorted(
            {
                name
                for source, target, name in self.graph.links(("request", "response"))
                if source in streamed
                and target not in streamed
                and self.graph.reachable_nodes({target}, ("topic", "request", "goal"))
                & self.controllers
            }
        )

    @cached_property
    def poses(self) -> list[GraphTopic]:
        """The topics of a pose type but those of sensors."""
        return [t for t in self.graph.topics_of(POSES) if t.writers and t.name not in SENSORS]

    @cached_property
    def pose_topics(self) -> list[GraphTopic]:
        """The topics on which a node that knows of a sensor publishes the pose."""
        return [topic for topic in self.poses if topic.written_by & self.sensing_nodes]

    @cached_property
    def pose_of_wheels(self) -> bool:
        """Whether odometry (and scans and a map) is all that any of the poses is made from.

        Then nothing is missing where only those come in.
        """
        topics = self.graph.topics.values()
        return all(
            {WHEELS}
            <= {topic.name for topic in topics if node in topic.read_by}
            <= {WHEELS, SCAN, MAP}
            for pose in self.pose_topics
            for node in pose.written_by
        )

    @cached_property
    def map_readers(self) -> set[str]:
        """The nodes that read the map: from its topic, from its service, or from a costmap."""
        offers = [s for s in self.graph.services.values() if s.type == GET_MAP and s.servers]
        asking = {node for service in offers for node in service.clients}
        maps = [
            topic.name
            for topic in self.graph.topics_of([MAP_TYPE])
            if topic.name == MAP or topic.written_by & asking
        ]
        return self.graph.readers_through(maps, [MAP_TYPE]) | asking

    @cached_property
    def knowing_map(self) -> set[str]:
        """The nodes that know the map: who reads it, and who publishes it or hands it out."""
        publishers = {end.node for end in self.graph.topic(MAP).writers if end.type == MAP_TYPE}
        offers = [s.servers for s in self.graph.services.values() if s.type == GET_MAP]
        return self.map_readers.union(publishers, *offers)

    @cached_property
    def goal_reaches(self) -> set[str]:
        """The nodes that a goal can get to from the action's server.

        A design without that server fails the check that asks for it, and no other for its sake:
        it is then every node to which anything leads from another.
        """
        if not self.navigators:
            return {target for _, target, _ in self.graph.links(ONWARD)}
        return self.graph.reachable_nodes(self.navigators, ONWARD)

    @cached_property
    def planning_services(self) -> list[GraphService]:
        """The services that know the map and are called, elsewhere, by a node that has the goal."""
        return [
            service
            for service in self.graph.services.values()
            if service.servers & self.knowing_map
            and service.type not in MAP_SERVICES
            and service.other_clients & self.goal_reaches
        ]

    def of_each_node(self) -> dict[str, list[str]]:
        """Return {node: the jobs that it does}.

        Several nodes may publish what looks like a pose or like obstacle information (a target, a
        debugging view): these two jobs count for those of them that have the least else to do.
        """
        planners = {node for service in self.planning_services for node in service.servers}
        certain = [self.drivers, planners, self.navigators, self.controllers]

        def least_busy(topics: list[GraphTopic], able: set[str]) -> set[str]:
            writers = {node for topic in topics for node in topic.written_by & able}
            load = {node: sum(node in nodes for nodes in certain) for node in writers}
            return {node for node in load if load[node] == min(load.values())}

        doing = {
            "drives sensors": self.drivers,
            "estimates the state": least_busy(self.pose_topics, self.sensing_nodes),
            "detects obstacles": least_busy(self.obstacle_topics, self.detectors),
            "plans paths": planners,
            "navigates": self.navigators,
            "controls the motors": self.controllers,
        }
        return {
            node: [job for job, nodes in doing.items() if node in nodes]
            for node in sorted(self.graph.nodes)
        }
