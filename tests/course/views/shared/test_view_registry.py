"""A view's cell that is run again replaces the view, and leaves nothing of the old one behind."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest

from course import Session
from course.views.shared import view_registry
from course.views.shared.live_view import LiveView
from course.views.shared.refresher import ticker_of
from course.views.shared.view_registry import registry_of
from tests.kernel import Kernel
from tests.robot import Listener, Robot

SETUP = """
import inspect, json
import course
from tests.robot import Listener, Robot
from course.views.shared.view_registry import registry_of
from course.views.shared.refresher import ticker_of
session = course.session(threads=4)
robot, listener = course.run(Robot, 20.0), course.run(Listener)
depth = []
def hear(message):
    depth.append(len(inspect.stack(0)))
listener.create_subscription(__import__('std_msgs.msg').msg.String, 'chatter', hear, 10)
"""

VIEWS = (
    "session.graph()",
    "session.log_panel()",
    "session.timeline('chatter')",
    "session.action('count')",
    "session.service('lamp')",
    "session.parameters('robot')",
    "session.qos_lab()",
)

COUNT = """
session.until(lambda: depth)
count = len(depth)
session.until(lambda: len(depth) > count + 1)
import ipywidgets.widgets.widget
print(json.dumps({
    'living': len(registry_of(session)._views), 'ticking': len(ticker_of(session)._views),
    'widgets': sum(hasattr(w, 'ended') for w in ipywidgets.widgets.widget._instances.values()),
    'readers': session.observer.count_subscribers('/chatter'),
    'watchers': session.observer.count_subscribers('/count/_action/feedback'),
    'depth': depth[-1],
}))
"""


@pytest.fixture(scope="module")
def kernel() -> Iterator[Kernel]:
    running = Kernel()
    yield running
    running.close()


def counted(kernel: Kernel) -> dict[str, Any]:
    status, shown = kernel.run(COUNT)
    assert status == "ok", shown
    return dict(json.loads(next(text for kind, text in shown if kind == "stdout")))


def test_cells_that_run_again_have_as_many_views_as_cells(kernel: Kernel) -> None:

    assert kernel.run(SETUP)[0] == "ok"
    for cell in VIEWS:
        assert kernel.run(cell)[0] == "ok"
    once = counted(kernel)
    for _ in range(14):
        for cell in VIEWS:
            assert kernel.run(cell)[0] == "ok"
    assert counted(kernel) == once
    assert (once["living"], once["ticking"], once["widgets"]) == (len(VIEWS),) * 3
    # A cell of another text is another cell: both graphs live, and so do two of one cell.
    assert kernel.run("session.graph() # beside")[0] == "ok"
    assert kernel.run("pair = session.graph(), session.graph()\npair[0].widget")[0] == "ok"
    assert counted(kernel)["living"] == once["living"] + 3


class Plain(LiveView):
    label = "Plain"
    script = "graph"

    def make_frame(self) -> dict[str, Any]:
        return {}

    def words(self) -> str:
        return "as ever"


def test_a_call_in_a_program_that_is_made_again_replaces_its_view(session: Session) -> None:
    session.run(Robot, 20.0)
    listener = session.run(Listener)
    (heard,) = [s for s in listener.subscriptions if s.topic_name == "/chatter"]
    original = heard.callback
    before = session.observer.count_subscribers("/chatter")
    views = []
    for _ in range(15):
        for topic in ("chatter", "scan"):
            views.append(session.timeline(topic))
    assert len(registry_of(session)._views) == 2
    session.until(lambda: session.observer.count_subscribers("/chatter") == before + 1)
    for view in views[-2:]:
        assert not view.end_reason
        view.stop()
    session.until(lambda: session.observer.count_subscribers("/chatter") == before)
    assert heard.callback.__wrapped__ == original, "wrapped once for all of them"
    assert "Timeline: This view has been replaced" in repr(views[0])


def test_two_places_have_two_views_and_nobody_has_more_than_so_many(session: Session) -> None:
    one, two = Plain(session), Plain(session)
    assert (repr(one), repr(two)) == ("as ever", "as ever")
    views = [Plain(session, number) for number in range(view_registry.MAX_VIEWS + 5)]
    assert one.end_reason == two.end_reason == views[0].end_reason == view_registry.TOO_MANY
    assert (
        sum(not view.end_reason for view in views)
        == view_registry.MAX_VIEWS
        == len(registry_of(session)._views)
    )


def test_what_a_closed_session_left_on_the_page_goes_when_its_cell_is_run_again(
    kernel: Kernel,
) -> None:
    cell = "from tests.robot import Robot\ncourse.run(Robot)\ncourse.session().graph()"
    count = "print(sum(hasattr(w, 'ended') for w in ipywidgets.widgets.widget._instances.values()))"
    kernel.run("import ipywidgets.widgets.widget\nimport course\ncourse.close()")
    counts = []
    for _ in range(4):
        assert kernel.run(cell)[0] == "ok"
        status, shown = kernel.run(f"course.close()\n{count}")
        assert status == "ok", shown
        counts.append(next(text for kind, text in shown if kind == "stdout"))
    assert counts == counts[:1] * 4


def test_closed_sessions_leave_so_many_views_on_the_page_at_most() -> None:
    views = []
    for turn in range(view_registry.MAX_VIEWS // 10 + 1):
        with Session() as session:
            views += [Plain(session, turn, number) for number in range(10)]
            widgets = [view.widget for view in views[-10:]]
        assert {widget.ended.partition(". ")[0] for widget in widgets} == {
            "The session has been closed"
        }
    left = [view for view in views if view.widget.comm is not None]
    assert left == views[-view_registry.MAX_VIEWS :]


def test_a_closed_widget_ends_its_view(session: Session) -> None:
    view = Plain(session)
    view.widget.close()
    assert view.end_reason == "Its widget has been closed."
    assert list(ticker_of(session)._views) == []


def test_a_view_of_a_context_that_was_shut_down_says_so() -> None:
    with Session() as session:
        made = (session.graph(), session.log_panel(), session.qos_lab())
        widgets = [view.widget for view in made]
        session.context.shutdown()
        while not all(widget.ended for widget in widgets):
            ticker_of(session)._thread.join(0.05)  # type: ignore[union-attr]
        assert {widget.ended.partition(". ")[0] for widget in widgets} == {
            "The session has been closed"
        }
        assert repr(made[0]) == "ROS graph: The session has been closed."
