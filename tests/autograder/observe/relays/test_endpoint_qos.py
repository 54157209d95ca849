"""What others offer and request on a topic is read from the graph; our own endpoints are not it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32, String

from autograder.observe import Topic
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.relays.endpoint_qos import TopicEnds, describe_missing, lossless_profile
from course import Session

BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
EXPIRING = QoSProfile(depth=1, lifespan=Duration(seconds=2))
DURABLE = lossless_profile(DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def examiner(session: Session) -> Node:
    return session.run(QuietNode, "examiner")


@pytest.fixture
def student(session: Session) -> Iterator[Node]:
    with Session(domain_id=session.domain_id) as other:
        yield other.run(Node, "student")


def ends_of(session: Session, examiner: Node, publishers: int, subscriptions: int) -> TopicEnds:
    def found() -> TopicEnds | None:
        ends = TopicEnds(examiner, "words")
        there = len(ends.publishers), len(ends.subscriptions)
        return ends if there == (publishers, subscriptions) else None

    ends = session.until(found, timeout=10.0)
    assert ends is not None
    return ends


def test_of_several_offers_the_one_counts_that_most_can_hear(
    session: Session, examiner: Node, student: Node
) -> None:
    examiner.create_publisher(String, "words", 10)
    student.create_publisher(String, "words", BEST_EFFORT)
    student.create_publisher(String, "words", DURABLE)
    ends = ends_of(session, examiner, 2, 0)
    assert not ends.is_offered_reliably
    assert ends.is_offered_durably
    assert ends.matching_request.reliability == ReliabilityPolicy.BEST_EFFORT
    offer = ends.strongest_offer
    assert (offer.reliability, offer.durability) == (DURABLE.reliability, DURABLE.durability)


def test_ends_are_refused_only_if_dds_connects_none_of_them(
    session: Session, examiner: Node, student: Node
) -> None:
    student.create_publisher(String, "words", BEST_EFFORT)
    assert not ends_of(session, examiner, 1, 0).refusals
    student.create_subscription(String, "words", print, lossless_profile())
    (refusal,) = ends_of(session, examiner, 1, 1).refusals
    assert refusal.requested == "RELIABLE"
    student.create_subscription(String, "words", print, BEST_EFFORT)
    assert not ends_of(session, examiner, 1, 2).refusals


def test_a_lifespan_at_either_end_lets_messages_expire(
    session: Session, examiner: Node, student: Node
) -> None:
    student.create_publisher(String, "words", 10)
    assert not ends_of(session, examiner, 1, 0).can_expire
    student.create_subscription(String, "words", print, EXPIRING)
    assert ends_of(session, examiner, 1, 1).can_expire


def test_what_is_missing_or_of_another_type_is_told(
    session: Session, examiner: Node, student: Node
) -> None:
    words, numbers = Topic("words", String), Topic("numbers", Int32)
    student.create_publisher(String, "numbers", 10)
    student.create_publisher(String, "words", 10)
    session.until(lambda: TopicEnds(examiner, "words").publishers, timeout=10.0)
    assert describe_missing(examiner, publishes=[words, numbers], subscribes=[words]) == [
        "The publisher on numbers has type std_msgs/msg/String, not std_msgs/msg/Int32.",
        "There is no subscription to words.",
    ]
