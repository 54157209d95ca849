"""The timeline measures what DDS stamps and counts, and what callbacks really did."""

from __future__ import annotations

import functools
import gc
import re
import sys
import threading
import time
import weakref
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from course import Session
from course.errors import SessionError, WaitTimeout
from course.messages.mcap_file import RecordingError
from course.views.timeline import Timeline
from course.views.timeline_words import describe_figures
from course.watch import callbacks, timeline
from course.watch.callbacks import CallbackTap
from course.watch.timeline import Passage
from tests.robot import Listener as TalkListener
from tests.robot import Robot

MS = 1_000_000


def passages(*stamps_ms: int, latency_ms: int = 2, first: int = 1) -> list[Passage]:
    return [
        Passage(stamp * MS, (stamp + latency_ms) * MS, first + number)
        for number, stamp in enumerate(stamps_ms)
    ]


def test_rate_and_latency_are_taken_from_the_stamps() -> None:
    found = timeline.compute_figures(passages(*range(0, 1000, 100)))
    assert found.rate == pytest.approx(10)
    assert found.latency_p50 == pytest.approx(0.002)
    assert found.latency_p95 == pytest.approx(0.002)
    assert (found.lost, found.gaps) == (0, ())


def test_a_pause_is_a_gap_and_a_missing_number_is_a_loss() -> None:
    late = passages(0, 100, 200, 300) + passages(900, 1000, first=7)
    found = timeline.compute_figures(late)
    assert found.gaps == (pytest.approx((0.3, 0.9)),)
    assert found.lost == 2
    assert "1 gap, the longest 0.60 s, 2 lost on the way" in describe_figures(found)


def test_a_drop_has_a_place_and_a_gap_has_no_rate() -> None:
    seen = passages(*range(0, 1000, 50)) + passages(*range(3000, 4000, 50), first=24)
    found = timeline.compute_figures(seen)
    assert found.drops == ((3.0, 3),)
    plots = timeline.compute_plots(seen, 0, 4000 * MS)  # 50 parts of 80 ms
    assert {round(rate, 6) for rate in plots.rate[1:12] if rate is not None} == {20.0}
    assert set(plots.rate[13:37]) == {0.0}
    assert set(plots.p50[13:37]) == {None}
    assert {value for value in plots.p95 if value is not None} == {0.002}


def test_p50_and_p95_are_those_of_each_part() -> None:
    slow = [Passage(n * MS, (n + (30 if n % 10 == 0 else 1)) * MS, n + 1) for n in range(100)]
    plots = timeline.compute_plots(slow, 0, 100 * 50 * MS)  # all of them in the first part
    assert (plots.p50[0], plots.p95[0]) == (0.001, 0.03)
    assert plots.p50[1:] == [None] * 49


def test_two_publishers_count_for_themselves_so_nothing_is_said_of_losses() -> None:
    assert timeline.compute_figures(passages(0, 1, 2) + passages(3, 4, 5)).lost == 0


def test_nothing_is_said_of_nothing() -> None:
    assert describe_figures(timeline.compute_figures([])) == "nothing"
    assert timeline.compute_figures(passages(5)).rate is None


def test_columns_cover_the_window() -> None:
    counts = timeline.count_columns([0, 1, 999, 1000, -1], 0, 1000)
    assert (counts[0], counts[-1], sum(counts)) == (2, 1, 3)


class Slow(Node):
    """Has a queue of one, and a callback that waits for `go`."""

    def __init__(self) -> None:
        super().__init__("slow")
        self.begun = threading.Event()
        self.go = threading.Semaphore(0)
        self.seen: list[str] = []
        self.create_subscription(String, "chatter", self.hear, 1)

    def hear(self, message: String) -> None:
        self.begun.set()
        self.go.acquire()
        self.seen.append(message.data)


def test_what_passed_a_slow_callback_by_is_marked_in_its_lane(session: Session) -> None:
    publisher = session.run(lambda: Node("talker")).create_publisher(String, "chatter", 10)
    slow = session.run(Slow)
    assert isinstance(slow, Slow)
    view = Timeline(session, [("chatter", None)])
    session.until(lambda: publisher.get_subscription_count() == 2)
    for number in range(8):
        publisher.publish(String(data=f"{number}"))
        session.until(lambda count=number + 1: view.figures()["/chatter"].count == count)
        session.until(slow.begun.is_set)  # from now on each message pushes out the one before
    slow.go.release(8)
    session.until(lambda: slow.seen == ["0", "7"])
    session.until(lambda: len(view.callback_runs("/chatter")) == 2)
    lanes = {lane["label"]: lane["drops"] for lane in view.make_frame()["topics"][0]["lanes"]}
    assert lanes["received"] == []
    ((_, missed),) = lanes["callback of /slow"]
    assert missed == 6
    assert "callbacks of /slow: 2, 6 messages passed it by" in view.words()


class Listener(Node):
    """Has a callback of each kind that rclpy knows."""

    def __init__(self) -> None:
        super().__init__("listener")
        self.seen: list[Any] = []
        self.create_subscription(String, "chatter", self.one, 10)
        self.create_subscription(String, "chatter", self.two, 10)
        self.create_subscription(String, "chatter", self.later, 10)

    def one(self, message: String) -> None:
        self.seen.append(("one", message.data))

    def two(self, message: String, info: dict[str, int]) -> None:
        self.seen.append(("two", info["publication_sequence_number"]))

    async def later(self, message: String) -> None:
        self.seen.append(("later", message.data))


def test_callbacks_run_as_before_and_are_seen(session: Session) -> None:
    talker = session.run(lambda: Node("talker"))
    publisher = talker.create_publisher(String, "chatter", 10)
    listener = session.run(Listener)
    assert isinstance(listener, Listener)
    originals = [subscription.callback for subscription in listener.subscriptions]
    view = Timeline(session, [("chatter", None)])
    session.until(lambda: publisher.get_subscription_count() == 4)
    for number in range(3):
        publisher.publish(String(data=f"{number}"))
    session.until(lambda: len(listener.seen) == 9)
    session.until(lambda: len(view.callback_runs("/chatter")) == 9)
    session.until(lambda: view.figures()["/chatter"].count == 3)
    assert {kind for kind, _ in listener.seen} == {"one", "two", "later"}
    runs = view.callback_runs("/chatter")
    assert all(run.published <= run.started <= run.ended for run in runs)
    assert "callbacks of /listener: 9" in view.words()
    (topic,) = view.make_frame()["topics"]
    assert [lane["label"] for lane in topic["lanes"]] == [
        "published", "received", "callback of /listener",
    ]  # fmt: skip
    assert [sum(lane["counts"]) for lane in topic["lanes"]] == [3, 3, 9]
    view.stop()
    publisher.publish(String(data="unseen"))
    session.until(lambda: len(listener.seen) == 12)
    assert len(view.callback_runs("/chatter")) == 9
    again = Timeline(session, [("chatter", None)])
    inner = [subscription.callback.__wrapped__ for subscription in listener.subscriptions]
    assert inner == originals, "wrapped once, however many timelines there were"
    publisher.publish(String(data="seen"))
    session.until(lambda: len(again.callback_runs("/chatter")) == 3)


def test_a_callback_is_given_what_it_takes_while_timelines_come_and_go(
    request: pytest.FixtureRequest,
) -> None:
    # rclpy takes a message and calls the callback a moment later: threads that change more often
    # make more of such moments.
    request.addfinalizer(functools.partial(sys.setswitchinterval, sys.getswitchinterval()))
    sys.setswitchinterval(1e-6)
    with Session(threads=3) as session:
        robot, listener = session.run(Robot, 1000.0), session.run(TalkListener)
        assert isinstance(robot, Robot)
        assert isinstance(listener, TalkListener)
        session.until(lambda: listener.heard)
        begun = time.monotonic()
        while listener.heard < 2000 and not session.errors:
            tap = CallbackTap("/chatter")
            tap.watch([robot, listener])
            tap.stop()
            assert time.monotonic() - begun < 60
        assert session.errors == []


def test_a_listener_is_let_go_of_with_its_wrapped_callback(session: Session) -> None:
    listener = session.run(Listener)
    view = Timeline(session, [("chatter", String)])
    view.stop()
    gone = weakref.ref(listener)
    session.stop(listener)
    del listener
    session.until(lambda: gc.collect() >= 0 and gone() is None)


def test_a_callback_that_raises_is_reported_as_ever(session: Session) -> None:
    def broken(_message: String) -> None:
        raise ZeroDivisionError("as ever")

    node = session.run(lambda: Node("n"))
    node.create_subscription(String, "chatter", broken, 10)
    tap = CallbackTap("/chatter")
    tap.watch([node])
    session.publish("chatter", String())
    session.until(lambda: session.errors)
    assert str(session.errors[0].exception) == "as ever"
    assert session.errors[0].callback == "test_a_callback_that_raises_is_reported_as_ever.broken"
    assert len(tap.runs_since(0)) == 1


class Broken:
    """Can be called as a callback, and has no name of its own."""

    def __call__(self, _message: String) -> None:
        raise ZeroDivisionError

    def method(self, _extra: int, _message: String) -> None:
        raise ZeroDivisionError


@pytest.mark.parametrize(
    ("callback", "name"),
    [
        (functools.partial(Broken().method, 1), "Broken.method"),
        (Broken(), "Broken.__call__"),
    ],
    ids=["partial", "callable"],
)
def test_a_callback_keeps_its_name_under_a_timeline(
    session: Session, callback: Any, name: str
) -> None:
    node = session.run(lambda: Node("n"))
    node.create_subscription(String, "chatter", callback, 10)
    tap = CallbackTap("/chatter")
    for listens in (False, True):
        if listens:
            tap.watch([node])
        known = sum(error.count for error in session.errors)
        session.publish("chatter", String())
        session.until(lambda known=known: sum(e.count for e in session.errors) > known)  # type: ignore[misc]
    assert len(tap.runs_since(0)) == 1
    assert [error.callback for error in session.errors] == [name]


def test_its_messages_can_be_saved(session: Session, tmp_path: Path) -> None:
    talker = session.run(lambda: Node("talker"))
    publisher = talker.create_publisher(String, "chatter", 10)
    view = Timeline(session, [("chatter", String)])
    session.until(lambda: publisher.get_subscription_count() == 1)
    publisher.publish(String(data="x"))
    session.until(lambda: view.figures()["/chatter"].count == 1)
    with view.save(tmp_path / "t.mcap").open("rb") as file:
        ((_, channel, saved),) = make_reader(file).iter_messages()
    assert channel.topic == "/chatter"
    assert deserialize_message(saved.data, String).data == "x"
    view.stop()
    with pytest.raises(RecordingError, match="has let its messages go"):
        view.save(tmp_path / "late.mcap")


@pytest.mark.parametrize("what", ["messages", "callbacks"])
def test_a_window_with_more_than_is_kept_says_since_when_it_is_whole(
    session: Session, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    module, kept = (timeline, "KEPT_MESSAGES") if what == "messages" else (callbacks, "KEPT_RUNS")
    monkeypatch.setattr(module, kept, 50)
    session.run(Robot, 40.0)
    session.run(TalkListener)
    view = session.timeline("chatter", window=60.0)
    assert "s only: a timeline keeps" not in view.words()
    (trace, tap) = view._rows[0]
    session.until(lambda: len(trace.passages_since(0)) >= 50 and len(tap.runs_since(0)) >= 50)
    (topic,) = view.make_frame()["topics"]
    for text in (view.words(), topic["text"]):
        found = re.search(r"\(of the last (\d+\.\d) s only: a timeline keeps \d+ messages", text)
        assert found, text
        assert 0.3 < float(found[1]) < 30


def test_the_memory_that_its_messages_take_is_bounded_and_given_back(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(timeline, "MAX_BYTES", 100_000)
    monkeypatch.setattr(timeline, "MESSAGES", 20)
    talker = session.run(lambda: Node("talker"))
    publisher = talker.create_publisher(String, "chatter", 1000)
    view = Timeline(session, [("chatter", String)])
    (trace, _) = view._rows[0]
    session.until(lambda: publisher.get_subscription_count() == 1)
    for size, kept in ((10, 20), (30_000, 3), (200_000, 1), (10, 20)):
        before = view.figures()["/chatter"].count
        for _ in range(30):
            publisher.publish(String(data="x" * size))
        session.until(lambda n=before + 30: view.figures()["/chatter"].count == n, 20)  # type: ignore[misc]
        assert len(trace.latest_messages) == kept
        assert trace._size == sum(len(cdr) for _, cdr in trace.latest_messages)
    view.stop()
    assert (trace.latest_messages, trace._size) == ([], 0)


def test_a_talker_that_comes_back_as_best_effort_is_heard(session: Session) -> None:
    def talker(qos: QoSProfile | int) -> Node:
        node = Node("talker")
        publisher = node.create_publisher(String, "chatter", qos)
        node.create_timer(0.02, lambda: publisher.publish(String(data="x")))
        return node

    session.run(talker, 10)
    view = session.timeline("chatter")
    session.until(lambda: view.figures()["/chatter"].count > 2)
    session.run(talker, qos_profile_sensor_data)
    here = time.time_ns()
    (trace, _) = view._rows[0]
    session.until(lambda: view.figures() and len(trace.passages_since(here)) > 10)
    before = session.observer.count_subscribers("/chatter")
    view.figures()
    assert session.observer.count_subscribers("/chatter") == before == 1


def test_what_was_published_before_is_no_late_message(session: Session) -> None:
    latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node = session.run(lambda: Node("mapper"))
    publisher = node.create_publisher(String, "map", latched)
    publisher.publish(String(data="old"))
    assert session.next_message(String, "map").data == "old"
    view = Timeline(session, [("map", None)])
    session.until(lambda: publisher.get_subscription_count() == 1)
    for number in range(3):
        publisher.publish(String(data=f"{number}"))
    session.until(lambda: view.figures()["/map"].count >= 3)
    kept = [deserialize_message(cdr, String) for _, cdr in view._rows[0][0].latest_messages]
    assert [message.data for message in kept] == ["0", "1", "2"]


def test_what_a_timeline_cannot_show_is_said(session: Session) -> None:
    with pytest.raises(SessionError, match="1 to 6 topics, not 0"):
        session.timeline()
    with pytest.raises(SessionError, match="up to 60 s, not 90 s"):
        session.timeline(("x", String), window=90)
    with pytest.raises(SessionError, match="window is a number of seconds"):
        session.timeline(("x", String), window="a")  # type: ignore[arg-type]
    with pytest.raises(WaitTimeout, match="somebody to use /x"):
        Timeline(session, [("x", None)])
