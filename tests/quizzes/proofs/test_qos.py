"""Proofs: which QoS profiles match, and what each policy does to delivery."""

from __future__ import annotations

import pytest
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSCompatibility,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from std_msgs.msg import String

import course

RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
VOLATILE, LOCAL = DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL
WRONG_POLICY = {
    "reliability": QoSPolicyKind.RELIABILITY,
    "durability": QoSPolicyKind.DURABILITY,
}


def profile(depth=10, reliability=RELIABLE, durability=VOLATILE, **policies):
    return QoSProfile(depth=depth, reliability=reliability, durability=durability, **policies)


def listen(node, topic, qos):
    heard = []
    node.create_subscription(String, topic, lambda message: heard.append(message.data), qos)
    return heard


def send(publisher, *texts):
    for text in texts:
        publisher.publish(String(data=str(text)))


def test_a_stronger_reliability_offer_satisfies_a_weaker_request(ros):
    publisher = ros.node("sender").create_publisher(String, "topic", profile())
    heard = listen(ros.node("listener"), "topic", profile(reliability=BEST_EFFORT))
    ros.matched(publisher)
    send(publisher, "hello")
    ros.until(lambda: heard == ["hello"], "the message")
    # The subscription stays what it asked to be, best effort, whatever is offered.
    [end] = ros.main.nodes[1].get_subscriptions_info_by_topic("topic")
    assert end.qos_profile.reliability == BEST_EFFORT


def refused(ros, policy, offered, requested):
    """Prove that a pair does not match, beside a pair that does, on the same topic."""
    compatible, _ = qos_check_compatible(offered, requested)
    assert compatible == QoSCompatibility.ERROR
    at_publisher, at_subscription, heard = [], [], []
    publisher = ros.node("sender").create_publisher(
        String, "topic", offered,
        event_callbacks=PublisherEventCallbacks(incompatible_qos=at_publisher.append),
    )  # fmt: skip
    listener = ros.node("listener")
    listener.create_subscription(
        String, "topic", heard.append, requested,
        event_callbacks=SubscriptionEventCallbacks(incompatible_qos=at_subscription.append),
    )  # fmt: skip
    control = listen(listener, "topic", offered)
    ros.until(lambda: at_publisher and at_subscription, "the events on both sides")
    ros.matched(publisher)  # the control, and nobody else
    send(publisher, *range(5))
    ros.until(lambda: len(control) == 5, "what the matching subscriber hears")
    assert heard == []
    assert publisher.get_subscription_count() == 1
    for event in (at_publisher[0], at_subscription[0]):
        assert event.last_policy_kind == WRONG_POLICY[policy]


def test_a_best_effort_offer_does_not_satisfy_a_reliable_request(ros):
    refused(ros, "reliability", profile(reliability=BEST_EFFORT), profile(reliability=RELIABLE))


def test_a_volatile_offer_does_not_satisfy_a_transient_local_request(ros):
    refused(ros, "durability", profile(durability=VOLATILE), profile(durability=LOCAL))


def test_incompatible_qos_is_an_event_and_no_error(ros):
    refused(ros, "reliability", profile(reliability=BEST_EFFORT), profile(reliability=RELIABLE))
    sender, listener = ros.main.nodes
    # Both nodes live on: they talk on another topic, and nothing was raised while they were spun.
    publisher = sender.create_publisher(String, "other", profile())
    heard = listen(listener, "other", profile())
    ros.matched(publisher)
    send(publisher, "still here")
    ros.until(lambda: heard == ["still here"], "a message of nodes that live on")


@pytest.mark.parametrize(("offered", "requested"), [(1, 100), (5, 50), (100, 1)])
def test_depths_that_differ_match(ros, offered, requested):
    publisher = ros.node("sender").create_publisher(String, "topic", profile(offered))
    heard = listen(ros.node("listener"), "topic", profile(requested))
    ros.matched(publisher)
    send(publisher, "hello")
    ros.until(lambda: heard == ["hello"], "the message")
    # Not even announced: whoever looks at the graph sees neither history nor depth.
    [end] = ros.main.nodes[1].get_publishers_info_by_topic("topic")
    assert (end.qos_profile.history, end.qos_profile.depth) == (HistoryPolicy.UNKNOWN, 0)


def heard_after_a_stall(ros, offered, requested, sent=30):
    """Send while the subscriber's node is not spun, then spin it; return what it hears."""
    publisher = ros.node("sender").create_publisher(String, "topic", offered)
    listener = ros.node("listener", spun=False)
    heard = listen(listener, "topic", requested)
    ros.matched(publisher)
    send(publisher, *range(1, sent + 1))
    assert publisher.wait_for_all_acked(Duration(seconds=60))
    assert heard == []
    ros.main.executor.add_node(listener)
    ros.until(lambda: str(sent) in heard, "the newest message")
    return heard


@pytest.mark.parametrize("history", [HistoryPolicy.KEEP_LAST, HistoryPolicy.KEEP_ALL])
@pytest.mark.parametrize("depth", [1, 10, 25])
def test_each_side_keeps_as_many_messages_as_its_own_depth(ros, depth, history):
    heard = heard_after_a_stall(ros, profile(depth, history=history), profile(depth))
    assert heard == [str(number) for number in range(31 - depth, 31)]
    # And the publisher's side: a late joiner with room for fifty is given what its depth held.
    keeper = ros.main.nodes[0].create_publisher(String, "map", profile(depth, durability=LOCAL))
    send(keeper, *range(1, 31))
    late = listen(ros.main.nodes[1], "map", profile(50, durability=LOCAL))
    # Waited for first: a message sent before the replay would push the oldest out.
    ros.until(lambda: len(late) >= depth, "what was kept")
    send(keeper, "now")
    ros.until(lambda: "now" in late, "the newest message")
    assert late == [*(str(number) for number in range(31 - depth, 31)), "now"]


@pytest.mark.parametrize("reliability", [RELIABLE, BEST_EFFORT])
def test_a_volatile_late_joiner_gets_nothing_of_the_past(ros, reliability):
    qos = profile(5, reliability=reliability)
    publisher = ros.node("sender").create_publisher(String, "topic", qos)
    send(publisher, 1, 2, 3)
    heard = listen(ros.node("late"), "topic", qos)
    ros.matched(publisher)
    send(publisher, 4, 5)
    ros.until(lambda: "5" in heard, "the newest message")
    assert heard == ["4", "5"]


def test_reliability_durability_and_history_each_change_what_is_delivered(ros):
    sender, listener = ros.node("sender"), ros.node("listener")
    # Durability: with it on both sides the past is delivered, otherwise not.
    for durability, expected in ((VOLATILE, ["now"]), (LOCAL, ["past", "now"])):
        topic = f"durability_{durability.name.lower()}"
        publisher = sender.create_publisher(String, topic, profile(durability=durability))
        send(publisher, "past")
        heard = listen(listener, topic, profile(durability=durability))
        ros.matched(publisher)
        send(publisher, "now")
        ros.until(lambda heard=heard: "now" in heard, "the present")
        assert heard == expected
    # Reliability: one publisher that offers BEST_EFFORT reaches one of two subscribers.
    publisher = sender.create_publisher(String, "reliability", profile(reliability=BEST_EFFORT))
    asked = {r: listen(listener, "reliability", profile(reliability=r)) for r in ReliabilityPolicy
             if r in (RELIABLE, BEST_EFFORT)}  # fmt: skip
    ros.matched(publisher)
    send(publisher, "hello")
    ros.until(lambda: asked[BEST_EFFORT], "the message")
    assert asked == {RELIABLE: [], BEST_EFFORT: ["hello"]}
    # History: a subscriber that was busy goes on with the newest, or with all.
    for history, expected_count in ((HistoryPolicy.KEEP_LAST, 3), (HistoryPolicy.KEEP_ALL, 30)):
        topic = f"history_{history.name.lower()}"
        publisher = sender.create_publisher(String, topic, profile(100))
        busy = ros.node(f"busy_{history.name.lower()}", spun=False)
        heard = listen(busy, topic, profile(3, history=history))
        ros.matched(publisher)
        send(publisher, *range(1, 31))
        assert publisher.wait_for_all_acked(Duration(seconds=60))
        ros.main.executor.add_node(busy)
        ros.until(lambda heard=heard: "30" in heard, "the newest message")
        assert len(heard) == expected_count


def test_reliable_messages_can_miss_a_deadline(ros):
    qos = profile(deadline=Duration(nanoseconds=100_000_000))
    publisher = ros.node("sender").create_publisher(String, "topic", qos)
    heard, missed = [], []
    ros.node("listener").create_subscription(
        String, "topic", heard.append, qos,
        event_callbacks=SubscriptionEventCallbacks(deadline=missed.append),
    )  # fmt: skip
    ros.matched(publisher)
    send(publisher, "the only one")
    ros.until(lambda: missed, "a missed deadline")
    assert len(heard) == 1


def test_publish_does_not_wait_for_the_callback(ros):
    publisher = ros.node("sender").create_publisher(String, "topic", profile())
    busy = ros.node("busy", spun=False)
    heard = listen(busy, "topic", profile())
    ros.matched(publisher)
    send(publisher, *range(5))  # returns, though nothing can run the callback
    assert heard == []
    ros.main.executor.add_node(busy)
    ros.until(lambda: len(heard) == 5, "the callbacks")


class Sender(Node):
    """Publishes ten times a second."""

    def __init__(self, name, depth):
        super().__init__(name)
        self.publisher = self.create_publisher(String, name, QoSProfile(depth=depth))
        self.sent = 0
        self.create_timer(0.1, self.send)

    def send(self):
        self.publisher.publish(String())
        self.sent += 1


def test_depth_does_not_change_a_timers_rate():
    with course.Session(sim_time=True) as lab:  # simulated time, so the count is exact
        senders = [lab.run(Sender, f"depth_{depth}", depth) for depth in (1, 50)]
        lab.sim.advance(5.0)
        assert [sender.sent for sender in senders] == [50, 50]
