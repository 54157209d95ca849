"""What a floor plan has the robot offer beside its usual topics, on simulated time."""

from __future__ import annotations

import pytest
from geometry_msgs.msg import Twist
from rclpy.node import Node
from std_msgs.msg import Bool, Float64
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

import course
from course.errors import WaitTimeout
from course.worlds.floor_plan import load_floor_plan, plan_names
from course.worlds.robot.base import STEP_S


@pytest.fixture
def lab():
    with course.Session(sim_time=True) as session:
        yield session


@pytest.fixture
def corridor(lab):
    return lab.world("corridor").simulation


def robot_of(world):
    return world.describe_moment()["robot"]


def last(recorder):
    return recorder.messages[-1].message.data


def send(lab, metres):
    """Send a goal; return its feedback so far (a list that grows) and its run."""
    told = []
    run = lab.send_goal(
        Fibonacci, "navigate", Fibonacci.Goal(order=metres),
        on_feedback=lambda feedback: told.append(list(feedback.sequence)),
    )  # fmt: skip
    return told, run


def test_a_line_tells_and_takes_plain_numbers(lab):
    world = lab.world("aisle").simulation
    places, levels = lab.record("hardware/position", Float64), lab.record("hardware/charge")
    lab.sim.advance(1.0)
    assert (last(places), places.count, levels.count) == (0.0, 20, 1)
    lab.publish("hardware/speed", Float64(data=0.5))
    lab.sim.advance(3.0)
    # It holds: v² / 2a for the start, then v times the rest; it may be there a step later.
    assert last(places) == pytest.approx(0.125 + 0.5 * 2.5, abs=0.5 * STEP_S + 1e-6)
    world.add_obstacle(1.2 + last(places) + 0.6, 2.2)
    lab.sim.advance(2.0)
    assert robot_of(world)["touching"]
    ((number, *_),) = world.describe_moment()["obstacles"]
    world.remove_obstacle(number)
    before = last(places)
    lab.sim.advance(2.0)
    assert last(places) > before + 0.5
    lab.publish("hardware/speed", Float64(data=0.0))
    lab.sim.advance(1.0)
    assert robot_of(world)["speed"] == 0.0
    world.set_fault("battery", "low")
    lab.sim.advance(1.0)
    assert last(levels) == pytest.approx(0.1, abs=0.001)


def test_only_a_plan_that_says_so_has_more_than_the_usual(lab):
    assert [name for name in plan_names() if load_floor_plan(name).interfaces] == [
        "aisle", "corridor",
    ]  # fmt: skip
    names = {topic["name"] for topic in lab.world("warehouse").simulation.topics}
    assert not names & {"/hardware/position", "/wheels/limits"}


def test_speed_limits_are_heard(lab, corridor):
    limits = Twist()
    limits.linear.x, limits.angular.z = 0.3, 1.0
    lab.publish("wheels/limits", limits)
    lab.sim.advance(0.1)
    corridor.drive(1.0, 0.0)
    lab.sim.advance(0.4)
    assert robot_of(corridor)["speed"] == 0.3
    assert "0.3 m/s" in corridor.describe_moment()["news"][0]


def test_who_comes_after_a_jam_hears_of_it_as_well(lab, corridor):
    corridor.set_fault("wheels", "jammed")
    jams = lab.record("hardware/jammed", Bool, qos=10)
    lab.sim.advance(2.0)
    assert [stamped.message.data for stamped in jams.messages][-2:] == [True, True]


def test_the_navigator_drives_and_tells_each_metre(lab, corridor):
    told, run = send(lab, 3)
    assert run.accepted
    lab.sim.advance(5.0)
    assert list(run.wait(5.0).sequence) == [1, 2, 3]
    assert run.status.name == "SUCCEEDED"
    assert [marks for marks in told if marks] == [[1], [1, 2], [1, 2, 3]]
    lab.sim.advance(2.0)
    assert robot_of(corridor)["x"] == pytest.approx(1.0 + 3.0 + 0.5, abs=0.05)  # and its braking
    assert robot_of(corridor)["speed"] == 0.0


@pytest.mark.parametrize(
    ("fault", "end"), [("rejects", ""), ("aborts", "ABORTED"), ("stalls", "CANCELED")]
)
def test_the_navigator_fails_as_its_fault_says(lab, corridor, fault, end):
    corridor.set_fault("navigator", fault)
    told, run = send(lab, 3)
    assert run.accepted is (fault != "rejects")
    lab.sim.advance(2.5)
    assert told == ([[], [1]] if fault == "aborts" else [])
    if fault == "stalls":
        assert robot_of(corridor)["speed"] == 0.0
        assert run.cancel()
    lab.sim.advance(1.0)
    if end:
        run.wait(5.0)
        assert run.status.name == end
    assert robot_of(corridor)["speed"] == 0.0


def test_a_runaway_refuses_to_be_canceled_and_a_command_stops_it(lab, corridor):
    told, run = send(lab, 3)
    lab.sim.advance(2.0)
    corridor.set_fault("navigator", "runaway")
    before = len(told)
    lab.sim.advance(3.0)
    assert not run.cancel()
    assert (len(told), robot_of(corridor)["speed"]) == (before, 1.0)
    lab.publish("cmd_vel", Twist())
    lab.sim.advance(1.5)
    assert robot_of(corridor)["speed"] == 0.0


def test_a_dead_navigator_answers_nothing_and_knows_of_no_goal_afterwards(lab, corridor):
    _, run = send(lab, 8)
    lab.sim.advance(2.0)
    corridor.set_fault("navigator", "dead")
    lab.sim.advance(2.0)
    assert robot_of(corridor)["speed"] == 0.0
    with pytest.raises(WaitTimeout):
        lab.send_goal(Fibonacci, "navigate", Fibonacci.Goal(order=1), timeout=0.3)
    assert not [found for found in lab.diagnose() if "navigate" in found.message.lower()]
    corridor.set_fault("navigator", "works")
    lab.sim.advance(0.2)
    run.wait(5.0)
    assert run.status.name == "ABORTED"
    _, run = send(lab, 1)
    lab.sim.advance(2.0)
    run.wait(5.0)
    assert run.status.name == "SUCCEEDED"


@pytest.mark.parametrize("what", ["jam", "obstacle", "reset"])
def test_a_drive_that_cannot_go_on_is_aborted(lab, corridor, what):
    _, run = send(lab, 6)
    lab.sim.advance(1.0)
    if what == "jam":
        corridor.set_fault("wheels", "jammed")
    elif what == "reset":
        corridor.reset()
    else:
        corridor.add_obstacle(2.5, 3.0)
    lab.sim.advance(8.0 if what == "obstacle" else 0.5)
    run.wait(5.0)
    assert run.status.name == "ABORTED"
    assert robot_of(corridor)["speed"] == 0.0


def test_a_new_goal_takes_the_place_of_the_one_before(lab, corridor):
    _, first = send(lab, 6)
    lab.sim.advance(1.0)
    _, second = send(lab, 1)
    lab.sim.advance(2.5)
    first.wait(5.0)
    second.wait(5.0)
    assert (first.status.name, second.status.name) == ("ABORTED", "SUCCEEDED")


def test_calls_of_a_dead_gripper_hold_up_nobody(lab, corridor):
    corridor.set_fault("gripper", "dead")
    client = lab.run(Node, "client").create_client(SetBool, "gripper/set")
    lab.until(client.service_is_ready)
    waiting = [client.call_async(SetBool.Request(data=True)) for _ in range(3)]
    lab.sim.advance(2.0)
    assert not any(future.done() for future in waiting)
    assert lab.blocked_callbacks(0.0) == []
    corridor.set_fault("gripper", "works")
    answered = client.call_async(SetBool.Request(data=True))
    lab.sim.advance(0.5)
    assert answered.result().success
    assert corridor.time_s == pytest.approx(2.5)
