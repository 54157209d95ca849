"""Which number of a goal's feedback tells how far it has come."""

from __future__ import annotations

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Path
from sensor_msgs.msg import BatteryState
from std_msgs.msg import Empty, Header, String
from test_msgs.action import Fibonacci
from test_msgs.msg import Builtins

from course.watch.goal_progress import measure_progress


def test_a_field_that_says_so_comes_before_any_other_number() -> None:
    assert measure_progress(BatteryState(voltage=12.0, percentage=0.5)) == ("percentage", 0.5)


def test_else_it_is_the_first_number_of_a_message_and_of_what_it_holds() -> None:
    twist = Twist()
    twist.linear.x = 0.3
    assert measure_progress(twist) == ("linear.x", 0.3)


def test_a_list_counts_its_values_and_a_stamp_is_no_progress() -> None:
    assert measure_progress(Fibonacci.Feedback(sequence=[0, 1])) == (
        "sequence (number of values)",
        2.0,
    )
    path = Path(header=Header(frame_id="map"), poses=[PoseStamped()] * 3)
    assert measure_progress(path) == ("poses (number of values)", 3.0)


def test_words_alone_tell_nothing() -> None:
    assert measure_progress(String(data="on my way")) is None
    assert measure_progress(Empty()) is None


def test_a_duration_is_in_seconds() -> None:
    message = Builtins(duration_value=Duration(sec=2, nanosec=500_000_000))
    assert measure_progress(message) == ("duration_value (s)", 2.5)
