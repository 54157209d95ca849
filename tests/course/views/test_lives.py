"""Lives of a node: what they leave behind is counted, drawn, and told in words."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import IO, ClassVar
from xml.etree import ElementTree

import pytest
from rclpy.node import Node
from std_msgs.msg import String

import course
from course.errors import SessionError, WaitTimeout
from course.views.lives import Lives
from course.watch.lives import Held

SVG = "{http://www.w3.org/2000/svg}"


class Talker(Node):
    """Publishes ten times a second."""

    def __init__(self) -> None:
        super().__init__("talker")
        self.words = self.create_publisher(String, "words", 10)
        self.create_timer(0.1, lambda: self.words.publish(String(data="word")))


class Leaky(Talker):
    """Leaves a thread, a file, and itself on the graph."""

    files: ClassVar[list[IO[str]]] = []
    over = threading.Event()

    def __init__(self) -> None:
        super().__init__()
        threading.Thread(target=self.over.wait, daemon=True).start()
        self.files.append(Path("/dev/null").open())  # noqa: SIM115

    def destroy_node(self) -> None:
        """Forget that rclpy has something to do, too."""


@pytest.fixture(autouse=True)
def _over() -> Iterator[None]:
    Leaky.over.clear()
    yield
    course.close()
    Leaky.over.set()
    for file in Leaky.files:
        file.close()
    Leaky.files.clear()


def test_a_node_that_leaves_nothing() -> None:
    lives = course.lives(lambda _: Talker(), "words", times=3)
    assert len(lives.held) == 4
    assert lives.left[1:] == [Held(0, 0, 0)] * 2
    assert lives.summary.startswith("3 lives: ")


def test_a_node_that_leaves_a_thread_a_file_and_a_node() -> None:
    numbers: list[int] = []

    def make(number: int) -> Node:
        numbers.append(number)
        return Leaky()

    lives = course.lives(make, "words", times=2)
    assert numbers == [0, 1, 2]
    for threads, files, ends in lives.left:
        assert threads >= 1
        assert files >= 1
        assert ends >= 1


def test_it_is_told_in_words_and_drawn() -> None:
    lives = Lives([Held(20, 30, 2), Held(21, 32, 2), Held(22, 34, 2)])
    assert lives.summary == "2 lives: 2 more threads, 4 more open files left behind."
    assert re.search(r"life 2 +22 \(\+1\) +34 \(\+2\) +2\b", repr(lives))
    html = lives._repr_html_()
    (drawn,) = re.findall(r"<svg.*</svg>", html)
    root = ElementTree.fromstring(drawn)
    assert root.get("aria-label") == lives.summary
    texts = [text.text for text in root.iter(f"{SVG}text")]
    assert [text for text in texts if text and ":" in text] == [
        "threads: +2",
        "open files: +4",
        "nodes and endpoints: none left",
    ]
    assert len([*root.iter(f"{SVG}rect")]) == 6
    assert len([*root.iter(f"{SVG}circle")]) == 3
    assert "life 1</th><td>21 (+1)</td><td>32 (+2)</td><td>2</td>" in html
    assert Lives([Held(9, 9, 9), Held(8, 9, 9)]).summary == "1 life: nothing left behind."
    assert Lives([Held(9, 9, 9), Held(9, 10, 9)]).summary == "1 life: 1 more open file left behind."


def test_what_makes_no_lives_is_a_sentence() -> None:
    with pytest.raises(SessionError, match="What makes a node is a function"):
        course.lives("Talker", "words")  # type: ignore[arg-type]
    with pytest.raises(SessionError, match="times is a whole number"):
        course.lives(lambda _: Talker(), "words", times=0)
    with pytest.raises(WaitTimeout, match="/silence"):
        course.lives(lambda _: Talker(), "silence", timeout=0.3)
    assert course.session().nodes == {}
