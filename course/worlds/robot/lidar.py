"""The LIDAR: 360 beams from the robot's middle, the first straight ahead, on counter-clockwise."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from course.worlds.floor import Floor
from course.worlds.ray_casting import Floats, cast_rays

BEAMS = 360
RANGE_MIN_M, RANGE_MAX_M = 0.1, 10.0
NOISE_M = 0.01
"""Standard deviation of a reading."""

ANGLES: Floats = np.linspace(0.0, 2 * np.pi, BEAMS, endpoint=False, dtype=np.float64)
"""Rad of each beam from straight ahead."""


def read_lidar(
    floor: Floor, x: float, y: float, yaw: float, noise: Generator
) -> NDArray[np.float32]:
    """Return a scan in m: infinite where nothing is within reach, as REP 117 has it."""
    distances, _ = cast_rays(x, y, ANGLES + yaw, floor.segments, floor.circles)
    noisy = np.maximum(distances + noise.normal(0.0, NOISE_M, BEAMS), RANGE_MIN_M)
    noisy[distances > RANGE_MAX_M] = np.inf
    return np.minimum(noisy, RANGE_MAX_M, where=np.isfinite(noisy), out=noisy).astype(np.float32)
