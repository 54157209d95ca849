"""Floors to test on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from course.worlds.floor_plan import FloorPlan
from course.worlds.simulation import Simulation

MakeSimulation = Callable[..., Simulation]


@pytest.fixture
def on_floor() -> MakeSimulation:
    """Return a function that makes a simulation on an empty floor of 20 x 10 m, start at (5, 5)."""

    def make(seed: int = 0, **fields: Any) -> Simulation:
        data = {"name": "hall", "size": [20, 10], "start": {"x": 5.0, "y": 5.0}, **fields}
        return Simulation(FloorPlan.model_validate(data), seed)

    return make
