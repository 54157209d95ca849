"""The ROS graph, live: nodes, topics, services and actions, and what does not connect."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from course.graph import layout, reader, words
from course.graph.mermaid import mermaid
from course.graph.model import Graph
from course.runtime.session import Session
from course.views.live import Frame, LiveView

MAX_BOXES = 150
"""Boxes that are drawn; of a larger graph the rest is in the words only."""


class GraphView(LiveView):
    """The graph as a session sees it; `graph` is the present snapshot as data.

    As text it is a list of every topic, service and action with their endpoints and QoS.
    """

    label = "ROS graph"
    script = "graph"
    period = 0.5  # s: a graph changes when somebody runs a cell, not ten times a second

    def __init__(self, session: Session, *, everything: bool = False) -> None:
        """Show the graph of ``session``, with all that the ROS tools hide if ``everything``."""
        super().__init__(session, everything)
        self._everything = everything

    @property
    def graph(self) -> Graph:
        """What is there now."""
        self.session._require_open()
        own = list(self.session.nodes.values())
        return reader.read(self.session.observer, everything=self._everything, own=own)

    @property
    def mermaid(self) -> Mermaid:
        """A drawing that stays in a saved notebook: the last expression of a cell shows it."""
        return Mermaid(mermaid(self.graph))

    def frame(self) -> Frame:
        """Return boxes and lines with their places."""
        return _drawn(self.graph)

    def words(self) -> str:
        """Return the graph as text."""
        return words.describe(self.graph)

    def look(self) -> tuple[Frame, str]:
        """Return both from one look at the graph."""
        graph = self.graph
        return _drawn(graph), words.describe(graph)


def _drawn(graph: Graph) -> Frame:
    drawing = layout.draw(graph)
    if len(drawing.boxes) > MAX_BOXES:
        text = f"{len(drawing.boxes)} boxes are too many to draw: see the words."
        return {"title": text, "boxes": [], "lines": [], "width": 0, "height": 0}
    return {
        "title": f"{len(graph.nodes)} nodes, {len(graph.topics)} topics, "
        f"{len(graph.mismatches)} pairs that do not connect",
        **asdict(drawing),
    }


class Mermaid:
    """Mermaid text that JupyterLab draws, with a kernel or without."""

    def __init__(self, text: str) -> None:
        """Show ``text``."""
        self.text = text

    def __repr__(self) -> str:
        """Return the text itself."""
        return self.text

    def _repr_mimebundle_(self, **_: Any) -> dict[str, str]:
        return {"text/vnd.mermaid": self.text, "text/plain": self.text}
