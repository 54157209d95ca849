"""What a session shows of itself: the live views, each made on demand."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rclpy.node import Node

from course.runtime.asking import Asking

if TYPE_CHECKING:
    from course.views.graph import GraphView


class Showing(Asking):
    """The part of a Session that shows things. Widgets are imported when one is asked for."""

    @property
    def observer(self) -> Node:
        """The hidden node through which the session looks at the graph."""
        return self._probe.node

    def graph(self, *, everything: bool = False) -> GraphView:
        """Return a live view of the ROS graph as this session sees it.

        Args:
            everything: show what the ROS tools hide, too: /rosout, parameter services and the like.

        Raises:
            SessionError: the session is closed.
        """
        from course.views.graph import GraphView

        self._require_open()
        return GraphView(self, everything=everything)  # type: ignore[arg-type]  # we are a Session
