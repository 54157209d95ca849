"""Sensors, people, faults and repeatability of the simulated world."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from course.errors import SessionError
from course.worlds.descriptions import MAX_NEWS
from course.worlds.floor_plan import load_floor_plan, plan_names
from course.worlds.robot import lidar, motion
from course.worlds.robot.faults import FAULTS
from course.worlds.robot.gripper import SLOW_STEPS
from course.worlds.simulation import Simulation


def tour(simulation, steps):
    """Drive in a fixed manner; return the bytes of all that the sensors read, and of the truth."""
    found = []
    for number in range(steps):
        if number % 20 == 0:
            simulation.drive(0.2 + 0.1 * (number % 7), 1.0 - 0.01 * (number % 200))
        readings = simulation.step()
        found.append(repr((readings.imu, readings.wheels, readings.charge)).encode())
        found += [] if readings.scan is None else [readings.scan.tobytes()]
        found += [simulation.render_picture().tobytes()] if number % 100 == 0 else []
    found.append(json.dumps(simulation.describe_moment()).encode())
    return b"".join(found)


def test_ten_seconds_are_the_same_bit_for_bit_with_the_same_seed_and_others_with_another():
    plan = load_floor_plan("warehouse")
    first = tour(Simulation(plan, seed=7), 1000)
    assert tour(Simulation(plan, seed=7), 1000) == first
    assert tour(Simulation(plan, seed=8), 1000) != first


def test_a_reset_makes_everything_as_at_first():
    simulation = Simulation(load_floor_plan("corridor"), seed=2)
    first = tour(simulation, 300)
    simulation.set_fault("wheels", "jammed")
    simulation.press_stop()
    simulation.add_obstacle(3.0, 3.0)
    simulation.take_events()
    simulation.reset()
    assert simulation.take_events() == [("emergency", "released"), ("jammed", False)]
    assert simulation.time_s == 0.0
    assert tour(simulation, 300) == first


def test_each_sensor_reads_at_its_rate(on_floor):
    simulation = on_floor()
    readings = [simulation.step() for _ in range(200)]
    assert sum(r.scan is not None for r in readings) == 20
    assert sum(r.wheels is not None for r in readings) == 40
    assert sum(r.charge is not None for r in readings) == 2
    assert sum(r.picture_due for r in readings) == 20
    assert simulation.time_s == 2.0


def test_a_scan_is_what_trigonometry_says_but_for_its_noise(on_floor):
    simulation = on_floor(seed=4, start={"x": 5.0, "y": 5.0, "yaw": math.pi / 2})
    for _ in range(10):
        simulation.step()
    scan = simulation.scan
    # Looking to +y: 5 m to the upper wall ahead, 5 m to the wall on the left, 15 m on the right.
    angles = np.radians(np.arange(-40, 41))
    assert scan.dtype == np.float32
    errors = scan[np.arange(-40, 41)] - 5.0 / np.cos(angles)
    assert np.abs(errors).max() < 5 * lidar.NOISE_M
    assert np.std(errors) == pytest.approx(lidar.NOISE_M, rel=0.3)
    assert scan[90] == pytest.approx(5.0, abs=0.05)
    assert np.isinf(scan[270])  # out of reach
    assert scan[np.isfinite(scan)].max() <= lidar.RANGE_MAX_M


def test_the_imu_feels_gravity_acceleration_and_turns(on_floor):
    simulation = on_floor()
    readings = []
    for _ in range(600):
        simulation.drive(0.5, 0.5)
        readings.append(simulation.step().imu)
    steady = readings[100:]
    mean = {
        name: np.mean([getattr(r, name) for r in steady])
        for name in motion.ImuReading.__annotations__
    }
    assert mean == pytest.approx(
        {"forward": 0.0, "left": 0.25, "up": motion.GRAVITY_MPS2, "turn": 0.5}, abs=0.02
    )
    assert np.mean([r.forward for r in readings[:50]]) == pytest.approx(1.0, abs=0.05)


def test_the_camera_shows_what_stands_in_front(on_floor):
    simulation = on_floor()
    before = simulation.render_picture()
    assert (before.shape, before.dtype) == ((120, 160, 3), np.uint8)
    number = simulation.add_obstacle(7.0, 5.5)  # to the left
    seen = np.argwhere((simulation.render_picture() != before).any(axis=(0, 2))).ravel()
    middle = 79.5 - 160 / 2 / math.tan(math.pi / 6) * (0.5 / 2.0)
    assert seen.mean() == pytest.approx(middle, abs=1.5)
    simulation.remove_obstacle(number)
    assert (simulation.render_picture() == before).all()


def test_an_obstacle_behind_a_wall_is_not_seen(on_floor):
    simulation = on_floor(walls=[[6.0, 0.0, 6.0, 10.0]])
    before = simulation.render_picture()
    simulation.add_obstacle(7.0, 5.0)
    assert (simulation.render_picture() == before).all()


def test_people_walk_around_at_their_speed_and_wait_for_the_robot(on_floor):
    simulation = on_floor(people=[{"path": [[10.0, 2.0], [12.0, 2.0]], "speed": 0.5}])
    (person,) = simulation.floor.people
    for _ in range(500):
        simulation.step()
    assert (person.x, person.y) == pytest.approx((11.5, 2.0))  # 2 m there, 0.5 m back
    blocked = on_floor(people=[{"path": [[7.0, 5.0], [3.0, 5.0]], "speed": 1.0}])
    for _ in range(500):
        blocked.step()
    assert blocked.floor.people[0].x == pytest.approx(5.6, abs=0.02)
    assert not blocked.robot.touching


@pytest.mark.parametrize(
    ("state", "accepted", "steps"),
    [("works", True, 1), ("slow", True, SLOW_STEPS + 1), ("dead", True, None),
     ("refuses", False, None)],
)  # fmt: skip
def test_the_gripper_does_as_its_fault_says(on_floor, state, accepted, steps):
    simulation = on_floor(stations=[{"name": "dock", "x": 5.2, "y": 5.0}])
    simulation.set_fault("gripper", state)
    assert simulation.command_gripper(True) is accepted
    closed = [bool(simulation.step()) and simulation.gripper.closed for _ in range(300)]
    assert (closed.index(True) + 1 if True in closed else None) == steps
    assert simulation.gripper.holding is (steps is not None)


def test_parcels_are_at_stations_only(on_floor):
    simulation = on_floor()
    simulation.command_gripper(True)
    simulation.step()
    robot = simulation.describe_moment()["robot"]
    assert (robot["gripper"], robot["holding"]) == ("closed", False)


def test_an_unplugged_camera_has_no_pictures(on_floor):
    simulation = on_floor()
    simulation.set_fault("camera", "unplugged")
    assert not any(simulation.step().picture_due for _ in range(20))


@pytest.mark.parametrize("what", FAULTS)
def test_every_fault_can_be_set_and_is_news_once(on_floor, what):
    simulation = on_floor(interfaces=["navigator"])
    for state in (*FAULTS[what][1:], FAULTS[what][0]):
        simulation.set_fault(what, state)
        simulation.set_fault(what, state)
        assert simulation.describe_moment()["faults"][what] == state
    assert len(simulation.describe_moment()["news"]) == min(len(FAULTS[what]), MAX_NEWS)


def test_what_cannot_be_is_answered_in_a_sentence(on_floor):
    simulation = on_floor()
    for action, sentence in (
        (lambda: simulation.set_fault("wheel", "jammed"), "Did you mean 'wheels'?"),
        (lambda: simulation.set_fault("navigator", "dead"), "Nothing called 'navigator' can fail"),
        (lambda: simulation.set_fault("wheels", "jamed"), "one of free, jammed. Did you mean"),
        (lambda: simulation.move_obstacle(3, 1.0, 1.0), "There is no obstacle 3: there are none."),
        (lambda: simulation.add_obstacle(1.0, 1.0, 9.0), "radius is 0.02 to 2 m, not 9."),
        (lambda: simulation.add_obstacle(math.nan, 1.0), "numbers of metres"),
    ):
        with pytest.raises(SessionError, match=sentence.replace("?", r"\?")):
            action()
    for _ in range(50):
        simulation.add_obstacle(1.0, 1.0)
    with pytest.raises(SessionError, match="50 obstacles"):
        simulation.add_obstacle(1.0, 1.0)


def test_an_obstacle_stays_on_the_floor(on_floor):
    simulation = on_floor()
    number = simulation.add_obstacle(-3.0, 99.0)
    assert simulation.describe_moment()["obstacles"] == [[number, 0.0, 10.0, 0.2]]


@pytest.mark.parametrize("name", plan_names())
def test_what_is_described_is_json_and_bounded(name):
    simulation = Simulation(load_floor_plan(name))
    tour(simulation, 3000)
    simulation.show_path([(0.01 * n, 1.0) for n in range(5000)] + [(math.nan, 0.0)])
    simulation.show_found([(1.0, 1.0)] * 5000)
    floor, moment = simulation.describe_floor(), simulation.describe_moment()
    assert floor["name"] == name
    names = [place["name"] for place in floor["stations"]]
    assert names.count("charger") == bool(simulation.plan.charger)
    assert len(json.dumps(moment, allow_nan=False)) < 20_000
    assert len(moment["beams"]) == 90
    assert len(moment["trail"]) <= 300
    assert len(moment["path"]) <= 200
    assert len(moment["news"]) <= 5
