"""The pictures that stay in a saved notebook: they say what the views said, and nothing runs."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

from rclpy.node import Node

from course import Session
from course.views.graph import GraphView
from course.views.pictures.svg_text import make_document, make_element
from tests.robot import Listener, Robot

NAMESPACE = "{http://www.w3.org/2000/svg}"


def texts(picture: str) -> list[str]:
    root = ElementTree.fromstring(picture)
    return [element.text or "" for element in root.iter(f"{NAMESPACE}text")]


def test_what_is_shown_is_escaped() -> None:
    picture = make_document("", "<b>", (0, 0, 1, 1), make_element("text", {"x": '"<'}, text="<i>&"))
    assert texts(picture) == ["<i>&"]
    assert "<b>" not in picture


def test_the_picture_of_a_graph_names_boxes_qos_and_what_does_not_fit(session: Session) -> None:
    view = GraphView(session)
    assert view.picture() == "", "there is nothing to see"
    session.run(Robot, 20.0)
    session.run(Listener)
    session.until(lambda: view.look() and "reliability" in view.picture())
    said = texts(view.picture())
    assert {"/robot", "/listener", "/chatter", "/scan", "/lamp", "service SetBool"} <= set(said)
    assert "reliable · volatile · 10" in said
    assert "reliability: offers best effort, requests reliable" in " ".join(said)


def test_a_timeline_stands_still_when_nobody_publishes_any_more(session: Session) -> None:
    session.run(Robot, 50.0)
    view = session.timeline("chatter", window=2.0)
    session.until(lambda: view.figures()["/chatter"].count > 10)
    session.stop("robot")
    session.until(lambda: view.look() and view.standstill)
    assert "Nobody publishes here any more since" in view.standstill
    frame, words = view.look()
    (published, received) = frame["topics"][0]["lanes"][:2]
    assert sum(published["counts"]) > 10
    assert sum(received["counts"]) > 10
    assert any(text.startswith("/chatter ") and " Hz" in text for text in texts(view.picture()))
    # The window has moved on, and what is shown has not.
    session.until(lambda: view.figures()["/chatter"].count == 0, timeout=10.0)
    assert view.look() == (frame, words)
    session.run(Robot, 50.0)
    session.until(lambda: view.look() and not view.standstill)


def test_a_timeline_that_nobody_publishes_yet_does_not_stand_still(session: Session) -> None:
    listener = session.run(Listener)
    assert isinstance(listener, Node)
    view = session.timeline("chatter")
    view.look()
    assert view.standstill == ""
