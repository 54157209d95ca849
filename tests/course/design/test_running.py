"""A design comes up as real nodes that pass dye on, once each, along real links."""

from __future__ import annotations

from typing import Any

import pytest
from action_msgs.srv import CancelGoal
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, GetPlan
from rclpy.node import Node
from sensor_msgs.msg import Imu, LaserScan
from std_msgs.msg import String
from test_msgs.action import Fibonacci

import course
from course import Design, Session
from course.design import message_tags


def tags(recorder: course.Recorder) -> list[int | None]:
    return [message_tags.read_tag(entry.message) for entry in recorder.messages]


def marked(msg_type: Any, tag: int) -> Any:
    message = msg_type()
    message_tags.mark(message, tag)
    return message


def send(session: Session, recorder: course.Recorder, topic: str, tag: int) -> None:
    """Publish a tag once everybody is connected, and wait until it came out."""
    node = session.run(Node, f"source_{tag}")
    publisher = node.create_publisher(String, topic, 10)
    session.until(lambda: publisher.get_subscription_count(), what="a subscription")
    publisher.publish(marked(String, tag))
    session.until(lambda: tag in tags(recorder), what="the tag")


def test_a_tag_goes_from_topic_to_topic(any_session: Session) -> None:
    design = Design()
    design.node("a").subscribes("in", String).publishes("between", Twist)
    design.node("b").subscribes("between", Twist).publishes("out", PoseStamped)
    design.run(any_session)
    out = any_session.record("/out", PoseStamped)
    send(any_session, out, "in", 2_000_000)
    assert tags(out) == [2_000_000]


def test_a_cycle_passes_a_tag_once(any_session: Session) -> None:
    design = Design()
    design.node("a").subscribes("in", String).subscribes("back", String).publishes("on", String)
    design.node("b").subscribes("on", String).publishes("back", String).publishes("out", String)
    design.run(any_session)
    out, on = any_session.record("/out", String), any_session.record("/on", String)
    send(any_session, out, "in", 2_000_001)
    send(any_session, out, "in", 2_000_002)
    assert tags(out) == [2_000_001, 2_000_002]
    assert tags(on) == [2_000_001, 2_000_002]


def test_a_goal_goes_through_a_service_and_another_action(any_session: Session) -> None:
    design = Design()
    design.node("navigation").action_server("go", Fibonacci).calls("plan", GetPlan)
    design.node("planner").serves("plan", GetPlan).action_client("follow", Fibonacci)
    design.node("controller").action_server("follow", Fibonacci).publishes("motors", Twist)
    design.run(any_session)
    motors = any_session.record("/motors", Twist)
    sent = []

    def arrived() -> bool:  # a goal that finds a server not yet connected is not passed on
        sent.append(message_tags.fresh_tag())
        run = any_session.send_goal(Fibonacci, "go", marked(Fibonacci.Goal, sent[-1]))
        assert message_tags.read_tag(run.wait()) == sent[-1]
        return bool(set(sent) & set(tags(motors)))

    any_session.until(arrived, timeout=20, what="a goal at the motors")


def test_a_response_tells_what_else_the_server_knows(session: Session) -> None:
    design = Design()
    design.node("map").subscribes("in", String).serves("map", GetMap).publishes("read", String)
    design.run(session)
    read = session.record("/read", String)
    send(session, read, "in", 2_000_003)
    assert message_tags.read_tag(session.call(GetMap, "map", GetMap.Request())) == 2_000_003
    assert message_tags.read_tag(session.call(GetMap, "map", GetMap.Request())) is None


def test_a_response_bears_the_mark_of_the_question_too(session: Session) -> None:
    design = Design()
    design.node("map").subscribes("in", String).serves("plan", GetPlan).publishes("read", String)
    design.run(session)
    read = session.record("/read", String)
    send(session, read, "in", 2_000_005)
    answer = session.call(GetPlan, "plan", marked(GetPlan.Request, 2_000_006))
    assert message_tags.read_all(answer) == [2_000_005, 2_000_006]


def test_where_one_mark_fits_the_question_and_the_others_take_turns(session: Session) -> None:
    design = Design()
    design.node("stop").subscribes("in", String).serves("stop", CancelGoal).publishes(
        "read", String
    )
    design.run(session)
    read = session.record("/read", String)
    for tag in (2_000_010, 2_000_011):
        send(session, read, "in", tag)
    answers = [
        message_tags.read_tag(session.call(CancelGoal, "stop", marked(CancelGoal.Request, tag)))
        for tag in (2_000_020, 2_000_021, 2_000_022)
    ]
    assert answers == [2_000_010, 2_000_021, 2_000_011]


def test_a_type_without_room_ends_the_dye_and_nothing_else(session: Session) -> None:
    design = Design()
    design.node("a").subscribes("in", String).publishes("flag", "std_msgs/msg/Bool").publishes(
        "out", String
    )
    design.run(session)
    out = session.record("/out", String)
    send(session, out, "in", 2_000_004)
    assert session.errors == []


def test_maps_and_imus_come_unasked_from_a_node_that_reads_nothing(session: Session) -> None:
    design = Design()
    design.node("hardware").publishes("imu", Imu).publishes("motors", Twist)
    design.node("map_server").publishes("map", OccupancyGrid).serves("map", GetMap)
    design.node("slam").subscribes("scan", LaserScan).publishes("slam_map", OccupancyGrid)
    design.run(session)
    imu, grid = session.record("/imu", Imu), session.record("/map", OccupancyGrid)
    silent = [session.record("/motors", Twist), session.record("/slam_map", OccupancyGrid)]
    session.until(
        lambda: len(imu.messages) >= 2 and len(grid.messages) >= 2, what="a second map and reading"
    )
    assert {*tags(imu), *tags(grid)} == {None}
    assert not any(recorder.messages for recorder in silent)


def test_running_again_replaces_what_ran_before(session: Session) -> None:
    first = Design()
    first.node("old").publishes("scan", LaserScan)
    first.node("kept").subscribes("scan", LaserScan)
    first.run(session)
    second = Design()
    second.node("kept").subscribes("scan", LaserScan)
    second.node("new").publishes("scan", LaserScan)
    beside = session.run(Node, "beside")
    assert sorted(second.run(session)) == ["kept", "new"]
    second.run(session)
    assert sorted(session.nodes) == ["/beside", "/kept", "/new"]
    assert session.nodes["/beside"] is beside


def test_nodes_of_ones_own_run_in_place_of_the_librarys(session: Session) -> None:
    class Mine(Node):
        def __init__(self) -> None:
            super().__init__("mine")

    design = Design()
    design.node("mine", factory=Mine)
    assert isinstance(design.run(session)["mine"], Mine)


def test_a_node_that_does_not_come_up_can_be_mended_and_run_again(session: Session) -> None:
    def broken() -> Node:
        raise RuntimeError("no hardware")

    design = Design()
    design.node("first").publishes("scan", LaserScan)
    design.node("second", factory=broken)
    with pytest.raises(RuntimeError, match="no hardware"):
        design.run(session)
    mended = Design()
    mended.node("second").publishes("scan", LaserScan)
    mended.run(session)
    assert sorted(session.nodes) == ["/second"]


def test_it_runs_in_the_notebooks_own_session() -> None:
    design = Design()
    design.node("lidar").publishes("scan", LaserScan)
    try:
        design.run()
        assert list(course.session().nodes) == ["/lidar"]
    finally:
        course.close()
