"""The camera: 160x120 pixels, drawn column by column from one ray each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from course.worlds.floor import Floor
from course.worlds.ray_casting import Floats, cast_rays

WIDTH, HEIGHT = 160, 120
FIELD_OF_VIEW_RAD = np.pi / 3

CAMERA_HEIGHT_M = 0.4
FOCAL_PIXELS = WIDTH / 2 / np.tan(FIELD_OF_VIEW_RAD / 2)
_ANGLES = -np.arctan((np.arange(WIDTH) - (WIDTH - 1) / 2) / FOCAL_PIXELS)  # the left ones are > 0
_ROWS = np.arange(HEIGHT)[:, None]
_HEIGHTS_M = np.array([2.5, 1.6, 1.75, 0.6])  # of a wall, a shelf, a person, an obstacle
_COLOURS = np.array(
    [[176.0, 178.0, 184.0], [166.0, 112.0, 60.0], [52.0, 98.0, 178.0], [224.0, 96.0, 32.0]]
)
_FADE_M = 8.0  # m after which a colour has about a third of its brightness left


def render_camera(floor: Floor, x: float, y: float, yaw: float) -> NDArray[np.uint8]:
    """Return what the camera sees: (120, 160, 3), RGB."""
    image = _BACKGROUND.copy()
    fixed = len(floor.segments)
    # What stands first and what moves after it: one may be seen above the other.
    nothing = np.empty((0, 3))
    layers = [cast_rays(x, y, _ANGLES + yaw, floor.segments, nothing)]
    if len(floor.circles):
        distances, number = cast_rays(x, y, _ANGLES + yaw, nothing[:, :0], floor.circles)
        distances[distances >= layers[0][0]] = np.inf  # behind a wall
        layers.append((distances, number + fixed))
    for distances, number in layers:
        _draw_columns(image, distances, floor.kinds[number])
    return image


def _draw_columns(image: NDArray[np.uint8], distances: Floats, kinds: NDArray[np.intp]) -> None:
    depth = np.maximum(distances * np.cos(_ANGLES), 0.05)
    scale = FOCAL_PIXELS / depth
    top = HEIGHT / 2 - scale * (_HEIGHTS_M[kinds] - CAMERA_HEIGHT_M)
    foot = HEIGHT / 2 + scale * CAMERA_HEIGHT_M
    shade = np.exp(-np.minimum(depth, 100.0) / _FADE_M)[:, None]
    colours = (_COLOURS[kinds] * (0.25 + 0.75 * shade)).astype(np.uint8)
    seen = (top <= _ROWS) & (foot > _ROWS) & np.isfinite(distances)
    np.copyto(image, colours[None, :, :], where=seen[:, :, None])


def _make_background() -> NDArray[np.uint8]:
    """Return a ceiling that gets darker and a floor that gets brighter, from far to near."""
    nearness = np.abs(np.arange(HEIGHT) - HEIGHT / 2) / (HEIGHT / 2)
    ceiling, ground = np.array([70.0, 76.0, 88.0]), np.array([96.0, 100.0, 96.0])
    above = (np.arange(HEIGHT) < HEIGHT / 2)[:, None]
    rows = np.where(above, ceiling * (0.6 + 0.4 * nearness[:, None]),
                    ground * (0.5 + 0.6 * nearness[:, None]))  # fmt: skip
    return np.repeat(rows[:, None, :], WIDTH, axis=1).astype(np.uint8)


_BACKGROUND = _make_background()
