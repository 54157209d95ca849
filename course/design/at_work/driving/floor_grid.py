"""The floor as a grid of cells, as message of a map, and the way through it."""

from __future__ import annotations

import heapq
import math
from array import array
from collections.abc import Iterable
from typing import Any

import numpy as np
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray

from course.design.at_work.places.place import MAP, Place, distance_between
from course.worlds.floor_plan import ROBOT_RADIUS_M

CELL_M = 0.1
"""Metres that a cell is wide."""

MARGIN_M = 0.05
"""Metres that a way keeps from everything."""

ROOM_COSTS = ((0.45, 3), (0.17, 8))
"""Metres of room to either side that a way had better have, and what a metre with less counts."""

_STEP_M = 0.2  # between two places of a way
_OCCUPIED = 50
_NEIGHBOURS = [(r, c, math.hypot(r, c)) for r in (-1, 0, 1) for c in (-1, 0, 1) if r or c]
Cell = tuple[int, int]
Cells = NDArray[np.bool_]
Costs = NDArray[np.int_]


class FloorGrid:
    """Which cells of a floor are taken, (rows, columns) from the origin on."""

    def __init__(self, taken: Cells, cell_m: float, x: float, y: float) -> None:
        """Be a grid whose first cell begins at (``x``, ``y``)."""
        self.taken, self.cell_m, self.x, self.y = taken, cell_m, x, y

    @classmethod
    def from_floor(cls, floor: dict[str, Any]) -> FloorGrid:
        """Draw the walls and shelves of a floor, as `Simulation.describe_floor` returns it."""
        size = round(floor["height"] / CELL_M), round(floor["width"] / CELL_M)
        grid = cls(np.zeros(size, np.bool_), CELL_M, 0.0, 0.0)
        for x1, y1, x2, y2 in floor["walls"]:
            for share in np.linspace(0.0, 1.0, 2 + int(math.hypot(x2 - x1, y2 - y1) / CELL_M * 2)):
                grid.take(x1 + (x2 - x1) * share, y1 + (y2 - y1) * share)
        for x, y, width, height in floor["shelves"]:
            (low, left), (high, right) = grid.cell_of(x, y), grid.cell_of(x + width, y + height)
            grid.taken[low : high + 1, left : right + 1] = True
        return grid

    @classmethod
    def from_message(cls, message: OccupancyGrid) -> FloorGrid | None:
        """Read a map; None if there is nothing in it."""
        info = message.info
        if not info.width or not info.height or len(message.data) != info.width * info.height:
            return None
        cells = np.array(message.data, np.int8).reshape(info.height, info.width) >= _OCCUPIED
        return cls(cells, info.resolution, info.origin.position.x, info.origin.position.y)

    def write_message(self, message: OccupancyGrid) -> None:
        """Write the grid into a message."""
        info = message.info
        message.header.frame_id = MAP
        info.height, info.width = self.taken.shape
        info.resolution, info.origin.position.x, info.origin.position.y = (
            self.cell_m,
            self.x,
            self.y,
        )
        info.origin.orientation.w = 1.0
        message.data = array("b", (self.taken * 100).astype(np.int8).tobytes())

    def cell_of(self, x: float, y: float) -> Cell:
        """Return the row and column of a place; of one outside, the nearest."""
        rows, columns = self.taken.shape
        row, column = int((y - self.y) / self.cell_m), int((x - self.x) / self.cell_m)
        return min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)

    def take(self, x: float, y: float) -> None:
        """Have something stand at a place."""
        self.taken[self.cell_of(x, y)] = True

    def find_way(self, start: Place, goal: Place, obstacles: Iterable[Place] = ()) -> list[Place]:
        """Return a way for the robot from start to goal, a place every 0.2 m; [] if there is none.

        Args:
            start: where the robot is.
            goal: where it is to go.
            obstacles: what stands there that is not on the map.
        """
        grid = FloorGrid(self.taken.copy(), self.cell_m, self.x, self.y)
        for place in obstacles:
            grid.take(place.x, place.y)
        costs = np.ones(grid.taken.shape, np.int_)
        for room, cost in (*ROOM_COSTS, (MARGIN_M, 0)):
            costs[_widen(grid.taken, (ROBOT_RADIUS_M + room) / self.cell_m)] = cost
        begin, end = grid.cell_of(start.x, start.y), grid.cell_of(goal.x, goal.y)
        if cells := _search(costs, _free_near(costs, begin), _free_near(costs, end)):
            corners = [grid._middle(cell) for cell in _straighten(costs, cells)]
            return _spread([start, *corners[1:-1], goal])
        return []

    def _middle(self, cell: Cell) -> Place:
        return Place(self.x + (cell[1] + 0.5) * self.cell_m, self.y + (cell[0] + 0.5) * self.cell_m)


def _widen(taken: Cells, radius: float) -> Cells:
    """Return the cells in which a robot of a radius (cells) would touch something."""
    reach, (rows, columns) = int(radius), taken.shape
    wide = np.pad(taken, reach)
    shut = np.zeros_like(taken)
    for row in range(-reach, reach + 1):
        for column in range(-reach, reach + 1):
            if math.hypot(row, column) <= radius:
                shut |= wide[reach + row :, reach + column :][:rows, :columns]
    return shut


def _free_near(costs: Costs, cell: Cell) -> Cell:
    """Return the free cell that is nearest: a robot may stand closer to things than it would go."""
    if costs[cell]:
        return cell
    rows, columns = np.nonzero(costs)
    if not len(rows):
        return cell
    nearest = int(np.hypot(rows - cell[0], columns - cell[1]).argmin())
    return int(rows[nearest]), int(columns[nearest])


def _search(costs: Costs, start: Cell, goal: Cell) -> list[Cell]:
    """Return the cheapest way over cells (A*), [] if there is none; a cost of 0 is no way."""
    rows = np.pad(costs, 1).tolist()  # lists are quicker, cell by cell
    came_from: dict[Cell, Cell] = {}
    paid = {start: 0.0}
    queue = [(0.0, start)]
    done: set[Cell] = set()
    while queue:
        _, here = heapq.heappop(queue)
        if here == goal:
            return _trace(came_from, here)
        if here in done:
            continue
        done.add(here)
        for row, column, length in _NEIGHBOURS:
            there = here[0] + row, here[1] + column
            cost = rows[there[0] + 1][there[1] + 1]
            price = paid[here] + length * cost
            if cost and price < paid.get(there, math.inf):
                paid[there], came_from[there] = price, here
                left = math.hypot(there[0] - goal[0], there[1] - goal[1])
                heapq.heappush(queue, (price + left, there))
    return []


def _trace(came_from: dict[Cell, Cell], last: Cell) -> list[Cell]:
    cells = [last]
    while cells[-1] in came_from:
        cells.append(came_from[cells[-1]])
    return cells[::-1]


def _straighten(costs: Costs, cells: list[Cell]) -> list[Cell]:
    """Return the corners of a way that goes straight where that costs no more."""
    corners, at = [cells[0]], 0
    while at < len(cells) - 1:
        ahead = range(len(cells) - 1, at + 1, -1)
        at = next((n for n in ahead if _is_as_good(costs, cells[at : n + 1])), at + 1)
        corners.append(cells[at])
    return corners


def _is_as_good(costs: Costs, cells: list[Cell]) -> bool:
    """Return whether a straight line is no worse than a way: not shut, and it costs no more."""
    (row, column), (last_row, last_column) = cells[0], cells[-1]
    steps = 2 * max(abs(row - last_row), abs(column - last_column)) + 1
    rows = np.rint(np.linspace(row, last_row, steps)).astype(np.intp)
    columns = np.rint(np.linspace(column, last_column, steps)).astype(np.intp)
    line = costs[rows, columns]
    return bool(line.min() > 0 and line.sum() <= 2 * sum(costs[cell] for cell in cells))


def _spread(corners: list[Place]) -> list[Place]:
    """Return places at even distances along a way."""
    way = [corners[0]]
    for corner in corners[1:]:
        last = way[-1]
        steps = max(1, math.ceil(distance_between(last, corner) / _STEP_M))
        yaw = math.atan2(corner.y - last.y, corner.x - last.x)
        for n in range(1, steps + 1):
            share = n / steps
            way.append(
                Place(
                    last.x + (corner.x - last.x) * share, last.y + (corner.y - last.y) * share, yaw
                )
            )
    return way
