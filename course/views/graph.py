"""The ROS graph, live: nodes, topics, services and actions, and what does not connect."""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Any

from course.graph import graph_text, layout, reader
from course.graph.mermaid import draw_mermaid
from course.graph.model import Graph
from course.messages.yaml_text import format_count
from course.runtime.core_session import CoreSession
from course.views.pictures.graph_svg import draw_graph_svg
from course.views.shared.live_view import Frame, LiveView

MAX_BOXES = 150
"""Boxes that are drawn; a larger graph is in the words only."""


class GraphView(LiveView):
    """The graph as a session sees it; `graph` is the present snapshot as data.

    A graph of more than `MAX_BOXES` boxes is not drawn: a note says so, and how to see less.
    As text it is a list of every topic, service and action with their endpoints and QoS.
    """

    label = "ROS graph"
    script = "graph"
    period = 0.5  # s: a graph changes when somebody runs a cell, not ten times a second

    def __init__(self, session: CoreSession, *, everything: bool = False) -> None:
        """Show the graph of ``session``, with all that the ROS tools hide if ``everything``."""
        super().__init__(session, everything)
        self._everything = everything
        self._shown = Graph()
        self._still_since = ""

    @property
    def graph(self) -> Graph:
        """What is there now."""
        self.session.require_open()
        own = list(self.session.nodes.values())
        return reader.read_graph(self.session.observer, everything=self._everything, own=own)

    @property
    def mermaid(self) -> Mermaid:
        """A drawing that stays in a saved notebook: the last expression of a cell shows it."""
        return Mermaid(draw_mermaid(self.graph))

    def make_frame(self) -> Frame:
        """Return boxes and lines with their places."""
        return self._drawing_frame(self.graph)

    def words(self) -> str:
        """Return the graph as text."""
        return graph_text.describe_graph(self.graph)

    def look(self) -> tuple[Frame, str]:
        """Return both from one look at the graph; when the last node goes, the graph stays."""
        graph = self.graph
        if graph.nodes or not self._shown.nodes:
            self._shown, self._still_since = graph, ""
        elif not self._still_since:
            self._still_since = time.strftime("%H:%M:%S")
        return self._drawing_frame(self._shown), graph_text.describe_graph(self._shown)

    def picture(self) -> str:
        """Return the drawing that was shown last."""
        return draw_graph_svg(self._drawing_frame(self._shown)) if self._shown.nodes else ""

    @property
    def standstill(self) -> str:
        """That no node runs any more, once one did."""
        if not self._still_since:
            return ""
        return f"No node runs any more since {self._still_since}: this is the last graph before."

    def _drawing_frame(self, graph: Graph) -> Frame:
        apart = graph.mismatches
        title = (
            f"{format_count(len(graph.nodes), 'node')}, "
            f"{format_count(len(graph.topics), 'topic')}, "
            f"{format_count(len(apart), 'pair')} that {'does' if len(apart) == 1 else 'do'} not "
            "connect"
        )
        # Counted first: the layout of a graph that nobody could follow takes long, too.
        count = layout.count_boxes(graph)
        if count > MAX_BOXES:
            none, note = layout.Drawing((), (), 0, 0), self._too_large(graph, count)
            return {"title": title, "note": note, **asdict(none)}
        wide, tall = (asdict(layout.draw_graph(graph, way)) for way in layout.WAYS)
        return {"title": title, "note": "", **wide, "tall": tall}

    def _too_large(self, graph: Graph, count: int) -> str:
        exchanges = len(graph.services) + len(graph.actions)
        less = "stop the nodes that you do not need, as with course.stop('talker')"
        if self._everything:
            less = f"leave out everything=True, or {less}"
        return (
            f"This graph has {count} boxes (nodes: {len(set(graph.nodes))}, topics: "
            f"{len(graph.topics)}, services and actions: {exchanges}), and nobody can follow a "
            f"drawing of more than {MAX_BOXES}. To see it drawn, {less}. In a cell, print(…) of "
            "this view tells all of it in words."
        )


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
