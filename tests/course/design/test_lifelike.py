"""Lifelike messages: of every type, without a mark, and such that a node can work on them."""

from __future__ import annotations

import math
from typing import Any

import pytest
from geometry_msgs.msg import PoseArray
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.srv import GetPlan
from sensor_msgs.msg import Image, LaserScan, PointCloud2

from course.design import message_tags
from course.design.lifelike import lifelike_message
from tests.course.design.test_message_tags import message_types


@pytest.mark.parametrize("msg_type", list(message_types()), ids=lambda cls: cls.__name__)
def test_every_installed_type_is_filled_and_has_room_for_a_mark_as_before(msg_type: Any) -> None:
    message = lifelike_message(msg_type)
    assert message_tags.read_tag(message) is None
    assert bool(message_tags.mark(message, 2_000_000)) == message_tags.has_room(msg_type)
    assert message_tags.read_tag(message) == (
        2_000_000 if message_tags.has_room(msg_type) else None
    )


def test_a_scan_has_an_obstacle_where_its_angles_say() -> None:
    scan = lifelike_message(LaserScan, ahead=0.7)
    beams = [scan.angle_min + n * scan.angle_increment for n in range(len(scan.ranges))]
    assert len(beams) == 180
    assert beams[-1] == pytest.approx(scan.angle_max, abs=1e-4)
    assert all(scan.range_min < reading < scan.range_max for reading in scan.ranges)
    nearest = min(range(len(beams)), key=lambda beam: scan.ranges[beam])
    assert scan.ranges[nearest] == pytest.approx(0.7)
    assert abs(beams[nearest]) < math.radians(6)


def test_images_clouds_and_grids_have_as_many_data_as_they_say() -> None:
    image, cloud, grid = (
        lifelike_message(Image),
        lifelike_message(PointCloud2),
        lifelike_message(OccupancyGrid),
    )
    assert len(image.data) == image.step * image.height
    assert image.step == 3 * image.width
    assert len(cloud.data) == cloud.row_step * cloud.height
    assert len(grid.data) == grid.info.width * grid.info.height
    assert max(grid.data) == 100


def test_a_grid_has_the_robot_what_is_ahead_and_a_goal_in_it() -> None:
    grid = lifelike_message(OccupancyGrid, ahead=0.7)
    row = round(-grid.info.origin.position.y / grid.info.resolution)

    def cell(x: float) -> int:
        column = int((x - grid.info.origin.position.x) / grid.info.resolution)
        assert column < grid.info.width
        return int(grid.data[row * grid.info.width + column])

    assert [cell(x) for x in (0.0, 0.7, 5.0)] == [0, 100, 0]


def test_places_are_ahead_and_orientations_are_rotations() -> None:
    goal = lifelike_message(GetPlan.Request, ahead=5.0).goal
    assert (goal.pose.position.x, goal.pose.orientation.w) == (5.0, 1.0)
    assert lifelike_message(PoseArray).poses[0].position.x == 0.5
    assert lifelike_message(GetPlan.Response).plan.poses
    odometry = lifelike_message(Odometry)
    assert (odometry.pose.pose.position.x, odometry.pose.pose.orientation.w) == (0.0, 1.0)
