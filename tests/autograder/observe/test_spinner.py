"""An examiner's nodes are spun for little, and what one callback raises ends nothing."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from std_msgs.msg import String

from autograder.exercises.qos.readings import CAMERA, IMU, LIDAR, SENSORS, STOP, Sensor
from autograder.exercises.qos.sensor_examiner import ExaminerNode, lossless_profile
from autograder.observe.quiet_node import QuietNode
from autograder.observe.spinner import MOST_AT_ONCE, Spinner
from course import Session, WaitTimeout

MANY = 3 * MOST_AT_ONCE


@pytest.fixture
def session() -> Iterator[Session]:
    with Session() as session:
        yield session


@pytest.fixture
def spinner(session: Session) -> Iterator[Spinner]:
    spinner = Spinner(session.context)
    yield spinner
    spinner.close()


def test_messages_come_in_order_whatever_a_callback_raises(
    session: Session, spinner: Spinner, capfd: pytest.CaptureFixture[str]
) -> None:
    heard: list[str] = []

    def hear(message: String) -> None:
        heard.append(message.data)
        if message.data == "1":
            raise ZeroDivisionError

    node = QuietNode("ear", session.context)
    spinner.add_node(node)
    node.create_subscription(String, "words", hear, lossless_profile())
    words = node.create_publisher(String, "words", lossless_profile())
    spinner.until(words.get_subscription_count, 5.0, "a listener")
    for number in range(MANY):
        words.publish(String(data=str(number)))
    spinner.until(lambda: len(heard) == MANY, 5.0, "all of them")
    assert heard == [str(number) for number in range(MANY)]
    assert "ZeroDivisionError" in capfd.readouterr().err


@pytest.mark.parametrize("often", [True, False])
def test_a_wait_ends_with_what_it_is_for_or_in_time(
    session: Session, spinner: Spinner, often: bool
) -> None:
    ticks: list[int] = []
    node = QuietNode("clock", session.context)
    spinner.add_node(node)
    timer = node.create_timer(0.01, lambda: ticks.append(0))
    assert spinner.until(lambda: len(ticks) > 2, 5.0, "ticks", often=often)
    timer.cancel()
    with pytest.raises(WaitTimeout, match="in vain for one more"):
        spinner.until(lambda: None, 0.1, "one more", often=often)


def test_its_nodes_end_with_it(session: Session) -> None:
    spinner = Spinner(session.context)
    spinner.add_node(QuietNode("guest", session.context))
    assert "guest" in [name for name, _ in session.observer.get_node_names_and_namespaces()]
    spinner.close()
    session.until(
        lambda: "guest" not in [n for n, _ in session.observer.get_node_names_and_namespaces()]
    )


@pytest.mark.parametrize("sensor", SENSORS, ids=lambda sensor: sensor.name)
def test_a_reading_is_known_as_it_went_out_and_altered_if_anything_differs(
    session: Session, spinner: Spinner, sensor: Sensor
) -> None:
    node = ExaminerNode(session.context)
    spinner.add_node(node)
    change = False

    def relay(message: object) -> None:
        if change:
            _alter(sensor, message)
        out.publish(message)

    driver = session.run(QuietNode, "driver")
    out = driver.create_publisher(sensor.type, sensor.topic, lossless_profile())
    driver.create_subscription(sensor.type, f"hardware/{sensor.name}", relay, lossless_profile())
    hardware = node.hardware[sensor.name]
    spinner.until(
        lambda: hardware.get_subscription_count() and out.get_subscription_count(), 5.0, "a link"
    )
    for number in range(5):
        node.publish(sensor, "as it is", number)
    spinner.until(lambda: len(node.witnessed[sensor.name]) == 5, 5.0, "five readings")
    assert [tag.number for tag in node.witnessed[sensor.name]] == list(range(5))
    assert not node.altered
    assert not node.foreign
    change = True
    node.publish(sensor, "altered", 0)
    spinner.until(lambda: node.altered | node.foreign, 5.0, "an altered one")
    assert (node.foreign if sensor is STOP else node.altered) == {sensor.topic}


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
