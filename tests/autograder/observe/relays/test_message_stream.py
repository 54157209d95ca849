"""A stream keeps to its rate, and never outruns the node that takes it."""

from __future__ import annotations

import pytest
from rclpy.node import Node

from autograder.observe.relays.message_stream import AHEAD, MessageStream, hold_streams
from course import Session, WaitTimeout


def test_it_ends_at_its_limit(session: Session) -> None:
    sent: list[int] = []
    node = session.run(Node, "sender")
    stream = MessageStream(node, 100.0, sent.append, lambda: len(sent) - 1, limit=3)
    session.until(lambda: stream.sent == 3, timeout=5.0)
    with pytest.raises(WaitTimeout):
        session.until(lambda: len(sent) > 3, timeout=0.1)
    assert sent == [0, 1, 2]
    stream.stop()


def test_it_waits_for_the_node_that_takes_its_messages(session: Session) -> None:
    sent: list[int] = []
    newest = -1
    node = session.run(Node, "sender")
    stream = MessageStream(node, 200.0, sent.append, lambda: newest)
    session.until(lambda: len(sent) == AHEAD, timeout=5.0)
    with hold_streams([stream]):
        stream.slow_down()
        newest = AHEAD - 1
        with pytest.raises(WaitTimeout):
            session.until(lambda: len(sent) > AHEAD, timeout=0.1)
    session.until(lambda: len(sent) == AHEAD + 1, timeout=5.0)
    stream.stop()


def test_what_a_busy_machine_skipped_is_caught_up_with(session: Session) -> None:
    sent: list[int] = []
    node = Node("sender", context=session.context)  # which nobody spins
    stream = MessageStream(node, 50.0, sent.append, lambda: len(sent) - 1)
    stream.keep_rate()
    with pytest.raises(WaitTimeout):
        session.until(lambda: False, timeout=0.2)
    stream._send_due()
    assert len(sent) >= 10
    stream.stop()
    node.destroy_node()
