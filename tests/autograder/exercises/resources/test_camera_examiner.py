"""The examiner of a camera driver hears each picture once, whichever reliability is offered."""

from __future__ import annotations

from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image

from autograder.exercises.resources.camera_examiner import IMAGE, ExaminerNode
from autograder.observe.quiet_node import QuietNode
from course import Session

BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


def _picture(number: int, device: str = "front-1") -> Image:
    return Image(data=f"{device} {number} 1\n".encode())


def test_what_both_readers_hear_is_one_picture_and_the_list_only_grows() -> None:
    with Session() as session:
        node = session.run(ExaminerNode)
        driver = session.run(QuietNode, "driver")
        offers = driver.create_publisher(Image, IMAGE, BEST_EFFORT)
        keeps = driver.create_publisher(Image, IMAGE, 10)
        session.until(
            lambda: (
                (offers.get_subscription_count(), keeps.get_subscription_count()) == (1, 2)
                and node.count_publishers(IMAGE) == 2
            )
        )
        lists = []
        for number in range(20):
            (offers if number % 3 else keeps).publish(_picture(number))
            keeps.publish(_picture(number, "rear-1"))
            session.until(lambda least=number: len(node.pictures_of("front-1")) > least)  # type: ignore[misc]
            lists.append(node.pictures_of("front-1"))
        keeps.publish(_picture(20))
        session.until(lambda: len(node.pictures_of("front-1")) > 20)
        last = node.pictures_of("front-1")
        assert [picture.number for picture in last] == list(range(21))
        assert all(last[: len(earlier)] == earlier for earlier in lists)


def test_a_picture_that_is_sent_again_counts_again() -> None:
    with Session() as session:
        node = session.run(ExaminerNode)
        driver = session.run(QuietNode, "driver")
        pictures = driver.create_publisher(Image, IMAGE, 10)
        session.until(lambda: pictures.get_subscription_count() == 2)
        for _ in range(3):
            pictures.publish(_picture(7))
        pictures.publish(Image(data=b"noise"))
        session.until(lambda: len(node.pictures_of("front-1")) == 3 and node.count_strange() == 1)
        assert {picture.number for picture in node.pictures_of("front-1")} == {7}
