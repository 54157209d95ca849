"""Where the boxes and arrows of a graph are drawn: arrows and their labels stay apart."""

from __future__ import annotations

from course.graph import layout
from course.graph.mermaid import draw_mermaid
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
    assert layout.draw_graph(Graph()) == layout.Drawing((), (), 0, 0)


def test_arrows_that_end_at_one_box_end_beside_each_other() -> None:
    drawing = layout.draw_graph(robot("/a", "/b", "/c"))
    display = next(box for box in drawing.boxes if box.label == "/display")
    ends = [float(line.path.rpartition(",")[2]) for line in drawing.lines]
    here = sorted(y for line, y in zip(drawing.lines, ends, strict=True) if "requests" in line.tip)
    assert len(set(here)) == 3
    assert display.y < here[0]
    assert here[-1] < display.y + display.height
    topics = sorted((box.y, box.label) for box in drawing.boxes if box.kind == "topic")
    assert len({y for y, _ in topics}) == 3


def test_a_label_has_room_between_the_boxes() -> None:
    drawing = layout.draw_graph(robot("/a", "/b", refused="/b"))
    (label,) = (line for line in drawing.lines if line.label)
    assert (label.label, label.bad) == ("reliability", True)
    half = len(label.label) * 8 / 2
    for box in drawing.boxes:
        assert box.x + box.width < label.x - half or label.x + half < box.x


def crowd(writers: str, readers: str, *broken: str) -> tuple[Graph, set[str], dict[str, str]]:
    """Return the graph of one topic, its red arrows, and their labels; a pair is as in "ax"."""
    graph = Graph(
        tuple(f"/{name}" for name in writers + readers),
        (
            Topic(
                "/t",
                tuple(Endpoint(f"/{name}", "publisher", TYPE) for name in writers),
                tuple(Endpoint(f"/{name}", "subscription", TYPE) for name in readers),
                tuple(Mismatch(f"/{w}", f"/{r}", ("",), ("DURABILITY",)) for w, r in broken),
            ),
        ),
    )
    lines = layout.draw_graph(graph).lines
    red = {line.tip[1] for line in lines if line.bad}
    return graph, red, {line.tip[1]: line.label for line in lines if line.label}


def test_a_broken_pair_is_red_from_end_to_end_and_says_why_once() -> None:
    _, red, labels = crowd("a", "x", "ax")
    assert (red, labels) == ({"a", "x"}, {"x": "durability"})


def test_of_two_publishers_only_the_one_that_nobody_hears_is_red() -> None:
    graph, red, labels = crowd("ab", "x", "ax")
    assert (red, labels) == ({"a"}, {"a": "durability"})
    assert "linkStyle 0 stroke" in draw_mermaid(graph)
    assert draw_mermaid(graph).count("does not fit") == 1


def test_of_two_readers_only_the_deaf_one_is_red() -> None:
    _, red, labels = crowd("a", "xy", "ax")
    assert (red, labels) == ({"x"}, {"x": "durability"})


def test_a_pair_between_two_that_connect_with_others_is_still_told() -> None:
    _, red, labels = crowd("ab", "xy", "ax")
    assert (red, labels) == ({"x"}, {"x": "durability"})


def test_the_qos_of_every_endpoint_of_a_node_is_told_at_its_arrow() -> None:
    reliable, lossy = ({"reliability": name} for name in ("RELIABLE", "BEST_EFFORT"))
    writers = tuple(Endpoint("/a", "publisher", TYPE, qos) for qos in (reliable, lossy, lossy))
    readers = (Endpoint("/x", "subscription", TYPE, reliable),)
    broken = (Mismatch("/a", "/x", ("offers BEST_EFFORT",), ("RELIABILITY",)),)
    lines = layout.draw_graph(Graph(("/a", "/x"), (Topic("/t", writers, readers, broken),))).lines
    (tip,) = (line.tip for line in lines if "offers" in line.tip.splitlines()[0])
    assert tip.splitlines()[:2] == ["/a offers RELIABLE", "/a offers BEST_EFFORT"]
