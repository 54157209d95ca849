"""What a scan or a picture says about what is in the way, as seen from the robot."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from course.design.at_work.driving.steering import HALF_WIDTH_M
from course.design.at_work.places.place import Place
from course.worlds.robot.camera import CAMERA_HEIGHT_M, FOCAL_PIXELS

NEAR_M = 2.5
"""Metres within which things are reported."""

_APART_M = 0.08  # m between two points of the same thing
_BEHIND_M = 1.0  # m within which things behind are told, too


def find_in_scan(scan: Any) -> list[Place]:
    """Return points of what a LaserScan met nearby, not far behind the robot."""
    ranges = np.array(scan.ranges, np.float64)
    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    near = np.isfinite(ranges) & (ranges < NEAR_M) & (ranges >= scan.range_min)
    return _thin(ranges[near] * np.cos(angles[near]), ranges[near] * np.sin(angles[near]))


def find_in_picture(image: Any) -> list[Place]:
    """Return points of what stands on the floor in an Image (rgb8), where it meets the floor.

    The camera looks over what is less than 0.9 m away: that is told as if it were 0.9 m away.
    """
    if image.encoding != "rgb8" or image.height * image.width * 3 != len(image.data):
        return []
    pixels = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.width, 3)
    red, green, blue = (pixels[::-1, :, channel].astype(np.int16) for channel in range(3))
    is_floor = (green > red) & (green > blue)  # of all that there is, only the floor is greenish
    foot_rows = image.height - np.argmin(is_floor, axis=0)  # from above, just below the thing
    below_middle = np.maximum(foot_rows - image.height / 2, 0.5)
    ahead = FOCAL_PIXELS * CAMERA_HEIGHT_M / below_middle
    left = -(np.arange(image.width) - (image.width - 1) / 2) / FOCAL_PIXELS * ahead
    near = ahead < NEAR_M
    return _thin(ahead[near], left[near])


def nearest_first(points: list[Place]) -> list[Place]:
    """Return points in the order in which they matter: those in the robot's way come first."""

    def is_aside(point: Place) -> bool:
        return point.x <= 0.0 or abs(point.y) >= HALF_WIDTH_M

    return sorted(points, key=lambda point: (is_aside(point), math.hypot(point.x, point.y)))


def _thin(x: NDArray[np.float64], y: NDArray[np.float64]) -> list[Place]:
    """Return one point for each small square of floor, none from behind."""
    found = {
        (round(a / _APART_M), round(b / _APART_M)): Place(a, b)
        for a, b in zip(x.tolist(), y.tolist(), strict=True)
        if a > -_BEHIND_M
    }
    return list(found.values())
