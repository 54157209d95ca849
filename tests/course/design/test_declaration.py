"""Declaring a design: what is refused at once, what is worth another look, and how it is shown."""

from __future__ import annotations

import re
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from nav_msgs.srv import GetPlan
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Image, LaserScan
from test_msgs.action import Fibonacci

from course import Design, DesignError


def small() -> Design:
    design = Design(outside=["motors/command"])
    design.node("lidar").publishes("scan", LaserScan, qos_profile_sensor_data)
    design.node("reflex").subscribes("scan", LaserScan, qos_profile_sensor_data).publishes(
        "motors/command", Twist
    )
    return design


@pytest.mark.parametrize(
    ("declare", "says"),
    [
        (lambda n: n.publishes("scan", LaserScan()), "write the type LaserScan, not the message"),
        (lambda n: n.publishes(LaserScan, "scan"), "the name comes first"),
        (lambda n: n.publishes("scan", GetPlan), "needs a message type, such as LaserScan"),
        (lambda n: n.serves("plan", LaserScan), "needs a service type, such as GetPlan"),
        (lambda n: n.action_server("go", GetPlan), "needs an action type"),
        (lambda n: n.publishes("scan", "LaserScan"), "there is no type 'LaserScan' here"),
        (lambda n: n.publishes("scan", "sensor_msgs/msg/Laser"), "there is no type"),
        (lambda n: n.publishes("scan", None), "needs a message type"),
        (lambda n: n.publishes("my scan", LaserScan), "is not a name on the ROS graph"),
        (lambda n: n.publishes("2scan", LaserScan), "is not a name on the ROS graph"),
        (lambda n: n.publishes("", LaserScan), "is not a name on the ROS graph"),
        (lambda n: n.publishes("scan", LaserScan, "best effort"), "qos is a QoSProfile or a depth"),
        (lambda n: n.publishes("scan", LaserScan, 0), "qos is a QoSProfile or a depth"),
        (lambda n: n.publishes("scan", LaserScan).publishes("/scan", Image), "/scan twice"),
    ],
)
def test_a_mistake_is_said_where_it_is_made(declare: Any, says: str) -> None:
    with pytest.raises(DesignError) as raised:
        declare(Design().node("lidar"))
    assert says in str(raised.value)
    assert "lidar" in str(raised.value)
    assert not re.search(r" at /|\n|:\.", str(raised.value))


@pytest.mark.parametrize("name", ["my node", "1st", "", "a/b", None])
def test_a_name_that_is_none_for_a_node_is_refused(name: Any) -> None:
    with pytest.raises(DesignError, match=r"is not a name for a node: [^:\n]+\.$"):
        Design().node(name)


def test_a_factory_must_be_callable() -> None:
    with pytest.raises(DesignError, match="factory is a node class or a function"):
        Design().node("lidar", factory="Lidar")  # type: ignore[arg-type]


def test_outside_is_a_list() -> None:
    with pytest.raises(DesignError, match="takes a list of names"):
        Design(outside="motors/command")


def test_the_same_node_can_be_declared_bit_by_bit() -> None:
    design = Design()
    design.node("lidar").publishes("scan", LaserScan)
    design.node("lidar").publishes("scan/near", LaserScan)
    assert list(design.nodes) == ["lidar"]
    assert len(design.nodes["lidar"].endpoints) == 2


def test_a_namespace_is_part_of_the_label_and_of_relative_names() -> None:
    design = Design()
    design.node("lidar", namespace="front").publishes("scan", LaserScan)
    (end,) = design.nodes["front/lidar"].endpoints
    assert end.full_name == "/front/scan"


def test_plain_data_make_the_same_design() -> None:
    by_data = Design.from_data(
        {
            "lidar": {"publishes": [["scan", LaserScan, qos_profile_sensor_data]]},
            "reflex": {
                "subscribes": [["scan", "sensor_msgs/msg/LaserScan", qos_profile_sensor_data]],
                "publishes": [["motors/command", "geometry_msgs/msg/Twist"]],
            },
        },
        outside=["motors/command"],
    )
    assert repr(by_data) == repr(small())


@pytest.mark.parametrize(
    ("roles", "says"),
    [
        ({"writes": [["scan", LaserScan]]}, "'writes' is not one of publishes, subscribes"),
        ({"publishes": ["scan"]}, r"'scan' is not \[name, type, qos\]"),
        ({"publishes": [["scan"]]}, r"is not \[name, type, qos\]"),
    ],
)
def test_data_that_are_no_design_are_refused(roles: Any, says: str) -> None:
    with pytest.raises(DesignError, match=says):
        Design.from_data({"lidar": roles})


def test_a_design_without_nodes_has_nothing_to_run() -> None:
    with pytest.raises(DesignError, match=r"begin with design\.node"):
        Design().node_factories()


def test_two_types_under_one_name_cannot_run() -> None:
    design = small()
    design.node("camera").publishes("scan", Image)
    with pytest.raises(DesignError, match=r"/scan has more than one type: .*Image in camera"):
        design.node_factories()


def test_a_sound_design_has_no_findings() -> None:
    assert small().findings() == []


def test_what_dangles_or_does_not_fit_is_found() -> None:
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    design = small()
    design.node("camera").publishes("image", Image)
    design.node("planner").subscribes("map", Image, latched).calls("plan", GetPlan)
    design.node("mission").action_client("navigate", Fibonacci)
    design.node("strict").subscribes("scan", LaserScan)
    design.node("a").serves("stop", GetPlan)
    design.node("b").serves("stop", GetPlan)
    found = "\n".join(design.findings())
    for sentence in (
        "camera publishes on /image, but nobody subscribes to it.",
        "planner subscribes to /map, but nobody publishes on it.",
        "planner calls /plan, but nobody serves it.",
        "mission sends goals to /navigate, but no node is its action server.",
        "lidar and strict do not connect on /scan:",
        "/stop has 2 servers (a and b): one is right.",
    ):
        assert sentence in found


def test_the_text_tells_what_the_graph_shows() -> None:
    design = small()
    design.node("navigation").action_server("navigate", Fibonacci).calls("plan", GetPlan)
    text = repr(design)
    for line in (
        "A design of 3 nodes and 4 links",
        "publishes /scan (sensor_msgs/msg/LaserScan; best effort, volatile, keep last 5)",
        "topic /scan: lidar -> reflex",
        "topic /motors/command: reflex -> (outside the design)",
        "service /plan: navigation -> (nobody)",
        "action /navigate: (nobody) -> navigation",
        "navigation calls /plan, but nobody serves it.",
    ):
        assert line in text


def test_the_graph_has_every_node_and_link() -> None:
    bundle = small()._repr_mimebundle_()
    assert bundle["text/plain"] == repr(small())
    assert bundle["text/vnd.mermaid"].splitlines() == [
        "flowchart LR",
        '  n0(["<b>lidar</b>"])',
        '  n1(["<b>reflex</b>"])',
        '  l0["/scan<br/><small>LaserScan</small>"]',
        '  n0 -- "best effort · volatile · 5" --> l0',
        '  l0 -- "best effort · volatile · 5" --> n1',
        '  l1["/motors/command<br/><small>Twist</small>"]',
        '  n1 -- "reliable · volatile · 10" --> l1',
        "  l1 --> ol1((outside))",
    ]


def test_an_empty_design_says_how_to_begin() -> None:
    assert "begin with design.node" in repr(Design())
