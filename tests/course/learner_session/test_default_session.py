"""The process's own session: `course.run(...)` and plain rclpy on the same context."""

from __future__ import annotations

import pytest
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import SetBool

import course
from course.errors import SessionError


@pytest.fixture(autouse=True)
def closed_afterwards():
    yield
    course.close()


class Talker(Node):
    """Publishes and serves."""

    def __init__(self):
        super().__init__("talker")
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.create_timer(0.01, lambda: self.publisher.publish(String(data="hello")))
        self.create_service(SetBool, "mode", lambda request, response: response)


def test_the_functions_act_on_one_session():
    talker = course.run(Talker)
    assert course.session().nodes == {"/talker": talker}
    assert course.next_message(String, "chatter").data == "hello"
    assert course.record("chatter").wait(2)
    course.wait_for_service(SetBool, "mode")
    assert course.call(SetBool, "mode", SetBool.Request()).success is False
    talker.get_logger().info("a word")
    assert course.until(lambda: course.logs("talker").messages) == ["a word"]
    course.pause(talker)
    course.resume(talker)
    course.stop("talker")
    assert course.session().nodes == {}
    assert course.close()


def test_it_is_made_at_first_use_and_again_after_close():
    first = course.session()
    assert course.session() is first
    course.close()
    second = course.session()
    assert second is not first
    assert (first.closed, second.closed) == (True, False)


def test_options_must_agree_with_the_session_that_is_open():
    opened = course.session(threads=2)
    assert course.session(threads=2) is course.session() is opened
    with pytest.raises(SessionError, match=r"open with threads=2, not 4: .*course\.close\(\)"):
        course.session(threads=4)


def test_stop_and_close_without_a_session_make_none():
    course.stop()
    assert course.close()


def test_plain_rclpy_acts_on_it():
    session = course.session()
    assert rclpy.ok()
    node = rclpy.create_node("plain")
    assert node.context is session.context
    course.run(node)
    assert list(session.nodes) == ["/plain"]
    course.close()
    assert not rclpy.ok()


def test_a_node_stolen_by_rclpy_spin_once_is_given_back():
    talker = course.run(Talker)
    rclpy.spin_once(talker)
    assert course.next_message(String, "chatter").data == "hello"
    assert len(course.session().notices) == 1


def test_rclpy_shutdown_ends_it_and_the_next_use_makes_another():
    first = course.session()
    course.run(Talker)
    rclpy.shutdown()
    assert first.closed
    talker = course.run(Talker)
    assert course.session() is not first
    assert course.session().nodes == {"/talker": talker}


def test_a_learner_who_called_rclpy_init_keeps_their_context():
    rclpy.init(args=["--ros-args", "--disable-stdout-logs"])
    try:
        mine = Node("mine")
        talker = course.run(Talker)
        assert talker.context is not mine.context
        assert Node("also_mine").context is mine.context
        course.close()
        assert rclpy.ok()
    finally:
        rclpy.shutdown()


def test_public_names_are_there_and_listed():
    for name in dir(course):
        assert getattr(course, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'sessions'"):
        _ = course.sessions
