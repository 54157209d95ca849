"""An examiner's nodes are spun for little, and what one callback raises ends nothing."""

from __future__ import annotations

import pytest
from std_msgs.msg import String

from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.examiner.spinner import MOST_AT_ONCE, Spinner
from autograder.observe.relays.endpoint_qos import lossless_profile
from course import Session, WaitTimeout

MANY = 3 * MOST_AT_ONCE


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
