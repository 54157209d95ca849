"""Views side by side: of each name the view that fits."""

from __future__ import annotations

import pytest
from rclpy.node import Node
from std_msgs.msg import String

from course import Session
from course.errors import SessionError, WaitTimeout
from tests.kernel import Kernel
from tests.robot import Robot

IN_A_KERNEL = """
import ipywidgets, course
from std_srvs.srv import Trigger
from rclpy.node import Node
node = course.run(Node, "worker")
node.create_service(Trigger, "work", lambda request, response: response)
shown = []
def keep(data, metadata=None, **_):
    shown.append(data)
get_ipython().display_pub.publish = keep
panel = course.session().panel(course.world("hall"), "work", node)
"""


def test_each_name_has_the_view_that_fits(session: Session) -> None:
    robot = session.run(Robot)
    session.run(Node, "talker").create_publisher(String, "words", 10)
    world = session.world("hall")
    panel = session.panel(world, "lamp", "words", robot, "/robot")
    assert [view.label for view in panel.views] == [
        "World", "Service console", "Timeline", "Parameter panel", "Parameter panel",
    ]  # fmt: skip
    assert "Service /lamp, 0 calls" in repr(panel)
    assert "Parameters of /robot" in repr(panel)


def test_what_a_panel_cannot_show_is_a_sentence(session: Session) -> None:
    with pytest.raises(SessionError, match="1 to 8 views, not 0"):
        session.panel()
    with pytest.raises(SessionError, match="names, nodes and views, not 3"):
        session.panel(3)  # type: ignore[arg-type]
    with pytest.raises(WaitTimeout, match="/nobody"):
        session.panel("nobody")
    world = session.world("hall")
    with pytest.raises(SessionError, match="1 to 8 views, not 9"):
        session.panel(*[world] * 9)


def test_a_topic_tells_its_newest_message(session: Session) -> None:
    publisher = session.run(Node, "talker").create_publisher(String, "words", 10)
    view = session.timeline("words")
    assert "newest" not in view.words()
    session.until(publisher.get_subscription_count)
    publisher.publish(String(data="<b>"))
    session.until(lambda: "newest message: '<b>'" in view.words())
    assert view.make_frame()["topics"][0]["newest"] == "'<b>'"
    publisher.publish(String(data="x" * 200_000))
    session.until(lambda: "newest message: 200 kB" in view.words())


def test_a_box_leaves_a_copy_of_each_view_and_goes_with_the_last_of_them() -> None:
    kernel = Kernel()
    try:
        for cell in (
            IN_A_KERNEL,
            "panel._ipython_display_()\n"
            "box, *copies = shown\n"
            "assert 'application/vnd.jupyter.widget-view+json' in box, box\n"
            "assert ['rosview-saved' in copy['text/html'] for copy in copies] == [True] * 3",
            "made = ipywidgets.Widget.widgets.values()\n"
            "boxes = [widget for widget in made if isinstance(widget, ipywidgets.Box)]\n"
            "assert len(boxes) == 2, boxes",
            "for view in panel.views[:2]:\n    view.end('over', close=True)",
            "assert all(box.comm for box in boxes)",
            "panel.views[2].end('over', close=True)",
            "assert not any(box.comm for box in boxes)",
            "shown.clear()\npanel._ipython_display_()\nassert list(shown[0]) == ['text/plain']",
        ):
            status, said = kernel.run(cell)
            assert status == "ok", said
    finally:
        kernel.close()
