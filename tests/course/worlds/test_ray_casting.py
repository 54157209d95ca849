"""Rays against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from course.worlds.ray_casting import cast_rays, distances_to

NO_SEGMENTS, NO_CIRCLES = np.empty((0, 4)), np.empty((0, 3))


def test_a_beam_meets_a_wall_at_an_angle_where_trigonometry_says():
    wall = np.array([[2.0, -50.0, 2.0, 50.0]])
    angles = np.radians([0.0, 30.0, -45.0, 60.0, 90.0, 180.0])
    distances, _ = cast_rays(0.5, 7.0, angles, wall, NO_CIRCLES)
    assert distances[:4] == pytest.approx([1.5 / math.cos(a) for a in angles[:4]])
    assert not np.isfinite(distances[5])


def test_a_beam_along_a_wall_and_one_past_its_end_meet_nothing():
    wall = np.array([[1.0, 1.0, 3.0, 1.0]])
    distances, _ = cast_rays(0.0, 0.0, np.array([0.0, math.atan2(1.0, 3.1)]), wall, NO_CIRCLES)
    assert np.isinf(distances).all()


def test_a_beam_meets_a_circle_where_pythagoras_says():
    circle = np.array([[4.0, 0.0, 1.0]])
    offset = 0.3  # rad: the beam passes the middle at 4 sin 0.3
    angles = np.array([0.0, offset, math.asin(1 / 4) + 1e-6, math.pi])
    distances, _ = cast_rays(0.0, 0.0, angles, NO_SEGMENTS, circle)
    expected = 4 * math.cos(offset) - math.sqrt(1 - (4 * math.sin(offset)) ** 2) \
        if 4 * math.sin(offset) < 1 else math.inf  # fmt: skip
    assert distances == pytest.approx([3.0, expected, math.inf, math.inf])
    slanting, _ = cast_rays(0.0, 0.0, np.array([0.2]), NO_SEGMENTS, circle)
    assert slanting[0] == pytest.approx(4 * math.cos(0.2) - math.sqrt(1 - (4 * math.sin(0.2)) ** 2))


def test_the_nearest_of_all_is_met_and_named():
    walls = np.array([[5.0, -1.0, 5.0, 1.0], [3.0, -1.0, 3.0, 1.0]])
    circles = np.array([[2.0, 0.0, 0.5], [-4.0, 0.0, 1.0]])
    distances, numbers = cast_rays(0.0, 0.0, np.array([0.0, math.pi]), walls, circles)
    assert distances == pytest.approx([1.5, 3.0])
    assert list(numbers) == [2, 3]
    distances, numbers = cast_rays(0.0, 0.0, np.array([0.0]), walls, NO_CIRCLES)
    assert (distances[0], numbers[0]) == (3.0, 1)


def test_a_beam_that_begins_in_a_circle_meets_it_at_once():
    distances, _ = cast_rays(0.1, 0.0, np.array([2.0]), NO_SEGMENTS, np.array([[0.0, 0.0, 1.0]]))
    assert distances[0] == 0.0


def test_an_empty_plane_holds_nothing_up():
    distances, _ = cast_rays(0.0, 0.0, np.zeros(3), NO_SEGMENTS, NO_CIRCLES)
    assert np.isinf(distances).all()


def test_distances_are_to_the_nearest_point_of_each_thing():
    segments = np.array([[0.0, 0.0, 4.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    found = distances_to(7.0, 4.0, segments, np.array([[7.0, 6.0, 0.5], [7.0, 4.0, 1.0]]))
    assert found == pytest.approx([5.0, math.hypot(7, 4), 1.5, -1.0])
