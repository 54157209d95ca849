"""Live views keep a bounded pace, end with their session, and never take their thread down."""

from __future__ import annotations

import re
import threading
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import String

from course import Session
from course.graph import reader
from course.views.graph import GraphView
from course.views.shared import live_view
from course.views.shared.live_view import LiveView
from course.views.shared.static_fallback import saved_output
from course.watch.callbacks import CallbackTap
from tests.kernel import Kernel


class Counter(LiveView):
    """Shows how often it was looked at: something new at every look."""

    script = "graph"
    looks = 0

    def make_frame(self) -> dict[str, Any]:
        self.looks += 1
        return {"looks": self.looks}

    def words(self) -> str:
        return f"{self.looks} looks"


@pytest.fixture
def kernel() -> Iterator[Kernel]:
    running = Kernel()
    yield running
    running.close()


def views_threads() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "ROS session views"]


def test_a_view_that_nobody_shows_costs_nothing(session: Session) -> None:
    view = Counter(session)
    assert repr(view) == "0 looks"
    assert (view.looks, views_threads()) == (0, [])


def test_at_most_ten_frames_a_second(session: Session) -> None:
    view = Counter(session)
    started = time.monotonic()
    session.until(lambda: view.widget.number >= 8, 10)
    least = (view.widget.number - 1) * live_view.MIN_PERIOD_S  # the first one comes at once
    assert time.monotonic() - started >= least * 0.99


def test_a_browser_that_confirms_nothing_gets_a_frame_a_second(
    session: Session,
) -> None:
    view = Counter(session)
    view.widget.number = live_view.PATIENCE + 5
    now = time.monotonic()
    assert view.tick(now + 60) - time.monotonic() > 0.9
    view._on_message(view.widget, {"drawn": view.widget.number}, [])
    assert view.tick(now + 120) - time.monotonic() <= live_view.MIN_PERIOD_S


def test_what_has_not_changed_is_not_sent_again(session: Session) -> None:
    view = GraphView(session)
    number = view.widget.number
    for _ in range(3):
        view._refresh_widget()
    assert view.widget.number == number


def test_a_new_node_appears_a_stopped_one_goes_and_the_last_graph_stays(session: Session) -> None:
    view = GraphView(session)

    def labels() -> set[str]:
        return {box["label"] for box in view.widget.frame["boxes"]}

    assert labels() == set()

    def talker() -> Node:
        node = Node("talker")
        node.create_publisher(String, "chatter", 10)
        return node

    session.run(talker)
    session.run(Node, "other")
    session.until(lambda: labels() == {"/talker", "/chatter", "/other"})
    session.stop("other")
    session.until(lambda: labels() == {"/talker", "/chatter"})
    session.stop("talker")
    session.until(lambda: "No node runs any more since" in view.widget.notice)
    assert labels() == {"/talker", "/chatter"}
    assert view.words() == "No nodes."
    session.run(Node, "other")
    session.until(lambda: labels() == {"/other"} and not view.widget.notice)


def test_a_closed_session_ends_its_views_and_their_thread() -> None:
    with Session() as session:
        view = GraphView(session)
        assert view.widget.ended == ""
        assert len(views_threads()) == 1
    assert re.fullmatch(
        r"The session has been closed. This is how it was at \d\d:\d\d:\d\d\.", view.widget.ended
    )
    assert views_threads() == []


def test_a_session_that_closes_is_looked_at_a_last_time() -> None:
    with Session() as session:
        view = GraphView(session)
        view.period = 60.0  # s: no look but the first and the last
        assert not view.widget.frame["boxes"]
        session.run(Node, "late")
    (box,) = view.widget.frame["boxes"]
    assert box["label"] == "/late"


def test_a_session_closes_whatever_its_last_look_raises() -> None:
    with Session() as session:
        session.before_close(lambda: 1 / 0)
    assert session.closed


def test_a_view_that_fails_says_so_and_the_others_go_on(session: Session) -> None:
    class Broken(Counter):
        def make_frame(self) -> dict[str, Any]:
            raise ZeroDivisionError("no rate yet")

    broken, sound = Broken(session), Counter(session)
    assert broken.widget.ended == "This view has stopped (ZeroDivisionError: no rate yet)."
    before = sound.widget.number
    session.until(lambda: sound.widget.number > before)


@pytest.mark.parametrize("also_at_its_end", [False, True])
def test_a_view_whose_frame_cannot_be_sent_takes_no_other_down(
    session: Session, also_at_its_end: bool
) -> None:
    unsent, sound = Counter(session), Counter(session)
    assert unsent.widget
    assert sound.widget
    (thread,) = views_threads()

    def refuse(*_args: object, **_options: object) -> None:
        raise OSError("no such comm")

    unsent.widget.observe(refuse, "number")
    if also_at_its_end:
        unsent.widget.observe(refuse, "ended")
    session.until(lambda: unsent.end_reason)
    assert unsent.end_reason == "This view has stopped (OSError: no such comm)."
    before = sound.widget.number
    session.until(lambda: sound.widget.number > before)
    later = Counter(session)
    session.until(lambda: later.widget.number > 2)
    assert views_threads() == [thread]


def test_a_node_that_is_destroyed_under_a_look_does_not_end_the_view(session: Session) -> None:
    class Stumbling(Counter):
        period = 60.0  # s: only this test looks
        over_what: Node | None = None

        def make_frame(self) -> dict[str, Any]:
            if self.over_what is not None:
                self.over_what.get_fully_qualified_name()
            return super().make_frame()

    gone = Node("gone", context=session.context)
    gone.destroy_node()
    view = Stumbling(session)
    for _ in range(2):
        before = view.widget.number
        view.over_what = gone
        for _ in range(live_view.STUMBLES - 1):
            view._refresh_widget()
        assert (view.widget.ended, view.widget.number) == ("", before)
        view.over_what = None
        view._refresh_widget()
        assert view.widget.number > before
    view.over_what = gone
    for _ in range(live_view.STUMBLES):
        view._refresh_widget()
    assert view.widget.ended.startswith("This view has stopped (InvalidHandle")


def test_what_is_destroyed_in_between_is_passed_over(session: Session) -> None:
    gone, sound = Node("gone", context=session.context), session.run(lambda: Node("sound"))
    gone.destroy_node()
    reader.read_graph(session.observer, own=[gone, sound])
    CallbackTap("/chatter").watch([gone, sound])


def test_nodes_that_come_and_go_all_the_time_do_not_end_views(session: Session) -> None:
    def talker() -> Node:
        node = Node("talker")
        node.create_publisher(String, "chatter", 10)
        node.create_subscription(String, "chatter", lambda _message: None, 10)
        return node

    views = [session.graph(), session.timeline(("chatter", String))]
    for view in views:
        view.period = 0.0
        view.widget  # noqa: B018 - shown from now on
    for _ in range(20):
        session.run(talker)
        session.stop("talker")
    assert [view.end_reason for view in views] == ["", ""]


def test_without_a_front_end_a_view_is_words_and_makes_no_widget(session: Session) -> None:
    view = GraphView(session)
    assert view._repr_mimebundle_() == ({"text/plain": "No nodes."}, {})
    assert views_threads() == []


def test_in_a_kernel_a_view_leaves_its_words_for_a_reader_without_one(kernel: Kernel) -> None:
    status, shown = kernel.run("import course\ncourse.session().graph()")
    assert status == "ok"
    (_, live_words), (_, note) = shown
    assert live_words == "No nodes."
    assert re.match(
        r"ROS graph as it was at \d{4}-\d\d-\d\d \d\d:.* not live: to see what happens now", note
    )


SHOWN_LATER = """
import base64, re
shown = []
def keep(data, metadata=None, *, transient=None, update=False, **_):
    shown.append((update, (transient or {}).get("display_id"), data))
get_ipython().display_pub.publish = keep
session = course.session()
session.graph()
"""


def test_what_a_view_shows_last_takes_the_place_of_its_first_copy(kernel: Kernel) -> None:
    kernel.run("import course\nfrom rclpy.node import Node")
    assert kernel.run(SHOWN_LATER) == ("ok", [])
    kernel.run("talker = course.run(Node, 'talker')")
    status, said = kernel.run(
        "course.close()\n"
        "updates = [(key, data['text/html']) for update, key, data in shown if update]\n"
        "first = [key for update, key, data in shown if not update and key]\n"
        "assert updates and {key for key, _ in updates} == set(first), shown\n"
        "picture = re.search(r'base64,([^\"]+)', updates[-1][1])[1]\n"
        "print(base64.b64decode(picture).decode())"
    )
    assert status == "ok", said
    picture = ElementTree.fromstring(said[0][1])
    assert "/talker" in [element.text for element in picture.iter() if element.tag.endswith("text")]


def test_saved_words_are_escaped_and_bounded() -> None:
    data = saved_output("ROS graph", "<img src=x>" + "x" * 100_000)
    assert "<img" not in data["text/html"]
    assert "[the rest was not saved]" in data["text/html"]
    assert len(data["text/html"]) < 30_000


def test_a_frame_that_does_not_fit_is_said(session: Session) -> None:
    class Large(Counter):
        large = False

        def make_frame(self) -> dict[str, Any]:
            return {**super().make_frame(), "text": "x" * live_view.MAX_FRAME_BYTES * self.large}

    view = Large(session)
    number = view.widget.number
    view.large = True
    session.until(lambda: "too large to draw (256 KiB)" in view.widget.notice)
    assert view.widget.ended == ""
    view.large = False
    session.until(lambda: view.widget.number > number and not view.widget.notice)


def test_messages_that_are_none_are_passed_over(session: Session) -> None:
    view = GraphView(session)
    for message in ("x", None, [], {}, {"drawn": "9"}, {"drawn": None}):
        view._on_message(view.widget, message, [])
    assert view.widget.ended == ""
