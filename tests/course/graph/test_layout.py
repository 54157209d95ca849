"""Where the boxes and arrows of a graph are drawn: arrows and their labels stay apart."""

from __future__ import annotations

import subprocess
import sys

import pytest

from course import Design
from course.graph import layout
from course.graph.labels import LINE_PX, Rectangle, label_width
from course.graph.mermaid import draw_mermaid
from course.graph.model import Endpoint, Exchange, Graph, Mismatch, Topic

TYPE = "std_msgs/msg/String"


WHY = "offers BEST_EFFORT, requests RELIABLE"
QOS = {"reliability": "RELIABLE", "durability": "VOLATILE", "history": "KEEP_LAST", "depth": "10"}


def robot(*topics: str, refused: str = "") -> Graph:
    """A camera that publishes topics and a display that reads them, one of them in vain."""
    return Graph(
        ("/camera", "/display"),
        tuple(
            Topic(
                name,
                (Endpoint("/camera", "publisher", TYPE, {**QOS, "reliability": "BEST_EFFORT"}),),
                (Endpoint("/display", "subscription", TYPE, QOS),),
                (Mismatch("/camera", "/display", (WHY,), ("RELIABILITY",)),) * (name == refused),
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


@pytest.mark.parametrize("way", layout.WAYS)
def test_each_arrow_says_its_qos_where_nothing_else_stands(way: layout.Way) -> None:
    drawing = layout.draw_graph(robot("/a", "/b", refused="/b"), way)
    assert [line.qos for line in drawing.lines if not line.bad] == [
        "best effort · volatile · 10",
        "reliable · volatile · 10",
    ]
    (broken,) = (line for line in drawing.lines if line.reasons)
    assert broken.bad
    assert " ".join(broken.reasons) == "reliability: offers best effort, requests reliable"
    taken = [Rectangle(b.x, b.y, b.x + b.width, b.y + b.height) for b in drawing.boxes]
    for line in drawing.lines:
        texts = (line.qos, *line.reasons)
        half, top = label_width(texts) / 2, line.y - LINE_PX / 2
        place = Rectangle(line.x - half, top, line.x + half, top + LINE_PX * len(texts))
        assert not any(place.overlap(other) for other in taken)
        assert place.left >= drawing.left
        assert place.right <= drawing.left + drawing.width
        taken.append(place)


def test_a_tall_drawing_is_narrow_and_flows_downwards() -> None:
    wide, tall = (layout.draw_graph(robot("/a", "/b"), way) for way in layout.WAYS)
    assert tall.width < wide.width / 1.5
    tops = [{box.y for box in tall.boxes if box.label == name} for name in ("/camera", "/a")]
    assert max(tops[0]) < min(tops[1])


def test_what_nobody_uses_stands_beside_its_server() -> None:
    graph = robot("/a")
    sent, read = Endpoint("/display", "publisher", TYPE), Endpoint("/last", "subscription", TYPE)
    graph = Graph(
        (*graph.nodes, "/last"),
        (*graph.topics, Topic("/b", (sent,), (read,))),
        (Exchange("/lamp", "std_srvs/srv/SetBool", ("/last",)),),
    )
    boxes = {box.label: box for box in layout.draw_graph(graph, "tall").boxes}
    assert boxes["/lamp"].y == boxes["/b"].y


def test_arrows_touch_the_outline_of_an_ellipse() -> None:
    drawing = layout.draw_graph(robot("/a", "/b", "/c"))
    display = next(box for box in drawing.boxes if box.label == "/display")
    a, b = display.width / 2, display.height / 2
    for line in drawing.lines:
        x, y = map(float, line.path.rpartition(" ")[2].split(","))
        if "requests" in line.tip:
            share = ((x - display.x - a) / a) ** 2 + ((y - display.y - b) / b) ** 2
            assert share == pytest.approx(1, abs=0.01)


def test_one_convention_for_the_shapes_of_every_drawing() -> None:
    graph = draw_mermaid(robot("/a"))
    design = Design()
    design.node("camera").publishes("/a", TYPE, 10)
    drawn = design._repr_mimebundle_()["text/vnd.mermaid"]
    assert '(["/camera"])' in graph
    assert '(["<b>camera</b>"])' in drawn
    assert '["/a<br/>String"]' in graph.replace("([", "")
    assert '["/a<br/><small>String</small>"]' in drawn.replace("([", "")
    shapes = {box.kind: box.outline for box in layout.draw_graph(robot("/a")).boxes}
    assert " a" in shapes["node"], "an ellipse"
    assert " a" not in shapes["topic"], "a box"


def crowd(writers: str, readers: str, *broken: str) -> tuple[Graph, set[str], dict[str, str]]:
    """Return the graph of one topic, its red arrows, and their labels; a pair is as in "ax"."""
    graph = Graph(
        tuple(f"/{name}" for name in writers + readers),
        (
            Topic(
                "/t",
                tuple(Endpoint(f"/{name}", "publisher", TYPE) for name in writers),
                tuple(Endpoint(f"/{name}", "subscription", TYPE) for name in readers),
                tuple(Mismatch(f"/{w}", f"/{r}", (), ("DURABILITY",)) for w, r in broken),
            ),
        ),
    )
    lines = layout.draw_graph(graph).lines
    red = {line.tip[1] for line in lines if line.bad}
    return graph, red, {line.tip[1]: line.reasons[0] for line in lines if line.reasons}


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


LAY_OUT = """
import random, types
from course.graph.layout import _find_layers

source = random.Random(1)
for _ in range(3000):
    number = source.randint(2, 40)
    keys = [("node", f"/n{at}") for at in range(number)]
    half = number // 2
    links = []
    for _ in range(source.randint(0, 3 * half)):
        ends = [source.choice(keys[:half]), source.choice(keys[half:])]
        source.shuffle(ends)
        links.append(types.SimpleNamespace(source=ends[0], target=ends[1]))
    layers = _find_layers(keys, links)
    assert sorted(key for layer in layers for key, _ in layer) == sorted(keys)
"""


def test_no_graph_takes_the_process_with_it() -> None:
    """Of igraph, version 1.0.0 did: in another process, as a crash would end this one."""
    done = subprocess.run(
        [sys.executable, "-c", LAY_OUT], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
