"""The view of a world: bounded frames, words, a picture, and controls that act."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path as PlannedPath
from rclpy.node import Node

from course import Session
from course.errors import SessionError
from course.views import world_picture, world_words
from course.views.shared import live_view
from course.views.shared.live_view import SLOW_PERIOD_S
from course.views.world import ENDED, World
from tests.kernel import Kernel

MAX_FAST_BYTES = 2400
"""A frame of 25 a second, with 60 kB a second for all of them."""

NASTY = '<script>alert("1")</script> & \x00\x1b'


@pytest.fixture
def world(session: Session) -> World:
    made = session.world("warehouse")
    session.until(lambda: made.make_frame()["beams"])  # its first scan
    return made


@pytest.fixture
def control(world: World) -> Callable[..., None]:
    """Return a function that sends what the browser would."""

    def send(**message: Any) -> None:
        world._on_message(world.widget, message, [])

    return send


def floor_and_moment(world: World) -> tuple[dict[str, Any], dict[str, Any]]:
    return world.simulation.describe_floor(), world.simulation.describe_moment()


def test_a_frame_is_json_of_bounded_size(session: Session, world: World) -> None:
    with_much = world.simulation.describe_moment() | {
        "trail": [[11.123, 7.123]] * 5000,
        "path": [[11.123, 7.123]] * 5000,
        "found": [[11.123, 7.123]] * 5000,
        "news": ["The robot touched a shelf. " * 500] * 5,
    }
    frame = world._frame_of(with_much)
    assert json.loads(json.dumps(frame)) == frame
    assert len(json.dumps(frame)) < 32 * 1024
    for name in (*world.fixed_parts, *world.slow_parts):
        del frame[name]
    assert len(json.dumps(frame)) < MAX_FAST_BYTES


def test_what_never_changes_is_sent_once_and_what_may_be_late_seldom(
    session: Session, world: World
) -> None:
    sent: dict[str, int] = {"fixed": 0, "slow": 0, "frame": 0}

    def count(change: Any) -> None:
        sent[change["name"]] += 1

    widget = world.widget
    assert widget.fixed["floor"]["name"] == "warehouse"
    assert set(widget.slow) == set(world.slow_parts)
    assert not {*widget.fixed, *widget.slow} & set(widget.frame)
    widget.observe(count, ["fixed", "slow", "frame"])
    begun = widget.number
    world.drive(0.5, 0.0)

    def seen_often() -> bool:
        world._on_message(widget, {"drawn": widget.number}, [])  # else frames come seldom
        return sent["frame"] >= 3 * SLOW_PERIOD_S / world.period

    session.until(seen_often, 60)
    assert sent["fixed"] == 0
    assert 1 <= sent["slow"] < sent["frame"]
    assert widget.number - begun >= sent["frame"]


def test_words_say_where_the_robot_is_what_is_near_and_what_is_wrong(world: World) -> None:
    floor, moment = floor_and_moment(world)
    moment["robot"] |= {"x": 1.2, "y": 4.0, "yaw": math.radians(47), "speed": 0.3, "turn": -0.2}
    moment["robot"] |= {"battery": 0.874, "stopped": True, "touching": True, "holding": True}
    moment["beams"] = [2.0, 1.5, 0.52, None]
    moment["faults"] |= {"wheels": "jammed", "camera": "unplugged"}
    moment |= {"path": [[1, 1], [3.04, 2.0]], "found": [[1, 1]], "news": ["The robot touched it."]}
    topics = [{"name": "/scan", "rate": 10.0}, {"name": "/bumper", "rate": 0.0}]
    said = world_words.describe_world(floor, moment, topics, "paused").splitlines()
    assert said[1:] == [
        "The robot is at x 1.20 m, y 4.00 m (0.3 m from returns), heading north-east (47°), "
        "driving forwards at 0.30 m/s and turning right at 0.20 rad/s.",
        "The nearest thing that the LIDAR sees is 0.52 m away, behind.",
        "Battery 87%. Gripper open, holding something. Emergency stop pressed. Bumper touches "
        "something.",
        "Faults: wheels jammed, camera unplugged.",
        "On the floor: 2 people, 0 obstacles. The planned path has 2 points and ends at "
        "(3.0, 2.0). Your nodes found 1 obstacle.",
        "News: The robot touched it.",
        "Topics: /scan 10.0 Hz, /bumper now and then.",
    ]
    assert said[0].startswith("Warehouse, ")
    assert said[0].endswith(" s, paused")


@pytest.mark.parametrize(
    ("degrees", "name"),
    [(0, "east (0°)"), (90, "north (90°)"), (-90, "south (270°)"), (359.9, "east (0°)")],
)
def test_a_heading_has_a_name(degrees: float, name: str) -> None:
    assert world_words.name_heading(math.radians(degrees)) == name


def test_a_picture_is_sound_xml_whatever_names_there_are(world: World) -> None:
    floor, moment = floor_and_moment(world)
    floor["name"] = floor["stations"][0]["name"] = NASTY
    moment["path"], moment["found"] = [[1.0, 1.0], [2.0, 1.0]], [[3.0, 3.0]]
    picture = world_picture.draw_world(floor, moment, NASTY)
    root = ElementTree.fromstring(picture)
    space = "{http://www.w3.org/2000/svg}"
    assert root.findtext(f"{space}title") == '<script>alert("1")</script> & '
    assert root.findtext(f"{space}desc") == root.findtext(f"{space}title")
    assert root.find(f".//{space}script") is None
    names = [text.text for text in root.iter(f"{space}text")]
    assert len(names) == len(floor["stations"])
    assert len(picture) < 20_000


def test_each_control_reaches_the_simulation(
    session: Session, world: World, control: Callable[..., None]
) -> None:
    control(do="press_stop")
    assert world.make_frame()["robot"]["stopped"]
    control(do="release_stop")
    assert not world.make_frame()["robot"]["stopped"]
    control(fault=["wheels", "jammed"])
    assert world.make_frame()["faults"]["wheels"] == "jammed"
    control(fault=["wheels", "free"])
    control(add=[4.0, 1.0])
    ((number, x, y, _),) = world.make_frame()["obstacles"]
    assert (x, y) == (4.0, 1.0)
    control(move=[number, 4.5, 1.5])
    assert world.make_frame()["obstacles"][0][1:3] == [4.5, 1.5]
    control(remove=number)
    assert world.make_frame()["obstacles"] == []
    control(speed=2)
    assert world.make_frame()["speed"] == 2.0
    before = world.make_frame()["robot"]["x"]
    control(drive=[0.5, 0.0])
    session.until(lambda: world.make_frame()["robot"]["x"] > before)
    control(do="pause")
    paused = world.make_frame()
    assert paused["paused"]
    control(do="step_once")
    assert world.make_frame()["time"] == pytest.approx(paused["time"] + 0.1)
    control(do="resume")
    control(do="reset")
    session.until(lambda: not world.make_frame()["paused"])
    assert world.make_frame()["robot"]["x"] == pytest.approx(before, abs=0.01)


def test_what_a_topic_carries_is_sent_of_the_chosen_one_only(
    world: World, control: Callable[..., None]
) -> None:
    assert not any("last" in topic for topic in world.make_frame()["topics"])
    control(topic="/scan")
    (shown,) = [topic for topic in world.make_frame()["topics"] if "last" in topic]
    assert shown["name"] == "/scan"
    assert shown["last"]
    control(topic="")
    assert not any("last" in topic for topic in world.make_frame()["topics"])


def test_what_cannot_be_done_is_said(world: World, control: Callable[..., None]) -> None:
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"move": [99, 1, 1]}, "99"),
        ({"drive": ["fast", 0]}, "finite numbers"),
        ({"drive": [float("nan"), 0]}, "finite numbers"),
        ({"fault": ["wheels", "square"]}, "square"),
        ({"add": [True, 1]}, "finite numbers"),
    ]
    for message, said in wrong:
        control(**message)
        assert said in world.make_frame()["problem"]
        control(do="release_stop")
        assert world.make_frame()["problem"] == ""


def test_what_is_no_control_does_nothing(world: World, control: Callable[..., None]) -> None:
    before = world.make_frame()
    odd: list[dict[str, Any]] = [{}, {"do": "close"}, {"do": 1}, {"drive": 3}, {"speed": "1"}]
    for message in odd:
        control(**message)
    assert not world.simulation.closed
    after = world.make_frame()
    for name in ("faults", "obstacles", "paused", "speed", "problem"):
        assert after[name] == before[name]


def test_a_cell_has_the_same_controls(session: Session, world: World) -> None:
    world.press_stop()
    world.set_fault("camera", "unplugged")
    assert "Emergency stop pressed" in world.words()
    assert "Faults: camera unplugged." in repr(world)
    with pytest.raises(SessionError, match="square"):
        world.set_fault("wheels", "square")
    with pytest.raises(SessionError, match="finite numbers"):
        world.drive(math.inf, 0.0)


def test_a_path_that_a_node_publishes_is_drawn(session: Session, world: World) -> None:
    def planner() -> Node:
        node = Node("planner")
        publisher = node.create_publisher(PlannedPath, "plan", 1)
        message = PlannedPath()
        for x in (1.0, 2.0):
            pose = PoseStamped()
            pose.pose.position.x = x
            message.poses.append(pose)
        node.create_timer(0.05, lambda: publisher.publish(message))
        return node

    session.run(planner)
    session.until(lambda: world.make_frame()["path"] == [[1.0, 0.0], [2.0, 0.0]])
    assert "The planned path has 2 points" in world.words()


def test_a_world_ends_with_its_session_and_keeps_what_was_seen() -> None:
    with Session() as session:
        world = session.world("corridor")
        widget = world.widget
        frame = widget.frame
    assert widget.ended == live_view.CLOSED
    assert widget.frame.keys() == frame.keys()
    assert "Corridor" in world.words()
    assert world.picture().startswith("<svg")
    assert repr(world) == f"World: {live_view.CLOSED}"
    world._on_message(widget, {"do": "press_stop"}, [])
    assert world.simulation.closed


def test_a_new_world_of_a_session_ends_the_one_before(session: Session) -> None:
    first = session.world("warehouse")
    assert first.widget.ended == ""
    second = session.world("corridor")
    session.until(lambda: first.end_reason == ENDED)
    assert second.end_reason == ""
    assert "Corridor" in second.words()


LATER = """
world.add_obstacle(4.0, 1.0)
course.until(lambda: "1 obstacle." in world.widget.words)
course.close()
"""


@pytest.fixture
def kernel() -> Iterator[Kernel]:
    running = Kernel()
    yield running
    running.close()


def test_a_saved_notebook_has_a_picture_of_the_last_look(kernel: Kernel, tmp_path: Path) -> None:
    updates: list[str] = []

    def take(message: dict[str, Any]) -> None:
        if message["msg_type"] == "update_display_data":
            updates.append(message["content"]["data"]["text/html"])

    cells = "import course\nworld = course.world()\nworld", LATER
    assert kernel.run(cells[0])[0] == "ok"
    kernel.client.execute_interactive(cells[1], output_hook=take, timeout=150)
    (html,) = updates
    assert '<img src="data:image/svg+xml;base64,' in html
    assert "1 obstacle." in html
