"""Several live views side by side: an operator's panel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from course.errors import SessionError
from course.views.shared.live_view import LiveView, has_front_end
from course.views.world import World

MOST_VIEWS = 8
"""Views of one panel: more do not fit on a screen."""

WORLD_PX, NARROWEST_PX = 440, 330
"""Width that a world and another view have at least: on a narrow page they go below each other."""


GAP = "8px"


class Panel:
    """Live views beside each other; a world is at the left of all others.

    Outside of a notebook, and for a screen reader, it is the words of its views.

    Attributes:
        views: what it shows, in order.
    """

    def __init__(self, views: Sequence[LiveView]) -> None:
        """Show ``views``.

        Raises:
            SessionError: there is none, or there are too many.
        """
        if not 0 < len(views) <= MOST_VIEWS:
            raise SessionError(f"A panel shows 1 to {MOST_VIEWS} views, not {len(views)}.")
        self.views = tuple(views)

    def __repr__(self) -> str:
        """Return the views in words."""
        return "\n\n".join(map(repr, self.views))

    def _ipython_display_(self) -> None:
        from IPython.display import display

        if not has_front_end() or all(view.end_reason for view in self.views):
            display({"text/plain": repr(self)}, raw=True)  # type: ignore[no-untyped-call]
            return
        display(self._make_box())  # type: ignore[no-untyped-call]
        for view in self.views:
            view.show_saved_copy()

    def _make_box(self) -> Any:
        """Return a widget with those of the views; it closes when the last of them does."""
        import ipywidgets

        widgets = [view.widget for view in self.views]
        worlds = [view.widget for view in self.views if isinstance(view, World)]
        others = [widget for widget in widgets if widget not in worlds]
        for widget in widgets:
            widget.layout = ipywidgets.Layout(min_width="0")
        instruments = ipywidgets.Box(
            others,
            layout=ipywidgets.Layout(
                display="grid", grid_gap=GAP, min_width="0", flex=f"2 1 {NARROWEST_PX}px",
                grid_template_columns=f"repeat(auto-fit, minmax(min(100%, {NARROWEST_PX}px), 1fr))",
            ),
        )  # fmt: skip
        for widget in worlds:
            widget.layout.flex = f"3 1 {WORLD_PX}px"
        box = ipywidgets.Box(
            [*worlds, instruments],
            layout=ipywidgets.Layout(
                display="flex", flex_flow="row wrap", align_items="flex-start", grid_gap=GAP
            ),
        )
        box.add_class("rospanel")

        def close_if_empty(_change: Any) -> None:
            if not any(widget.comm for widget in widgets):
                instruments.close()
                box.close()

        for widget in widgets:
            widget.observe(close_if_empty, "comm")
        return box
