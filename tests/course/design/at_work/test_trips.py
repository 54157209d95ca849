"""A design drives the robot of a world on simulated time, and a wrong one shows what it does."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest
from geometry_msgs.msg import PoseArray, PoseStamped, Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.srv import GetPlan
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image, LaserScan, PointCloud2
from std_msgs.msg import Float32, String
from test_msgs.action import NestedMessage

import course
from course import Design, DesignError, Session
from course.worlds.floor_plan import ROBOT_RADIUS_M
from course.worlds.simulation import AT_PLACE_M

OBSTACLE = (6.4, 1.3, 0.25)  # on the way to the dock
DOCK = (10.8, 1.0)
LONGEST_S = 45.0


@pytest.fixture
def lab() -> Iterator[Session]:
    with Session(sim_time=True) as session:
        yield session


def declare(**changes: Any) -> Design:
    """Return a right design.

    A change is the type of ``obstacles``, the type that it ``sees``, that it ``has_both`` LIDAR and
    camera, or what it is ``without``.
    """
    sees = changes.get("sees", LaserScan)
    kind, without = changes.get("obstacles", PoseArray), changes.get("without", ())
    design = Design(outside=["motors/command", "navigate_to"])
    if "lidar" not in without:
        design.node("lidar").publishes("scan", LaserScan, qos_profile_sensor_data)
    design.node("wheels").publishes("wheel/odometry", Odometry)
    design.node("maps").publishes("map", OccupancyGrid)
    design.node("estimation").subscribes("wheel/odometry", Odometry).publishes("pose", PoseStamped)
    if sees is Image:
        design.node("camera").publishes("camera/image", Image)
    if changes.get("has_both"):
        design.node("camera").publishes("camera/image", Image)
    detection = design.node("detection").publishes("obstacles", kind)
    if changes.get("has_both"):
        detection.subscribes("camera/image", Image)
    topic = "scan" if sees is LaserScan else "camera/image"
    detection.subscribes(topic, sees, qos_profile_sensor_data)
    design.node("planner").subscribes("map", OccupancyGrid).serves("plan", GetPlan)
    navigation = design.node("navigation").action_server("navigate_to", NestedMessage)
    navigation.publishes("velocity", Twist)
    if "obstacles" not in without:
        navigation.subscribes("obstacles", kind)
    if "pose" not in without:
        navigation.subscribes("pose", PoseStamped)
    if "plan" not in without:
        navigation.calls("plan", GetPlan)
    controller = design.node("controller").publishes("motors/command", Twist)
    if "velocity" not in without:
        controller.subscribes("velocity", Twist)
    return design


def drive(
    session: Session, design: Design, seconds: float = LONGEST_S, obstacle: Any = OBSTACLE
) -> Any:
    """Drive to the dock around the obstacle; return the trip and where the robot ended."""
    world = session.world("warehouse")
    world.add_obstacle(*obstacle)
    trip = design.drive(world, to="dock")
    simulation = world.simulation
    while simulation.time_s < seconds and not trip.arrived:
        session.sim.advance(0.5, step=0.05)
    assert session.errors == []
    return trip, simulation.describe_moment()["robot"]


def left(robot: dict[str, Any]) -> float:
    return math.dist((robot["x"], robot["y"]), DOCK)


def test_the_right_design_arrives_around_the_obstacle_and_touches_nothing(lab: Session) -> None:
    trip, robot = drive(lab, declare())
    assert trip.arrived, trip
    assert left(robot) < AT_PLACE_M
    assert trip.touched == []
    assert trip.gaps == []
    assert repr(trip).startswith("The robot arrived at dock after ")


@pytest.mark.parametrize("kind", [PointCloud2, String, OccupancyGrid], ids=lambda k: k.__name__)
def test_obstacles_come_in_messages_of_many_types(lab: Session, kind: Any) -> None:
    trip, _ = drive(lab, declare(obstacles=kind))
    assert trip.arrived, trip
    assert trip.touched == []


@pytest.mark.parametrize("sees", [LaserScan, Image], ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("obstacle", [(6.5, 1.1, 0.3), (6.5, 1.0, 0.3), (7.5, 1.1, 0.3)])
def test_it_drives_through_one_of_two_gaps_and_touches_nothing(
    lab: Session, sees: Any, obstacle: Any
) -> None:
    trip, _ = drive(lab, declare(sees=sees), obstacle=obstacle)
    assert trip.arrived, trip
    assert trip.touched == []
    took_s = float(str(trip).split(" after ")[1].split(" s.")[0])
    assert took_s < (26.0 if sees is LaserScan else 36.0)  # 22 s if nothing stands there


@pytest.mark.parametrize("begins_s", [10.0, 20.0, 22.0])
def test_it_arrives_whenever_it_begins_and_wherever_people_are_then(
    lab: Session, begins_s: float
) -> None:
    """People decide on which side it drives around, and how near: it stood there for good."""
    world = lab.world("warehouse")
    world.add_obstacle(*OBSTACLE)
    lab.sim.advance(begins_s, step=0.05)
    trip = declare(has_both=True).drive(world, to="dock")
    while world.simulation.time_s < begins_s + LONGEST_S and not trip.arrived:
        lab.sim.advance(0.5, step=0.05)
    assert trip.arrived, trip
    assert trip.touched == []


def test_the_same_design_drives_the_same_way_again() -> None:
    places = []
    for _ in range(2):
        with Session(sim_time=True) as session:
            _, robot = drive(session, declare(), 8.0)
            places.append((robot["x"], robot["y"]))
    assert places[0] == places[1]


def test_without_obstacles_it_drives_into_what_stands_there(lab: Session) -> None:
    trip, robot = drive(lab, declare(without=["obstacles"]), 20.0)
    assert not trip.arrived
    assert trip.touched[0].startswith("The robot touched an obstacle at ")
    gap = math.dist((robot["x"], robot["y"]), OBSTACLE[:2]) - OBSTACLE[2] - ROBOT_RADIUS_M
    assert gap == pytest.approx(0.0, abs=0.01)
    assert "navigation and controller cannot hear what is in the way: " in repr(trip)


@pytest.mark.parametrize(
    ("missing", "sentence"),
    [
        ("pose", "navigation hears no pose: it does not know where the robot is"),
        ("velocity", "controller hears no velocity and no waypoint: the motors stand still."),
        ("lidar", "detection sees nothing, no scan and no picture: it cannot find obstacles."),
    ],
)
def test_without_what_it_takes_the_robot_stands_still(
    lab: Session, missing: str, sentence: str
) -> None:
    trip, robot = drive(lab, declare(without=[missing]), 8.0)
    assert (robot["x"], robot["y"]) == (1.0, 1.0)
    assert sentence in repr(trip)
    assert repr(trip).startswith("The robot stands still, 9.8 m away from dock.")


def test_without_a_planner_it_drives_straight_on_and_does_not_arrive(lab: Session) -> None:
    trip, robot = drive(lab, declare(without=["plan"]))
    assert not trip.arrived
    assert robot["x"] < 8.8  # the wall is in between
    assert "navigation asks no planner: it drives straight on." in trip.gaps


def test_a_distance_alone_makes_it_stop_but_not_drive_around(lab: Session) -> None:
    trip, robot = drive(lab, declare(obstacles=Float32), 20.0)
    assert trip.touched == []
    assert robot["x"] < OBSTACLE[0]
    assert "navigation hears how far an obstacle is, not where: " in repr(trip)


def test_two_publishers_of_the_motors_topic_are_slower_than_one(lab: Session) -> None:
    _, alone = drive(lab, declare(), 4.0)
    design = declare()
    design.node("joystick").publishes("motors/command", Twist)
    trip, robot = drive(lab, design, 4.0)
    assert robot["x"] < alone["x"] - 0.3
    assert "controller and joystick publish motors/command: " in repr(trip)


def test_a_node_of_ones_own_drives_along(lab: Session) -> None:
    class Controller(Node):
        def __init__(self) -> None:
            super().__init__("controller")
            self.motors = self.create_publisher(Twist, "motors/command", 10)
            self.create_subscription(Twist, "velocity", self.motors.publish, 10)

    design = declare(without=["velocity"])
    design.nodes.pop("controller")
    design.node("controller", factory=Controller)
    trip, _ = drive(lab, design)
    assert trip.arrived, trip
    assert trip.gaps == ["controller is a node of your own: what it does is up to its code."]


def test_nobody_takes_the_waypoint_of_a_stub(lab: Session) -> None:
    design = Design(outside=["motors/command", "navigate_to"])
    design.node("lidar_driver").publishes("scan", LaserScan)
    trip, robot = drive(lab, design, 5.0)
    assert (robot["x"], robot["y"]) == (1.0, 1.0)
    assert "No node serves navigate_to: nobody takes the waypoint." in trip.gaps
    assert "No node publishes motors/command: the motors stand still." in trip.gaps


def test_the_robot_has_other_nodes_on_its_topics_then(lab: Session) -> None:
    world = lab.world("warehouse")
    declare().drive(world, to=(3.0, 1.0))
    scans = lab.record("scan")
    lab.sim.advance(1.0, step=0.05)
    assert scans.count == 10  # those of the driver, and no others
    names = {topic["name"] for topic in world.simulation.topics}
    assert "/motors/command" in names
    assert "/cmd_vel" not in names


def test_where_to_drive_is_a_station_or_a_place(lab: Session) -> None:
    world = lab.world("warehouse")
    with pytest.raises(
        DesignError, match=r"no station 'dok' here: there are dock, .*Did you mean 'dock'"
    ):
        declare().drive(world, to="dok")
    with pytest.raises(DesignError, match="the name of a station, or x and y in m, not 3"):
        declare().drive(world, to=3)  # type: ignore[arg-type]
    world.close()
    with pytest.raises(course.SessionError, match="has ended"):
        declare().drive(world, to="dock")
