"""Who joins late is handed the past by a publisher that keeps it, and hears no more afterwards."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, cast

import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

from autograder.observe import Topic
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.relays.endpoint_qos import lossless_profile
from autograder.observe.relays.late_joiner import hear_past
from autograder.observe.relays.observed_process import ObservedProcess
from course import Session, WaitTimeout

WORDS = Topic("words", String, value=lambda message: message.data or None)


class Watched:
    """A process with one node, as far as a late joiner looks at it."""

    def __init__(self, session: Session, student: Node) -> None:
        """Look at it from a session."""
        self._session, self._student = session, student
        self.subject = self

    def wait(self, condition: Callable[[], Any], timeout_s: float = 5.0) -> bool:
        """Return whether it holds in time."""
        with suppress(WaitTimeout):
            self._session.until(condition, timeout=timeout_s)
            return True
        return False

    def wait_for_rest(self) -> None:
        """Return."""

    def sees(self, name: str, endpoints: Mapping[str, Sequence[str]]) -> dict[str, dict[str, int]]:
        """Return how many subscriptions the student's node knows of."""
        counts = {
            topic: self._student.count_subscribers(topic) for topic in endpoints["subscribers"]
        }
        return {"subscribers": counts}


@pytest.mark.parametrize(
    ("offered", "asking", "refused"),
    [
        (lossless_profile(), [], True),
        (lossless_profile(DurabilityPolicy.TRANSIENT_LOCAL), ["old"], False),
    ],
)
def test_the_past_is_for_who_asks_for_it(
    offered: QoSProfile, asking: list[str], refused: bool
) -> None:
    with Session() as session, Session(domain_id=session.domain_id) as other:
        examiner, student = session.run(QuietNode, "examiner"), other.run(Node, "student")
        publisher = student.create_publisher(String, "words", offered)
        for word in ("old", ""):
            publisher.publish(String(data=word))
        before = list(examiner.subscriptions)
        process = cast(ObservedProcess, Watched(session, student))
        (past,) = hear_past(process, examiner, "Student", [WORDS])
        assert (past.asking, past.plain) == (asking, [])
        assert bool(past.refusals) is refused
        assert list(examiner.subscriptions) == before
