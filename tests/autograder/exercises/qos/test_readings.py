"""A reading is known again by what is left of it, and altered if anything differs."""

from __future__ import annotations

import math

import pytest
from std_msgs.msg import String

from autograder.exercises.qos.readings import CAMERA, IMU, LIDAR, SENSORS, STOP, Sensor
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.examiner.spinner import Spinner
from autograder.observe.relays.endpoint_qos import lossless_profile
from autograder.observe.relays.marked_messages import Mark
from autograder.observe.relays.relay_path import RelayPath
from course import Session

RUN = 8_000_000


@pytest.mark.parametrize("sensor", SENSORS, ids=lambda sensor: sensor.name)
def test_a_reading_is_known_as_it_went_out_and_altered_if_anything_differs(
    session: Session, spinner: Spinner, sensor: Sensor
) -> None:
    node = QuietNode("examiner", session.context)
    path = RelayPath(node, sensor, RUN)
    spinner.add_node(node)
    change = False

    def relay(message: object) -> None:
        if change:
            _alter(sensor, message)
        out.publish(message)

    driver = session.run(QuietNode, "driver")
    out = driver.create_publisher(sensor.type, sensor.topic, lossless_profile())
    driver.create_subscription(sensor.type, sensor.source, relay, lossless_profile())
    spinner.until(
        lambda: path.source.get_subscription_count() and out.get_subscription_count(), 5.0, "a link"
    )
    for number in range(5):
        path.send("as it is", number)
    spinner.until(lambda: len(path.published) == 5, 5.0, "five readings")
    assert path.published.numbers("as it is") == list(range(5))
    assert not path.altered
    assert not path.foreign
    change = True
    path.send("altered", 0)
    spinner.until(lambda: path.altered | path.foreign, 5.0, "an altered one")
    assert (path.foreign if sensor is STOP else path.altered) == {sensor.topic}


def _alter(sensor: Sensor, message: object) -> None:
    match message:
        case String():
            message.data = "stop"
        case _ if sensor is CAMERA:
            message.encoding = "8UC1"  # type: ignore[attr-defined]
        case _ if sensor is LIDAR:
            message.range_max = 10.0  # type: ignore[attr-defined]
        case _ if sensor is IMU:
            message.orientation_covariance[0] = -1.0  # type: ignore[attr-defined]


@pytest.mark.parametrize("sensor", SENSORS, ids=str)
def test_a_mark_stands_in_each_place(sensor: Sensor) -> None:
    mark = Mark.draw(RUN)
    message = sensor.make_message(mark, 1_500_000_000, 0)
    assert set(sensor.find_marks(message)) == {mark}
    if sensor is not STOP:
        message.header.frame_id = "base_link"
        assert mark in sensor.find_marks(message)


def test_every_other_scan_has_beams_without_an_echo_and_is_the_same_as_itself() -> None:
    closed, opened = (LIDAR.make_message(Mark(1, 2, 3), 0, number) for number in (0, 1))
    assert all(map(math.isfinite, closed.ranges))
    assert not all(map(math.isfinite, opened.ranges))
    assert LIDAR.is_same(opened, LIDAR.make_message(Mark(1, 2, 3), 5, 1))
    assert not LIDAR.is_same(opened, closed)
