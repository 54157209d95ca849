"""Where the boxes and arrows of a graph are drawn: arrows and their labels stay apart."""

from __future__ import annotations

from course.graph import layout
from course.graph.model import Endpoint, Graph, Mismatch, Topic

TYPE = "std_msgs/msg/String"


def robot(*topics: str, refused: str = "") -> Graph:
    """A camera that publishes topics and a display that reads them, one of them in vain."""
    return Graph(
        ("/camera", "/display"),
        tuple(
            Topic(
                name,
                (Endpoint("/camera", "publisher", TYPE),),
                (Endpoint("/display", "subscription", TYPE),),
                (Mismatch("/camera", "/display", ("",), ("RELIABILITY",)),) * (name == refused),
            )
            for name in topics
        ),
    )


def test_an_empty_graph_has_no_size() -> None:
    assert layout.draw(Graph()) == layout.Drawing((), (), 0, 0)


def test_arrows_that_end_at_one_box_end_beside_each_other() -> None:
    drawing = layout.draw(robot("/a", "/b", "/c"))
    display = next(box for box in drawing.boxes if box.label == "/display")
    ends = [float(line.path.rpartition(",")[2]) for line in drawing.lines]
    here = sorted(y for line, y in zip(drawing.lines, ends, strict=True) if "requests" in line.tip)
    assert len(set(here)) == 3
    assert display.y < here[0]
    assert here[-1] < display.y + display.height
    topics = sorted((box.y, box.label) for box in drawing.boxes if box.kind == "topic")
    assert len({y for y, _ in topics}) == 3


def test_a_label_has_room_between_the_boxes() -> None:
    drawing = layout.draw(robot("/a", "/b", refused="/b"))
    (label,) = (line for line in drawing.lines if line.label)
    assert (label.label, label.bad) == ("reliability", True)
    half = len(label.label) * 8 / 2
    for box in drawing.boxes:
        assert box.x + box.width < label.x - half or label.x + half < box.x
