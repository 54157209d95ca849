"""Who does which job, and why one is not done: decided on graphs that are plain data."""

from __future__ import annotations

import pytest

from autograder.exercises.architecture.missing_jobs import why_no_obstacles
from autograder.exercises.architecture.robot_jobs import Jobs
from autograder.observe.graph.ros_graph import GraphService
from tests.autograder.observe.graphs import ARRAY, SCAN, TWIST, graph, topic


def test_a_filtered_scan_is_still_a_scan() -> None:
    jobs = Jobs(
        graph(
            topic("/scan", SCAN, "lidar", "filter"),
            topic("/scan/filtered", SCAN, "filter", "detector"),
            topic("/obstacles", ARRAY, "detector", "controller"),
            topic("/motors/command", TWIST, "controller", ""),
        )
    )
    assert [t.name for t in jobs.obstacle_topics] == ["/obstacles"]


@pytest.mark.parametrize(
    ("kind", "readers"),
    [
        (SCAN, "controller"),
        (TWIST, "controller"),
        ("geometry_msgs/msg/PoseStamped", "controller"),
        ("std_msgs/msg/Bool", "controller"),
        (ARRAY, "display"),
        (ARRAY, "detector"),
        (ARRAY, ""),
    ],
)
def test_not_everything_that_a_detector_publishes_is_obstacle_information(
    kind: str, readers: str
) -> None:
    jobs = Jobs(
        graph(
            topic("/scan", SCAN, "lidar", "detector"),
            topic("/obstacles", kind, "detector", readers),
            topic("/motors/command", TWIST, "controller", ""),
        )
    )
    assert jobs.obstacle_topics == []


def test_a_map_is_known_by_topic_by_service_and_by_costmap() -> None:
    grid = "nav_msgs/msg/OccupancyGrid"
    jobs = Jobs(
        graph(
            topic("/map", grid, "server", "costmap localization"),
            topic("/costmap", grid, "costmap", "planner"),
            topic("/pose", "geometry_msgs/msg/PoseStamped", "localization", "display"),
            services=[GraphService("/map/get", "nav_msgs/srv/GetMap", {"/server"}, {"/other"})],
        )
    )
    assert jobs.map_readers == {"/costmap", "/localization", "/planner", "/other"}


def test_without_a_navigator_the_goal_gets_where_anything_leads_from_another_node() -> None:
    command = topic("/motors/command", TWIST, "lone controller", "")
    own = topic("/scan", SCAN, "lone", "lone")
    jobs = Jobs(graph(own, topic("/velocity", TWIST, "planner", "controller"), command))
    assert jobs.controllers == {"/lone", "/controller"}
    assert jobs.goal_reaches == {"/controller"}


def test_only_services_on_the_way_to_the_motors_are_named() -> None:
    jobs = Jobs(
        graph(
            topic("/scan", SCAN, "lidar", "detector"),
            topic("/obstacles", ARRAY, "detector", "navigation"),
            topic("/motors/command", TWIST, "controller", ""),
            services=[
                GraphService("/plan", "", {"/planner"}, {"/navigation"}),
                GraphService("/set_velocity", "", {"/controller"}, {"/navigation"}),
            ],
        )
    )
    assert jobs.services_on_the_way() == ["/set_velocity"]
    assert not jobs.leads_to_motors(jobs.obstacle_topics[0], ("topic", "goal"))


def test_obstacle_information_that_is_asked_for_beside_a_log_is_told_so() -> None:
    topics = [
        topic("/scan", SCAN, "lidar", "detector"),
        topic("/obstacles", ARRAY, "detector", "log"),
        topic("/motors/command", TWIST, "controller", ""),
    ]
    asked = GraphService("/nearest", "nav_msgs/srv/GetPlan", {"/detector"}, {"/controller"})
    told = why_no_obstacles(Jobs(graph(*topics, services=[asked])))
    assert "detector hands it out by the service /nearest to controller: " in told
    asked.type = "std_srvs/srv/Trigger"
    told = why_no_obstacles(Jobs(graph(*topics, services=[asked])))
    assert told.endswith("/obstacles ends at log, from where nothing leads to /motors/command.")


def test_navigation_that_detects_beside_a_node_that_only_reads_is_named() -> None:
    jobs = Jobs(
        graph(
            topic("/scan", SCAN, "lidar", "navigation log"),
            topic("/obstacles", ARRAY, "navigation", "controller"),
            topic("/motors/command", TWIST, "controller", ""),
            actions=[GraphService("/navigate_to", "", {"/navigation"})],
        )
    )
    assert why_no_obstacles(jobs).startswith("navigation, not log, publishes /obstacles: ")


def test_a_pose_that_comes_from_no_sensor_is_not_held_against_navigation() -> None:
    pose = "geometry_msgs/msg/PoseStamped"
    made_up = topic("/pose", pose, "estimator", "navigation")
    actions = [GraphService("/navigate_to", "", {"/navigation"})]
    assert Jobs(graph(made_up, actions=actions)).informed_navigators == {"/navigation"}
    estimated = [
        topic("/wheel/odometry", "nav_msgs/msg/Odometry", "wheels", "odometer"),
        topic("/odometry", "nav_msgs/msg/Odometry", "odometer", "display"),
    ]
    assert not Jobs(graph(made_up, *estimated, actions=actions)).informed_navigators


def test_a_debugging_pose_is_not_held_against_a_busy_node() -> None:
    pose, odometry = "geometry_msgs/msg/PoseStamped", "nav_msgs/msg/Odometry"
    topics = [
        topic("/wheel/odometry", odometry, "driver", "estimator pilot"),
        topic("/pose", pose, "estimator", "pilot"),
        topic("/target", pose, "pilot", "display"),
        topic("/map", "nav_msgs/msg/OccupancyGrid", "server", "pilot"),
        topic("/motors/command", TWIST, "pilot", ""),
    ]
    services = [GraphService("/plan", "", {"/pilot"}, {"/navigation"})]
    jobs = Jobs(graph(*topics, services=services)).of_each_node()
    assert jobs["/pilot"] == ["plans paths", "controls the motors"]
    assert jobs["/estimator"] == ["estimates the state"]
    alone = Jobs(graph(topics[0], *topics[2:], services=services)).of_each_node()
    assert alone["/pilot"] == ["estimates the state", "plans paths", "controls the motors"]
