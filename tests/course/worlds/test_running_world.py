"""The world as a node of a real session, on simulated and on wall time."""

from __future__ import annotations

import threading

import pytest
from geometry_msgs.msg import Point, Pose, PoseArray, PoseStamped, Twist
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from sensor_msgs.msg import BatteryState, Image, Imu, LaserScan
from std_msgs.msg import Bool, Empty, String
from std_srvs.srv import SetBool, Trigger

import course
from course.errors import SessionError, WaitTimeout
from course.runtime.waiting import Pulse, poll_condition
from course.worlds.floor_plan import FloorPlanError


class Driver(Node):
    """Repeats a command at 10 Hz."""

    def __init__(self, speed=0.5, turn=0.1):
        super().__init__("driver")
        self.command = Twist()
        self.command.linear.x, self.command.angular.z = speed, turn
        self.publisher = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_timer(0.1, lambda: self.publisher.publish(self.command))


@pytest.fixture
def lab():
    with course.Session(sim_time=True) as session:
        yield session


def seconds(stamped):
    message = stamped.message
    return message.header.stamp.sec + message.header.stamp.nanosec / 1e9


def robot_of(world):
    return world.describe_moment()["robot"]


def drive_around():
    """Return all scans and odometry of two seconds, as their messages print."""
    with course.Session(sim_time=True) as session:
        world = session.world("warehouse", seed=5).simulation
        scans, wheels = session.record("scan"), session.record("wheel/odometry")
        session.run(Driver)
        session.sim.advance(2.0)
        assert scans.count == 20
        assert wheels.count == 40
        return [
            repr(m.message) for m in (*scans.messages, *wheels.messages)
        ], world.describe_moment()


def test_two_runs_on_simulated_time_are_the_same():
    assert drive_around() == drive_around()


def test_cmd_vel_drives_it_and_sensors_come_at_their_rates(lab):
    world = lab.world().simulation
    kinds = {"scan": LaserScan, "imu/data": Imu, "wheel/odometry": Odometry,
             "battery_state": BatteryState, "camera/image": Image}  # fmt: skip
    heard = {topic: lab.record(topic, kind) for topic, kind in kinds.items()}
    lab.run(Driver, 0.5, 0.0)
    lab.sim.advance(2.0)
    assert {topic: recorder.count for topic, recorder in heard.items()} == {
        "scan": 20, "imu/data": 200, "wheel/odometry": 40, "battery_state": 2, "camera/image": 20,
    }  # fmt: skip
    assert [seconds(m) for m in heard["scan"].messages[:3]] == pytest.approx([0.1, 0.2, 0.3])
    last = heard["wheel/odometry"].messages[-1].message
    # The first command is there at 0.1 s, then comes the start: v² / 2a.
    assert last.pose.pose.position.x == pytest.approx(1.0 + 0.5**2 / 2 + 0.5 * 1.4)
    assert (last.header.frame_id, last.child_frame_id) == ("odom", "base_link")
    assert robot_of(world)["speed"] == 0.5
    scan, image = heard["scan"].messages[-1].message, heard["camera/image"].messages[-1].message
    assert (len(scan.ranges), scan.angle_min, scan.header.frame_id) == (360, 0.0, "base_link")
    assert (image.width, image.height, image.encoding) == (160, 120, "rgb8")
    assert heard["imu/data"].messages[0].message.orientation_covariance[0] == -1.0
    assert 0.99 < heard["battery_state"].messages[-1].message.percentage < 1.0


def test_it_is_an_ordinary_node_that_another_world_takes_the_place_of(lab):
    first = lab.world().simulation
    assert list(lab.nodes) == ["/warehouse"]
    assert {topic["name"]: topic["type"] for topic in first.topics}["/scan"] == (
        "sensor_msgs/msg/LaserScan"
    )
    assert not lab.diagnose()
    second = lab.world("corridor").simulation
    assert list(lab.nodes) == ["/corridor"]
    assert (first.closed, second.closed) == (True, False)
    with pytest.raises(SessionError, match="This world has ended"):
        first.press_stop()
    assert first.describe_moment()["robot"]["x"] == 1.0
    lab.stop()
    assert second.closed
    second.close()
    with pytest.raises(FloorPlanError, match="Did you mean 'corridor'"):
        lab.world("coridor")
    with pytest.raises(SessionError, match="seed is a whole number"):
        lab.world(seed=-1)


def test_it_ends_with_its_session():
    with course.Session() as session:
        world = session.world().simulation
        assert not world.closed
    assert world.closed
    with pytest.raises(SessionError, match="closed"):
        session.world()


def test_what_nodes_plan_and_find_is_shown_and_topics_say_what_they_carry(lab):
    world = lab.world().simulation
    path = Path(poses=[PoseStamped(pose=Pose(position=Point(x=1.0, y=2.0)))])
    lab.publish("plan", path)
    lab.publish("obstacles", PoseArray(poses=[Pose(position=Point(x=3.0, y=4.0))]))
    lab.sim.advance(0.1)
    moment = world.describe_moment()
    assert (moment["path"], moment["found"]) == ([[1.0, 2.0]], [[3.0, 4.0]])
    texts = {topic["name"]: topic["last"] for topic in world.topics}
    assert texts["/plan"] == "1 pose"
    assert texts["/scan"].startswith("ahead 7.")
    assert texts["/imu/data"].endswith("rad/s")
    assert texts["/camera/image"] == ""  # nobody has asked for a picture


def test_events_are_published_when_they_happen(lab):
    world = lab.world().simulation
    stops, bumps = lab.record("emergency/stop", String), lab.record("bumper", Bool)
    jams = lab.record("hardware/jammed", Bool)
    world.press_stop()
    world.press_stop()
    world.release_stop()
    world.set_fault("wheels", "jammed")
    world.reset()
    lab.until(lambda: stops.count == 3 and jams.count == 2)
    assert [m.message.data for m in stops.messages] == ["pressed", "pressed", "released"]
    assert [m.message.data for m in jams.messages] == [True, False]
    world.add_obstacle(1.5, 1.0)
    lab.run(Driver)
    lab.sim.advance(1.0)
    assert [m.message.data for m in bumps.messages] == [True]
    assert robot_of(world)["touching"]


@pytest.mark.parametrize("state", ["works", "slow", "dead", "refuses"])
def test_the_gripper_answers_as_its_fault_says(lab, state):
    world = lab.world().simulation
    world.set_fault("gripper", state)
    client = lab.run(Node, "client").create_client(SetBool, "gripper/set")
    lab.until(client.service_is_ready)
    future = client.call_async(SetBool.Request(data=True))
    lab.sim.advance(1.0)
    assert future.done() is (state in ("works", "refuses"))
    lab.sim.advance(1.0)
    assert future.done() is (state != "dead")
    assert (future.done() and future.result().success) is (state in ("works", "slow"))
    assert robot_of(world)["gripper"] == ("closed" if state in ("works", "slow") else "open")


def test_without_radio_nothing_comes_and_the_robot_stops(lab):
    world = lab.world().simulation
    scans, stops = lab.record("scan", LaserScan), lab.record("emergency/stop", String)
    lab.run(Driver)
    lab.sim.advance(1.0)
    world.set_fault("radio", "gone")
    world.press_stop()
    world.release_stop()
    before = scans.count
    lab.sim.advance(1.5)
    assert (scans.count, stops.count) == (before, 0)
    assert robot_of(world)["speed"] == 0.0
    world.set_fault("radio", "there")
    lab.sim.advance(1.0)
    assert scans.count == before + 10
    assert stops.count == 2
    assert robot_of(world)["speed"] > 0.0


def test_an_unplugged_camera_sends_nothing(lab):
    world = lab.world().simulation
    pictures = lab.record("camera/image", Image)
    world.set_fault("camera", "unplugged")
    lab.sim.advance(0.5)
    assert pictures.count == 0


def test_reset_is_a_service_and_stamps_go_on(lab):
    world = lab.world().simulation
    scans = lab.record("scan", LaserScan)
    lab.run(Driver)
    lab.sim.advance(1.0)
    assert robot_of(world)["x"] > 1.0
    assert lab.call(Trigger, "world/reset", Trigger.Request()).success
    assert (robot_of(world)["x"], world.time_s) == (1.0, 0.0)
    lab.sim.advance(0.2)
    assert [seconds(m) for m in scans.messages[-2:]] == pytest.approx([1.1, 1.2])


def test_a_world_that_is_made_later_begins_then(lab):
    lab.sim.advance(2.0)
    world = lab.world().simulation
    scans = lab.record("scan", LaserScan)
    lab.sim.advance(0.3)
    assert world.time_s == pytest.approx(0.3)
    assert [seconds(m) for m in scans.messages] == pytest.approx([2.1, 2.2, 2.3])


def test_a_paused_world_stands_still_while_the_clock_goes_on(lab):
    world = lab.world().simulation
    lab.sim.advance(0.5)
    world.pause()
    lab.sim.advance(1.0)
    assert (world.paused, world.time_s) == (True, 0.5)
    world.step_once()
    assert world.time_s == pytest.approx(0.6)
    world.resume()
    lab.sim.advance(0.5)
    assert world.time_s == pytest.approx(1.1)


def test_on_wall_time_a_callback_that_blocks_does_not_stop_it():
    with course.Session() as session:
        world = session.world().simulation
        blocked, free = threading.Event(), threading.Event()

        class Blocking(Node):
            def __init__(self):
                super().__init__("blocking")
                self.create_subscription(Empty, "block", self.block, 10)

            def block(self, _message):
                blocked.set()
                free.wait(30)

        session.run(Blocking)
        session.publish("block", Empty())
        try:
            assert blocked.wait(30)
            scans = session.record("scan", LaserScan)
            start = world.time_s
            session.until(lambda: scans.count >= 5, 30)
            assert world.time_s > start
            for _ in range(100):  # by hand, as an operator does
                world.drive(0.5, 0.0)
                if poll_condition(lambda: robot_of(world)["x"] > 1.05, 0.1, Pulse()):
                    break
            assert robot_of(world)["x"] > 1.05
        finally:
            free.set()


def test_nobody_hears_from_a_world_whose_node_is_paused(lab):
    lab.world()
    lab.pause("warehouse")
    lab.sim.advance(0.5)
    with pytest.raises(WaitTimeout):
        lab.next_message(LaserScan, "scan", timeout=0.2)


def test_there_is_one_for_the_notebooks_own_session():
    try:
        assert course.world("warehouse", seed=1).simulation.describe_floor()["name"] == "warehouse"
        assert "/warehouse" in course.session().nodes
    finally:
        course.close()
