"""Places in messages that are arrays: a point cloud, and a grid of cells."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import Any

import numpy as np
from sensor_msgs.msg import PointField

from course.design.at_work.places.place import Place, Slot

_CELL_M, _CELLS = 0.1, 60
"""Of a grid that is made around the robot: metres that a cell is wide, and cells to a side."""

_OCCUPIED = 50


def cloud_slot(cloud: Any) -> Slot:
    """Return the place for points in a PointCloud2, as x, y and z of 32 bits."""

    def put(places: Sequence[Place], _: str) -> None:
        points = np.array([(p.x, p.y, 0.2) for p in places], dtype="<f4").reshape(-1, 3)
        cloud.fields = [
            PointField(name=name, offset=4 * at, datatype=PointField.FLOAT32, count=1)
            for at, name in enumerate("xyz")
        ]
        cloud.height, cloud.width, cloud.is_dense = 1, len(points), True
        cloud.point_step, cloud.row_step = 12, 12 * len(points)
        cloud.data = array("B", points.tobytes())

    def get() -> list[Place]:
        offsets = {field.name: field.offset for field in cloud.fields}
        if not {"x", "y"} <= offsets.keys() or not cloud.point_step:
            return []
        step = cloud.point_step
        rows = np.frombuffer(bytes(cloud.data), np.uint8)[: len(cloud.data) // step * step]
        rows = rows.reshape(-1, step)
        x, y = (
            rows[:, offsets[name] : offsets[name] + 4].copy().view("<f4")[:, 0] for name in "xy"
        )
        return [Place(*point) for point in zip(x.tolist(), y.tolist(), strict=True)]

    return Slot(put, get, many=True)


def grid_slot(grid: Any) -> Slot:
    """Return the place for points in an OccupancyGrid: the middles of its occupied cells."""
    info = grid.info

    def put(places: Sequence[Place], _: str) -> None:
        info.resolution, info.width, info.height = _CELL_M, _CELLS, _CELLS
        info.origin.position.x = info.origin.position.y = -_CELL_M * _CELLS / 2
        cells = np.zeros((_CELLS, _CELLS), np.int8)
        for place in places:
            column = int(place.x / _CELL_M + _CELLS / 2)
            row = int(place.y / _CELL_M + _CELLS / 2)
            if 0 <= column < _CELLS and 0 <= row < _CELLS:
                cells[row, column] = 100
        grid.data = array("b", cells.tobytes())

    def get() -> list[Place]:
        cells = np.array(grid.data, np.int8)[: info.width * info.height]
        rows, columns = np.nonzero(cells.reshape(-1, max(info.width, 1)) >= _OCCUPIED)
        x = info.origin.position.x + (columns + 0.5) * info.resolution
        y = info.origin.position.y + (rows + 0.5) * info.resolution
        return [Place(*point) for point in zip(x.tolist(), y.tolist(), strict=True)]

    return Slot(put, get, many=True)
