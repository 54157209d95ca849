"""A moment of a simulated world as an SVG document, for a notebook that nobody runs any more."""

from __future__ import annotations

import math
from collections.abc import Iterable
from html import escape
from typing import Any

WIDTH_PX = 720
"""Width of the picture."""

_STYLE = """
svg { background: #f4f6f8 } .shelf { fill: #c9a87c; stroke: #8a6a3f } .wall { stroke: #37474f }
.station { fill: #cfe3fb; stroke: #1565c0 } text { fill: #0d3c73; font-family: sans-serif }
.beams { fill: #1565c0; opacity: 0.13 } .trail { stroke: #1565c0; opacity: 0.6 }
.path { stroke: #2e7d32; stroke-dasharray: 0.2 0.12 } .found { stroke: #c62828 }
.obstacle { fill: #ef6c00; stroke: #8f3f00 } .person { fill: #6a1b9a } .robot { fill: #263238 }
.heading { fill: #ffca28 } polyline, .found { fill: none }
"""


def draw_world(floor: dict[str, Any], moment: dict[str, Any], words: str) -> str:
    """Return an SVG document of the floor and what is on it; ``words`` become its description.

    Args:
        floor: as `Simulation.describe_floor` returns it.
        moment: as `Simulation.describe_moment` returns it.
        words: the same as text.
    """
    width, height = floor["width"], floor["height"]
    return "".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" width="{WIDTH_PX}" '
        f'height="{WIDTH_PX * height / width:.0f}" '
        f'viewBox="-0.1 -0.1 {width + 0.2:.2f} {height + 0.2:.2f}">',
        f"<title>{_text(floor['name'])}</title><desc>{_text(words)}</desc>",
        f"<style>{_STYLE}</style>",
        # Up is north: y grows downwards in a picture, and upwards in a world.
        f'<g transform="translate(0 {height:.2f}) scale(1 -1)" stroke-width="0.03">',
        *_draw_floor(floor),
        *_draw_moment(moment),
        _draw_robot(floor, moment["robot"]),
        "</g>",
        *(_draw_name(station, height) for station in floor["stations"]),
        "</svg>",
    ])  # fmt: skip


def _draw_floor(floor: dict[str, Any]) -> Iterable[str]:
    for x, y, width, height in floor["shelves"]:
        yield (
            f'<rect class="shelf" x="{x:.2f}" y="{y:.2f}" width="{width:.2f}" '
            f'height="{height:.2f}"/>'
        )
    for station in floor["stations"]:
        yield _draw_circle("station", station["x"], station["y"], 0.3)
    for x1, y1, x2, y2 in floor["walls"]:
        yield (
            f'<line class="wall" x1="{x1:.2f}" y1="{y1:.2f}" x2="{x2:.2f}" y2="{y2:.2f}" '
            'stroke-width="0.08" stroke-linecap="round"/>'
        )


def _draw_moment(moment: dict[str, Any]) -> Iterable[str]:
    yield _draw_beams(moment)
    yield _draw_line("trail", moment["trail"])
    yield _draw_line("path", moment["path"])
    for _, x, y, radius in moment["obstacles"]:
        yield _draw_circle("obstacle", x, y, radius)
    for x, y, radius in moment["people"]:
        yield _draw_circle("person", x, y, radius)
    for x, y in moment["found"]:
        yield _draw_circle("found", x, y, 0.3)


def _draw_beams(moment: dict[str, Any]) -> str:
    robot, beams = moment["robot"], moment["beams"]
    ends = []
    for place, beam in enumerate(beams):
        angle = robot["yaw"] + 2 * math.pi * place / len(beams)
        reach = 0.0 if beam is None else beam
        ends.append(
            f"{robot['x'] + reach * math.cos(angle):.2f},{robot['y'] + reach * math.sin(angle):.2f}"
        )
    return f'<polygon class="beams" points="{" ".join(ends)}"/>'


def _draw_robot(floor: dict[str, Any], robot: dict[str, Any]) -> str:
    radius = floor["robot_radius"]
    turned = (
        f"translate({robot['x']:.2f} {robot['y']:.2f}) rotate({math.degrees(robot['yaw']):.0f})"
    )
    tip = f"{radius * 0.85:.2f},0 {-radius * 0.2:.2f},{radius * 0.5:.2f} "
    tip += f"{-radius * 0.2:.2f},{-radius * 0.5:.2f}"
    body = _draw_circle("robot", 0.0, 0.0, radius)
    return f'<g transform="{turned}">{body}<polygon class="heading" points="{tip}"/></g>'


def _draw_line(kind: str, points: list[list[float]]) -> str:
    places = " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
    return f'<polyline class="{kind}" points="{places}" stroke-width="0.06"/>'


def _draw_circle(kind: str, x: float, y: float, radius: float) -> str:
    return f'<circle class="{kind}" cx="{x:.2f}" cy="{y:.2f}" r="{radius:.2f}"/>'


def _draw_name(station: dict[str, Any], height: float) -> str:
    return (
        f'<text x="{station["x"]:.2f}" y="{height - station["y"] + 0.55:.2f}" font-size="0.28" '
        f'text-anchor="middle">{_text(station["name"])}</text>'
    )


def _text(whole: str) -> str:
    """Return text that XML takes: escaped, and without what it has no place for."""
    return escape("".join(c for c in whole if c in "\n\t" or (c.isprintable() and c != "\ufffe")))
