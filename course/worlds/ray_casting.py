"""Rays against segments and circles in the plane, and distances to them, as arrays of numpy.

Segments are an array (n, 4) of x1, y1, x2, y2; circles an array (m, 3) of x, y, radius; all in m.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def cast_rays(
    x: float, y: float, angles: Floats, segments: Floats, circles: Floats
) -> tuple[Floats, NDArray[np.intp]]:
    """Return how far each ray from (x, y) goes, and what it meets.

    >>> wall = np.array([[2.0, -1.0, 2.0, 1.0]])
    >>> cast_rays(0.0, 0.0, np.array([0.0, np.pi]), wall, np.empty((0, 3)))[0]
    array([ 2., inf])

    Args:
        x: of the point where all begin.
        y: of it.
        angles: rad, one a ray.
        segments: what they may meet, (n, 4).
        circles: what they may meet, (m, 3); a ray that begins in one meets it at once.

    Returns:
        Distances in m, infinite where nothing is met; and the number of the segment, or n plus the
        number of the circle, which says nothing where nothing is met.
    """
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    columns = []
    if len(segments):
        columns.append(_meet_segments(x, y, cos, sin, segments))
    if len(circles):
        columns.append(_meet_circles(x, y, cos, sin, circles))
    if not columns:
        return np.full(len(angles), np.inf), np.zeros(len(angles), np.intp)
    distances = np.concatenate(columns, axis=1) if len(columns) > 1 else columns[0]
    nearest = np.argmin(distances, axis=1)
    return distances[np.arange(len(angles)), nearest], nearest


def distances_to(x: float, y: float, segments: Floats, circles: Floats) -> Floats:
    """Return how far a point is from each segment, then from each circle's rim; inside, < 0."""
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    to_point = np.array([x, y]) - start
    length2 = np.maximum(np.einsum("ij,ij->i", along, along), 1e-12)
    share = np.clip(np.einsum("ij,ij->i", to_point, along) / length2, 0.0, 1.0)
    off = to_point - share[:, None] * along
    to_rims = np.hypot(circles[:, 0] - x, circles[:, 1] - y) - circles[:, 2]
    return np.concatenate([np.hypot(off[:, 0], off[:, 1]), to_rims])


def _meet_segments(x: float, y: float, cos: Floats, sin: Floats, segments: Floats) -> Floats:
    to_x, to_y = segments[:, 0] - x, segments[:, 1] - y
    along_x, along_y = segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]
    across = cos * along_y - sin * along_x
    with np.errstate(divide="ignore", invalid="ignore"):  # parallel ones meet nowhere
        distance = (to_x * along_y - to_y * along_x) / across
        share = (to_x * sin - to_y * cos) / across
        met = (distance >= 0.0) & (share >= 0.0) & (share <= 1.0)
    return np.where(met, distance, np.inf)


def _meet_circles(x: float, y: float, cos: Floats, sin: Floats, circles: Floats) -> Floats:
    to_x, to_y = circles[:, 0] - x, circles[:, 1] - y
    outside = to_x**2 + to_y**2 - circles[:, 2] ** 2
    ahead = cos * to_x + sin * to_y
    under_root = ahead**2 - outside
    distance = ahead - np.sqrt(np.maximum(under_root, 0.0))
    met = (under_root >= 0.0) & (distance >= 0.0)
    return np.where(outside <= 0.0, 0.0, np.where(met, distance, np.inf))
