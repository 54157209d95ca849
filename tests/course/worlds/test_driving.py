"""How the robot drives, stops and uses energy: against closed forms."""

from __future__ import annotations

import math

import pytest

from course.worlds.floor_plan import ROBOT_RADIUS_M
from course.worlds.robot import base
from course.worlds.robot.base import STEP_S


def drive_for(simulation, seconds, speed, turn=0.0):
    """Hold a command for some seconds, as a node does that repeats it."""
    for _ in range(round(seconds / STEP_S)):
        simulation.drive(speed, turn)
        simulation.step()
    return simulation.robot


def let_pass(simulation, seconds):
    for _ in range(round(seconds / STEP_S)):
        simulation.step()
    return simulation.robot


def test_a_start_takes_v_by_a_seconds_and_v_squared_by_2a_metres(on_floor):
    robot = drive_for(on_floor(), 0.8, 0.8)
    assert robot.speed == pytest.approx(0.8)
    assert robot.x - 5.0 == pytest.approx(0.8**2 / (2 * base.ACCELERATION_MPS2))
    assert robot.acceleration == pytest.approx(base.ACCELERATION_MPS2)


def test_a_straight_drive_comes_as_far_as_speed_times_time(on_floor):
    robot = drive_for(on_floor(), 4.0, 0.5)
    assert robot.x - 5.0 == pytest.approx(0.5**2 / 2 + 0.5 * 3.5)
    assert (robot.y, robot.yaw) == (5.0, 0.0)
    assert (robot.wheel_x, robot.wheel_y, robot.wheel_yaw) == (robot.x, robot.y, robot.yaw)


def test_a_turn_on_the_spot_is_counter_clockwise_and_stays_on_the_spot(on_floor):
    robot = drive_for(on_floor(), 1.5, 0.0, 1.0)
    assert robot.yaw == pytest.approx(1.0 * 1.25 + 1.0**2 / (2 * base.TURN_ACCELERATION_RADPS2))
    assert (robot.x, robot.y) == (5.0, 5.0)


def test_an_arc_is_on_the_circle_of_radius_v_by_w(on_floor):
    simulation = on_floor()
    robot = drive_for(simulation, 2.0, 0.5, 0.5)  # up to speed
    middle = (robot.x - math.sin(robot.yaw), robot.y + math.cos(robot.yaw))  # 1 m to the left
    before = robot.yaw
    drive_for(simulation, 3.0, 0.5, 0.5)
    assert math.dist(middle, (robot.x, robot.y)) == pytest.approx(1.0)
    assert robot.yaw - before == pytest.approx(1.5)


def test_commands_are_cut_to_what_the_base_can_do(on_floor):
    robot = drive_for(on_floor(), 3.0, 9.0, -9.0)
    assert (robot.speed, robot.turn) == (base.MAX_SPEED_MPS, -base.MAX_TURN_RADPS)


def test_what_is_no_number_stops_the_robot(on_floor):
    simulation = on_floor()
    drive_for(simulation, 1.0, 0.5)
    robot = drive_for(simulation, 1.0, math.nan, math.inf)
    assert (robot.speed, robot.turn) == (0.0, 0.0)
    assert math.isfinite(robot.x)


def test_a_command_holds_for_half_a_second(on_floor):
    simulation = on_floor()
    drive_for(simulation, 1.0, 0.5)
    assert let_pass(simulation, 0.49).speed == 0.5
    assert let_pass(simulation, 0.51).speed == pytest.approx(0.0, abs=1e-9)


def test_the_emergency_stop_brakes_in_a_quarter_of_a_second_and_holds(on_floor):
    simulation = on_floor()
    drive_for(simulation, 2.0, 1.0)
    simulation.press_stop()
    start = simulation.robot.x
    assert drive_for(simulation, 0.25, 1.0).speed == 0.0
    assert simulation.robot.x - start == pytest.approx(1 / (2 * base.EMERGENCY_BRAKE_MPS2))
    assert drive_for(simulation, 1.0, 1.0).speed == 0.0
    simulation.release_stop()
    assert let_pass(simulation, 0.5).speed == 0.0
    assert drive_for(simulation, 1.0, 1.0).speed == pytest.approx(1.0)
    assert simulation.take_events() == [("emergency", "pressed"), ("emergency", "released")]


def test_the_bumper_stops_it_at_the_shelf(on_floor):
    simulation = on_floor(shelves=[[7.0, 4.0, 1.0, 2.0]])
    robot = drive_for(simulation, 5.0, 1.0)
    assert robot.x == pytest.approx(7.0 - ROBOT_RADIUS_M, abs=1e-5)
    assert robot.x <= 7.0 - ROBOT_RADIUS_M
    assert robot.wheel_x == robot.x
    assert robot.touching
    assert robot.speed == 0.0
    assert simulation.describe_moment()["news"] == ["The robot touched a shelf at 2.3 s."]
    drive_for(simulation, 1.0, -1.0)
    assert not robot.touching
    assert simulation.take_events() == [("bumper", True), ("bumper", False)]


@pytest.mark.parametrize("heading", [0.3, 2.2, 4.0])
def test_it_never_passes_through_anything(on_floor, heading):
    walls = [[8.0, 2.0, 8.0, 8.0], [2.0, 8.0, 8.0, 8.0], [2.0, 2.0, 2.0, 8.0], [2.0, 2.0, 8.0, 2.0]]
    simulation = on_floor(walls=walls, start={"x": 5.0, "y": 5.0, "yaw": heading})
    simulation.add_obstacle(6.0, 6.0, 0.5)
    for turn in (0.0, 0.7, -1.5, 0.1):
        robot = drive_for(simulation, 4.0, 1.0, turn)
        assert simulation.floor.clearance(robot.x, robot.y) >= ROBOT_RADIUS_M - 1e-9
        assert 2.0 < robot.x < 8.0
        assert 2.0 < robot.y < 8.0


def test_it_gets_away_from_an_obstacle_that_was_put_upon_it(on_floor):
    simulation = on_floor()
    simulation.add_obstacle(5.1, 5.0, 0.3)
    assert drive_for(simulation, 1.0, 0.5).x == 5.0
    assert drive_for(simulation, 2.0, -0.5).x < 4.5


def test_jammed_wheels_do_not_move_and_do_not_count(on_floor):
    simulation = on_floor()
    drive_for(simulation, 1.0, 0.5)
    simulation.set_fault("wheels", "jammed")
    before = simulation.robot.x
    robot = drive_for(simulation, 1.0, 0.5, 1.0)
    assert (robot.x, robot.wheel_x, robot.speed, robot.turn) == (before, before, 0.0, 0.0)
    simulation.set_fault("wheels", "free")
    assert drive_for(simulation, 1.0, 0.5).x > before
    assert simulation.take_events() == [("jammed", True), ("jammed", False)]


def test_slip_is_what_the_wheels_do_not_know(on_floor):
    robot = drive_for(on_floor(slip=0.1), 3.0, 0.5)
    assert robot.x - 5.0 == pytest.approx(0.9 * (robot.wheel_x - 5.0))


def test_the_battery_gives_idle_power_and_power_with_speed(on_floor):
    simulation = on_floor()
    drive_for(simulation, 10.0, 0.5, 0.5)
    metres, radians = 0.5 * 10 - 0.5**2 / 2, 0.5 * 10 - 0.5**2 / 8
    energy_j = (
        base.IDLE_POWER_W * 10
        + base.DRIVE_POWER_W_PER_MPS * metres
        + base.TURN_POWER_W_PER_RADPS * radians
    )
    assert simulation.robot.charge == pytest.approx(1 - energy_j / base.CAPACITY_J)


def test_an_empty_battery_moves_nothing_and_the_charger_fills_it(on_floor):
    simulation = on_floor(charger={"x": 5.1, "y": 5.0})
    simulation.robot.charge = 0.0
    robot = let_pass(simulation, 1.0)
    gained_j = base.CHARGE_POWER_W - base.IDLE_POWER_W
    assert robot.charging
    assert robot.charge == pytest.approx(gained_j / base.CAPACITY_J)
    empty = on_floor()
    empty.robot.charge = 0.0
    assert drive_for(empty, 1.0, 0.5).x == 5.0


def test_a_low_battery_has_a_tenth_left_and_a_normal_one_is_new(on_floor):
    simulation = on_floor()
    simulation.set_fault("battery", "low")
    assert simulation.robot.charge == base.LOW_CHARGE
    simulation.set_fault("battery", "normal")
    assert simulation.robot.charge == 1.0


def test_a_speed_that_holds_ends_with_the_next_command(on_floor):
    simulation = on_floor()
    simulation.drive_on(0.5)
    let_pass(simulation, 3.0)
    assert simulation.robot.speed == 0.5
    simulation.drive(0.2, 0.0)
    let_pass(simulation, 0.4)
    assert simulation.robot.speed == pytest.approx(0.2)
    let_pass(simulation, 1.0)
    assert simulation.robot.speed == 0.0
    for speed in (0.0, math.nan):
        simulation.drive_on(0.5)
        simulation.drive_on(speed)
        let_pass(simulation, 1.0)
        assert simulation.robot.speed == 0.0


def test_a_speed_does_not_hold_beyond_the_emergency_stop(on_floor):
    simulation = on_floor()
    simulation.drive_on(0.5)
    simulation.press_stop()
    let_pass(simulation, 0.5)
    simulation.drive_on(0.5)
    simulation.release_stop()
    let_pass(simulation, 1.0)
    assert simulation.robot.speed == 0.0


def test_limits_hold_for_later_commands_and_nonsense_is_no_limit(on_floor):
    simulation = on_floor()
    simulation.limit_speeds(0.3, 0.5)
    simulation.limit_speeds(math.nan, 1.0)
    simulation.limit_speeds(0.8, -1.0)
    simulation.drive(1.0, -2.0)
    let_pass(simulation, 0.4)
    assert (simulation.robot.speed, simulation.robot.turn) == (0.3, -0.5)
    assert simulation.describe_moment()["news"] == [
        "The speed limits became 0.3 m/s and 0.5 rad/s at 0.0 s."
    ]
    simulation.limit_speeds(9.0, 9.0)
    simulation.drive(9.0, 0.0)
    let_pass(simulation, 0.4)
    simulation.drive(9.0, 0.0)
    let_pass(simulation, 0.4)
    assert simulation.robot.speed == 1.0
