"""What every live view shares: a frame for the browser, the same in words, and a bounded pace."""

from __future__ import annotations

import contextlib
import json
import threading
import time
from abc import ABC, abstractmethod
from typing import Any, ClassVar

from rclpy.exceptions import InvalidHandle

from course.runtime.core_session import CoreSession
from course.views.shared import truncate
from course.views.shared.live_widget import LiveWidget, widget_class
from course.views.shared.refresher import ticker_of
from course.views.shared.saved_copy import SavedCopy
from course.views.shared.view_registry import registry_of

MIN_PERIOD_S = 0.1
"""Seconds between two frames of most views: ten a second, whatever the publishers do."""

SLOW_PERIOD_S = 0.5
"""Seconds between two sendings of a view's `slow_parts`, and of its words if it has such parts."""

PATIENCE = 20
"""Frames that may be on their way before a browser that confirms none gets one a second only."""

STUMBLES = 5
"""Looks in a row that meet what has just been destroyed, before a view gives up."""

MAX_FRAME_BYTES = 256 * 1024
"""Bytes of JSON that a frame may have; a view cuts what it shows to stay below (see `truncate`)."""

MAX_WORDS_CHARS = 15_000
"""Characters of its words that a view sends along."""

CLOSED = "The session has been closed."

Frame = dict[str, Any]


class LiveView(ABC):
    """A view of a session that keeps itself up to date while somebody looks at it.

    A subclass says what there is to see (`make_frame`, `words`) and what a control does
    (`handle_control`), and leaves in `resources` whatever is to be given back when the view ends.
    In a notebook it shows a widget; anywhere else, and for a screen reader, its words.

    A view ends with its session, when its widget is closed, or when the cell that made it is run
    again (see `view_registry`).
    """

    label: ClassVar[str] = ""
    """What people call the view."""

    script: ClassVar[str] = ""
    """Name of the view's own script and style in ``static``."""

    shared: ClassVar[tuple[str, ...]] = ()
    """Further scripts and styles that it uses."""

    period: ClassVar[float] = MIN_PERIOD_S
    """Seconds between two looks at the model."""

    fixed_parts: ClassVar[tuple[str, ...]] = ()
    """Keys of its frame that never change: they are sent once."""

    slow_parts: ClassVar[tuple[str, ...]] = ()
    """Keys of its frame that may come late: they are sent every `SLOW_PERIOD_S`, and at once after
    a control was used. A view of more than ten frames a second stays small so."""

    def __init__(self, session: CoreSession, *about: Any) -> None:
        """Show what happens in ``session``; ``about`` tells views of one kind from each other."""
        self.session = session
        self.resources = contextlib.ExitStack()
        self._widget: LiveWidget | None = None
        self._due = self._slow_due = 0.0
        self._last = ""
        self._drawn = 0
        self._stumbles = 0
        self._why = ""
        self._seen_at = ""
        self._copy = SavedCopy(self.label)
        self._looking = threading.RLock()
        registry_of(session).put(self, (type(self).__qualname__, repr(about)))

    @abstractmethod
    def make_frame(self) -> Frame:
        """Return what is to be drawn now, as JSON data of a bounded size."""

    @abstractmethod
    def words(self) -> str:
        """Return what there is to see now, as text."""

    def look(self) -> tuple[Frame, str]:
        """Return both, of one and the same moment."""
        return self.make_frame(), self.words()

    def picture(self) -> str:
        """Return an SVG document of what was shown last, for a saved notebook; "" for none."""
        return ""

    @property
    def standstill(self) -> str:
        """Why the last look is not of now, as a sentence; empty if it is of now."""
        return ""

    def handle_control(self, message: dict[str, Any]) -> None:  # noqa: B027 - some views have no controls
        """Do what a control in the browser asks for.

        Runs in a thread of the kernel's, also while a cell runs.
        """

    @property
    def widget(self) -> LiveWidget:
        """The widget that shows this view; made, and kept up to date, from its first use."""
        if self._widget is None:
            self._widget = widget_class((*self.shared, self.script))(kind=self.script)
            self._widget.on_msg(self._on_message)
            self._refresh_widget()
            self._widget.ended = self._end_text()
            if not self._why:
                self._widget.observe(self._on_close, "comm")
                self._widget.comm.on_close(self._on_close)
                self._due = time.monotonic() + self.period
                ticker_of(self.session).add(self)
        return self._widget

    @property
    def end_reason(self) -> str:
        """Why nothing comes any more; empty while the view is live."""
        return self._why or (CLOSED if self.session.closed else "")

    def tick(self, now: float) -> float:
        """Send a frame if one is due and something has changed; return when the next is due."""
        if self.session.closed:  # or its context has been shut down under it
            self.end(CLOSED)
        elif now >= self._due:
            self._refresh_widget()
            slow = self._widget is not None and self._widget.number - self._drawn > PATIENCE
            self._due = time.monotonic() + (max(1.0, self.period) if slow else self.period)
            if self._copy.is_due:
                self._save_copy()
        return self._due

    def take_last_look(self) -> None:
        """Show what there is to see now, as it will soon be gone."""
        self._refresh_widget()

    def end(self, why: str, *, close: bool = False) -> None:
        """Give back what the view holds, and say in it that nothing will come any more. Idempotent.

        ``close`` takes the widget off the page and out of the kernel's memory, too: the words that
        it left in its output (see `static_fallback`) are shown in its place.
        """
        with self._looking:  # nothing is sent after this
            first, self._why = not self._why, self._why or why
        if first:
            ticker_of(self.session).forget(self)
            self._save_copy()
            self.resources.close()
            if self._widget is not None:
                self._widget.ended = self._end_text()
        if close or self._widget is None:
            registry_of(self.session).forget(self)
            if self._widget is not None:
                self._widget.close()

    def stop(self) -> None:
        """End this view; it says so. Idempotent."""
        self.end("This view has been stopped.")

    def __repr__(self) -> str:
        """Return the view in words."""
        return f"{self.label}: {self.end_reason}" if self.end_reason else self.words()

    def _repr_mimebundle_(self, **kwargs: Any) -> Any:
        # A script, a test, a grader: nobody could look at a widget. And one that is over says so.
        if not has_front_end() or self.end_reason:
            return {"text/plain": repr(self)}, {}
        bundle = self.widget._repr_mimebundle_(**kwargs)
        data, metadata = bundle if isinstance(bundle, tuple) else (bundle or {}, {})
        return {**data, "text/plain": repr(self)}, metadata

    def _ipython_display_(self, **kwargs: Any) -> None:
        from IPython.display import display

        data, metadata = self._repr_mimebundle_(**kwargs)
        display(data, metadata=metadata, raw=True)  # type: ignore[no-untyped-call]
        if len(data) > 1:
            self.show_saved_copy()

    def show_saved_copy(self) -> None:
        """Leave what a saved notebook shows in this view's place under the cell that runs."""
        self._copy.show(repr(self), self.picture())

    def _save_copy(self) -> None:
        if self._widget is not None:
            words = "\n\n".join(filter(None, [self._widget.notice, self._widget.words]))
            self._copy.replace(words, self.picture())

    def _end_text(self) -> str:
        """Return why the view has ended, and of when its last picture is."""
        if self._why and self._seen_at:
            return f"{self._why} This is how it was at {self._seen_at}."
        return self._why

    def _refresh_widget(self) -> None:
        with self._looking:
            widget = self._widget
            if widget is None or self._why:
                return
            try:
                frame, words = self.look()
                words = truncate.cut_text(words, MAX_WORDS_CHARS)
                text = json.dumps([frame, words])
                self._stumbles = 0
            except Exception as error:  # noqa: BLE001 - a view must never take its thread down
                self._stumbles += 1
                if isinstance(error, InvalidHandle) and self._stumbles < STUMBLES:
                    return  # a node was destroyed under this look: the next one will not see it
                failed = f"This view has stopped ({type(error).__name__}: {error})."
                self.end(CLOSED if self.session.closed else failed)
                return
            still = self.standstill
            if not still:
                self._seen_at = time.strftime("%H:%M:%S")
            if text == self._last:
                if widget.notice != still:
                    widget.notice = still
                return
            late = bool(self.slow_parts) and time.monotonic() < self._slow_due
            self._last = "" if late else text
            if len(text) > MAX_FRAME_BYTES:
                widget.notice = (
                    f"What there is to see now is too large to draw ({len(text) // 1024} KiB), so "
                    "this is older. In a cell, the view's words() has all of it."
                )
                return
            fixed = {name: frame.pop(name) for name in self.fixed_parts}
            slow = {name: frame.pop(name) for name in self.slow_parts}
            with widget.hold_sync():  # of what is set here, only what has changed is sent
                widget.frame, widget.fixed, widget.notice = frame, fixed, still
                if not late:
                    widget.slow, widget.words = slow, words
                    self._slow_due = time.monotonic() + SLOW_PERIOD_S
                widget.number += 1

    def _on_close(self, _change: Any) -> None:
        """End when somebody has closed the widget, here or in the browser."""
        self.end("Its widget has been closed.", close=True)

    def _on_message(self, _widget: Any, message: Any, _buffers: Any) -> None:
        if not isinstance(message, dict):
            return
        if isinstance(message.get("drawn"), int):
            self._drawn = max(self._drawn, message["drawn"])
        elif "hello" in message:
            assert self._widget is not None
            self._widget.send({"here": True})
        else:
            self.handle_control(message)
            self._slow_due = 0.0


def has_front_end() -> bool:
    """Return whether this code runs in a kernel."""
    from IPython.core.getipython import get_ipython

    return hasattr(get_ipython(), "kernel")
