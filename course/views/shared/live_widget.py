"""The browser's end of a live view: one class of widget for each script."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import anywidget
import traitlets

from course.views.shared.comm_route import keep_senders_choice

_STATIC = Path(__file__).parents[1] / "static"


class LiveWidget(anywidget.AnyWidget):
    """The browser's end of a view. It draws `make_frame` and knows nothing of ROS.

    Attributes:
        fixed: what a drawing needs and never changes; JSON data, sent once.
        slow: what a drawing needs and changes seldom, or may be late; JSON data.
        frame: what to draw now; JSON data.
        words: the same as text, for screen readers.
        ended: why nothing comes any more; empty while the view is live.
        notice: what else should be known of what is shown.
        number: counts frames; the browser sends back the number that it has drawn.
    """

    kind = traitlets.Unicode().tag(sync=True)
    fixed = traitlets.Dict().tag(sync=True)
    slow = traitlets.Dict().tag(sync=True)
    frame = traitlets.Dict().tag(sync=True)
    words = traitlets.Unicode().tag(sync=True)
    ended = traitlets.Unicode().tag(sync=True)
    notice = traitlets.Unicode().tag(sync=True)
    number = traitlets.Int().tag(sync=True)

    def open(self) -> None:
        """Open the way to the browser, if that has not been done."""
        super().open()
        if self.comm is not None:
            keep_senders_choice(self.comm)


@cache
def widget_class(parts: tuple[str, ...]) -> type[LiveWidget]:
    """Return the widget class of a view: its script and style are of the class, as anywidget's are.

    Script and style are one text each: a browser cannot import the shared parts from beside it.
    """
    names = ("live", *parts)
    texts = {
        f"_{key}": "\n".join((_STATIC / f"{name}.{kind}").read_text("utf-8") for name in names)
        for key, kind in (("esm", "js"), ("css", "css"))
    }
    name = f"{parts[-1].title()}Widget"
    return type(name, (LiveWidget,), {**texts, "_anywidget_id": f"{__name__}.{name}"})
