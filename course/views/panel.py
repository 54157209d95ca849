"""Several live views side by side: an operator's panel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from course.errors import SessionError
from course.views.shared.live_view import LiveView, has_front_end
from course.views.world import World

MOST_VIEWS = 8
"""Views of one panel: more do not fit on a screen."""

NARROWEST_PX = 330
"""Width below which there are fewer views in a row."""


class Panel:
    """Live views in a grid; a world has a row of its own.

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
        for view, widget in zip(self.views, widgets, strict=True):
            widget.layout = ipywidgets.Layout(
                min_width="0", grid_column="1 / -1" if isinstance(view, World) else None
            )
        box = ipywidgets.Box(
            widgets,
            layout=ipywidgets.Layout(
                display="grid", grid_gap="8px", width="100%",
                grid_template_columns=f"repeat(auto-fit, minmax(min(100%, {NARROWEST_PX}px), 1fr))",
            ),
        )  # fmt: skip
        box.add_class("rospanel")

        def close_if_empty(_change: Any) -> None:
            if not any(widget.comm for widget in widgets):
                box.close()

        for widget in widgets:
            widget.observe(close_if_empty, "comm")
        return box
