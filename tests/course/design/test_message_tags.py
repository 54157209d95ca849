"""Dye: a tag goes into messages of any type that has room for it, and comes out again."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import (
    Bool,
    ByteMultiArray,
    Empty,
    Float32,
    Float32MultiArray,
    String,
    UInt8,
    UInt8MultiArray,
)
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci
from test_msgs.msg import Arrays, BoundedSequences, MultiNested, UnboundedSequences

from course.design import carry, message_tags

PACKAGES = ("std_msgs", "sensor_msgs", "geometry_msgs", "nav_msgs", "diagnostic_msgs", "test_msgs")


def message_types() -> Iterator[Any]:
    for package in PACKAGES:
        for cls in vars(importlib.import_module(f"{package}.msg")).values():
            if inspect.isclass(cls) and hasattr(cls, "get_fields_and_field_types"):
                yield cls


@pytest.mark.parametrize("tag", [message_tags.TAGS[0], message_tags.TAGS[-1], 8_388_609])
def test_every_installed_type_with_room_gives_back_what_it_was_marked_with(tag: int) -> None:
    marked = 0
    for msg_type in message_types():
        message = msg_type()
        assert message_tags.read_tag(message) is None, msg_type
        if message_tags.mark(message, tag):
            assert message_tags.read_tag(message) == tag, msg_type
            assert isinstance(message, msg_type)
            marked += 1
    assert marked >= 90


@pytest.mark.parametrize(
    "msg_type",
    [Arrays, BoundedSequences, ByteMultiArray, Float32MultiArray, Image, LaserScan, MultiNested,
     Path, Twist, UInt8MultiArray, UnboundedSequences, GetPlan.Request, Fibonacci.Goal,
     Fibonacci.Feedback, Trigger.Response],
    ids=lambda cls: cls.__name__,
)  # fmt: skip
def test_messages_requests_goals_and_feedback_have_room(msg_type: Any) -> None:
    assert message_tags.has_room(msg_type)


@pytest.mark.parametrize("msg_type", [Bool, Empty, UInt8, Trigger.Request])
def test_a_type_that_is_too_narrow_says_so_and_stays_as_it_was(msg_type: Any) -> None:
    message = msg_type()
    assert not message_tags.mark(message, message_tags.TAGS[0])
    assert message == msg_type()


def test_frame_ids_come_first_and_readings_stay_untouched() -> None:
    scan = LaserScan(ranges=[1.0, 2.0])
    message_tags.mark(scan, 2_000_000)
    assert scan.header.frame_id == "dye-2000000"
    assert list(scan.ranges) == [1.0, 2.0]
    image = Image(encoding="rgb8")
    message_tags.mark(image, 2_000_000)
    assert image.encoding == "rgb8"


@pytest.mark.parametrize(
    "message",
    [String(data="no dye-12 here"), Float32(data=float("nan")), Float32(data=float("inf")),
     Float32(data=2_000_000.5), Twist(), Float32(data=-2_000_000.0)],
)  # fmt: skip
def test_an_ordinary_reading_is_no_tag(message: Any) -> None:
    assert message_tags.read_tag(message) is None


def test_a_tag_survives_text_around_it() -> None:
    assert message_tags.read_tag(String(data="seen: dye-2000000 (left)")) == 2_000_000


def test_an_answer_carries_several_tags_and_carry_passes_all_of_them_on() -> None:
    path, command, distance = Path(), Twist(), Float32()
    assert message_tags.mark(path, 2_000_000, 3_000_000) == {2_000_000, 3_000_000}
    assert message_tags.read_all(path) == [2_000_000, 3_000_000]
    assert message_tags.read_tag(path) == 2_000_000
    assert carry(path, command)
    assert set(message_tags.read_all(command)) == {2_000_000, 3_000_000}
    assert message_tags.mark(distance, 2_000_000, 3_000_000) == {2_000_000}
    assert message_tags.read_all(distance) == [2_000_000]


def test_no_flood_of_tags_fits_into_a_text() -> None:
    flood = String(data=" ".join(f"dye-{tag}" for tag in range(2_000_000, 2_001_000)))
    assert len(message_tags.read_all(flood)) == 4


def test_the_time_of_a_reading_is_no_tag() -> None:
    scan = LaserScan()
    scan.header.stamp.nanosec = 2_000_000
    assert message_tags.read_tag(scan) is None
    assert message_tags.read_tag(Time(nanosec=2_000_000)) == 2_000_000


def test_carry_copies_a_tag_and_says_if_there_was_none() -> None:
    pose, command = PoseStamped(), Twist()
    assert not carry(pose, command)
    message_tags.mark(pose, 3_000_000)
    assert carry(pose, command)
    assert message_tags.read_tag(command) == 3_000_000
    assert not carry(pose, Bool())


def test_what_is_made_of_several_messages_carries_the_marks_of_each() -> None:
    plan, obstacles, command, pose = Path(), LaserScan(), Twist(), PoseStamped()
    message_tags.mark(plan, 2_000_000)
    message_tags.mark(obstacles, 3_000_000)
    for target in (command, pose):
        assert carry(plan, target)
        assert carry(obstacles, target)
        assert not carry(LaserScan(), target)
        assert message_tags.read_all(target) == [3_000_000, 2_000_000]


def test_where_there_is_room_for_few_marks_the_newest_stay() -> None:
    command = Twist()
    for tag in [*range(2_000_000, 2_000_020), 2_000_018]:
        message_tags.mark(scan := LaserScan(), tag)
        assert carry(scan, command)
    assert message_tags.read_all(command)[:3] == [2_000_018, 2_000_019, 2_000_017]


@pytest.mark.parametrize("tag", [0, 7, 2**24])
def test_only_tags_can_be_written(tag: int) -> None:
    with pytest.raises(ValueError, match="A tag is a number from"):
        message_tags.mark(Twist(), tag)


def test_fresh_tags_are_tags() -> None:
    assert all(message_tags.fresh_tag() in message_tags.TAGS for _ in range(100))
