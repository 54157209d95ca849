"""Puts together what the cells of a notebook show, of the messages that a kernel publishes.

It does what a page does: text of one stream is joined, a display can be updated from a later cell,
`clear_output` clears, and an `Output` widget shows what was printed within it. All within bounds,
as the messages come: a cell that prints for ever is not one that needs too much memory.
"""

from __future__ import annotations

import os
import threading
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any

from autograder.examination.subject.outputs import (
    CUT,
    MAX_SHOWN_BYTES,
    MAX_TEXT_CHARS,
    Output,
    displayable_data,
    error_output,
    is_data,
    is_error,
    json_size,
    only_error,
    shortened_text,
    stream_output,
)

_OVERHEAD_BYTES = 1000  # bytes that an output counts as, beside what is in it
_VIEW = "application/vnd.jupyter.widget-view+json"
MAX_WIDGETS = 1000
"""`Output` widgets of a notebook; what is printed within more of them is the cell's own."""

Message = dict[str, Any]


class _Entry:
    """One output; the text of a stream comes in parts."""

    def __init__(self, output: Output, display_id: Any = None, view: str = "") -> None:
        self.output = output
        self.display_id = display_id
        self.view = view
        self.parts: list[str] = []


class _Area:
    """What is shown in one place: under a cell, or in a widget."""

    def __init__(self) -> None:
        self.changed = False
        self.clear()

    def clear(self) -> None:
        """Show nothing: what comes has all the room again."""
        self.entries: list[_Entry] = []
        self.changed = True
        self._clear_first = False
        self._room, self._cut = MAX_SHOWN_BYTES, False
        self._left = {"stdout": MAX_TEXT_CHARS, "stderr": MAX_TEXT_CHARS}
        self._dropped = {"stdout": 0, "stderr": 0}
        self._last_error: _Entry | None = None

    def clear_later(self) -> None:
        """Clear when something new comes."""
        self._clear_first = True

    def reserve_room(self, name: str, length: int) -> int:
        """Return how many of so many characters of a stream are kept; the others are counted."""
        if self._clear_first and length:
            self.clear()
        kept = max(min(self._left[name], length), 0) if self._room > 0 else 0
        self._left[name] -= kept
        self._dropped[name] += length - kept
        self.changed = self.changed or kept < length
        return kept

    def write(self, name: str, text: str) -> None:
        """Add text of a stream that was found to fit."""
        if not self.entries or self.entries[-1].output.get("name") != name:
            self.add(_Entry(stream_output("", name)))
        if self.entries and self.entries[-1].output.get("name") == name:
            self.entries[-1].parts.append(text)
            self.changed = True

    def add(self, entry: _Entry) -> None:
        """Add an output, if there is room for it."""
        if self._clear_first:
            self.clear()
        self.changed = True
        self._room -= _OVERHEAD_BYTES + json_size(entry.output)
        if self._room >= 0:
            self.entries.append(entry)
            return
        self._cut = True
        if is_error(entry.output):
            self._last_error = entry  # whatever else is dropped: it was not right

    def update_display(
        self, display_id: Any, data: dict[str, Any], metadata: dict[str, Any]
    ) -> None:
        """Show something else where ``display_id`` is shown."""
        for entry in self.entries:
            if entry.display_id == display_id and self._room >= 0:
                before = json_size(entry.output)
                entry.output = {**entry.output, "data": data, "metadata": metadata}
                self._room += before - json_size(entry.output)
                self.changed = True

    def shown_entries(self) -> Iterator[_Entry]:
        """Yield what is shown, and that something was cut off."""
        last = {entry.output.get("name"): entry for entry in self.entries}
        for entry in self.entries:
            name = entry.output.get("name")
            if name is not None:
                dropped = self._dropped[name] if entry is last[name] else 0
                entry = _Entry(stream_output(shortened_text("".join(entry.parts), dropped), name))
            yield entry
        if self._cut:
            yield _Entry(stream_output(CUT))
        if self._last_error is not None:
            yield self._last_error


class Recording:
    """What all cells show. Threads may publish at the same time."""

    def __init__(self) -> None:
        """Begin with no cell."""
        self._lock = threading.RLock()
        self._process = os.getpid()
        self._areas: dict[str, _Area] = {}  # by the id of the message that asked for the cell
        self._numbers: dict[str, int] = {}
        self._widgets: dict[str, _Area] = {}  # by the id of an `Output` widget
        self._within: dict[str, list[str]] = defaultdict(list)  # the widgets that a cell prints in

    def begin_cell(self, number: int, request: str) -> None:
        """Have what ``request``, the id of a message, leads to shown under a cell."""
        with self._lock:
            self._numbers[request], self._areas[request] = number, _Area()

    def take_changes(self) -> dict[int, list[Output]]:
        """Return the outputs of those cells that have changed since this was last asked."""
        with self._lock:
            news = {id(area) for area in self._all_areas() if area.changed}
            found = {
                number: _bounded_outputs(self._areas[request], self._widgets)
                for request, number in self._numbers.items()
                if news.intersection(_seen_in(self._areas[request], self._widgets))
            }
            for area in self._all_areas():
                area.changed = False
            return found

    def reserve_room(self, name: str, request: str, length: int) -> int:
        """Return how many of so many characters that a cell prints are kept."""
        with self._lock:
            area = self._find_area(request)
            return area.reserve_room(name, length) if area is not None else 0

    def take_message(self, message: Message) -> None:
        """Add what a message is about. A process that a cell has forked shows nothing here."""
        if os.getpid() != self._process:
            return
        with self._lock:
            kind, content = message["header"]["msg_type"], message["content"]
            request = (message.get("parent_header") or {}).get("msg_id", "")
            if kind in ("comm_open", "comm_msg"):
                self._note_widget(content, request)
            elif kind == "update_display_data":
                self._update_displays(content)
            elif (area := self._find_area(request)) is not None:
                _add_message(area, kind, content)

    def _find_area(self, request: str) -> _Area | None:
        within = self._within.get(request)
        return self._widgets[within[-1]] if within else self._areas.get(request)

    def _all_areas(self) -> Iterator[_Area]:
        yield from self._areas.values()
        yield from self._widgets.values()

    def _note_widget(self, content: dict[str, Any], request: str) -> None:
        """Note an `Output` widget, and which of a cell's messages it wants to have."""
        data = content.get("data")
        state = data.get("state") if isinstance(data, dict) else None
        if not isinstance(state, dict):
            return
        widget = content["comm_id"]
        if state.get("_model_name") == "OutputModel" and len(self._widgets) < MAX_WIDGETS:
            self._widgets.setdefault(widget, _Area())
        if widget in self._widgets and "msg_id" in state:
            for stack in self._within.values():
                if widget in stack:
                    stack.remove(widget)
            if state["msg_id"]:
                self._within[str(state["msg_id"])].append(widget)

    def _update_displays(self, content: dict[str, Any]) -> None:
        display_id = (content.get("transient") or {}).get("display_id")
        data, metadata = displayable_data(content["data"], content["metadata"])
        for area in self._all_areas() if display_id else ():
            area.update_display(display_id, data, metadata)


def _seen_in(area: _Area, widgets: Mapping[str, _Area]) -> set[int]:
    """Return the ids of what is shown in an area: of itself, and of widgets, in widgets as well."""
    seen, found = {id(area)}, [area]
    while found:
        for entry in found.pop().entries:
            inner = widgets.get(entry.view)
            if inner is not None and id(inner) not in seen:
                seen.add(id(inner))
                found.append(inner)
    return seen


def _bounded_outputs(area: _Area, widgets: Mapping[str, _Area]) -> list[Output]:
    """Return the outputs of an area as one list that is not too long for a message."""
    outputs: list[Output] = []
    room = MAX_SHOWN_BYTES + 2 * MAX_TEXT_CHARS
    for one in _flatten_outputs(area, widgets, ()):
        room -= json_size(one)
        if room < 0:
            errors = [entry.output for entry in area.shown_entries() if is_error(entry.output)]
            missing = [] if any(map(is_error, outputs)) else only_error(errors)
            return [*outputs, stream_output(CUT), *missing]
        outputs.append(one)
    return outputs


def _flatten_outputs(
    area: _Area, widgets: Mapping[str, _Area], within: tuple[_Area, ...]
) -> Iterator[Output]:
    """Yield the outputs of an area, those of a widget where it is shown."""
    for entry in area.shown_entries():
        yield entry.output
        inner = widgets.get(entry.view)
        if inner is not None and inner not in (*within, area):
            yield from _flatten_outputs(inner, widgets, (*within, area))


def _add_message(area: _Area, kind: str, content: dict[str, Any]) -> None:
    """Add what a message of this kind says, if it is an output."""
    if kind == "execute_reply":
        pages = [page["data"] for page in content["payload"] if page["source"] == "page"]
        for data in pages[:1]:  # as JupyterLab shows help
            _add_message(area, "display_data", {"data": data, "metadata": {}})
    elif kind == "clear_output":
        (area.clear_later if content.get("wait") else area.clear)()
    elif kind == "stream":
        area.write(content["name"], content["text"])
    elif kind == "error":
        area.add(_Entry(error_output(content["ename"], content["evalue"], content["traceback"])))
    elif is_data({"output_type": kind}):
        view = content["data"].get(_VIEW)
        data, metadata = displayable_data(content["data"], content["metadata"])
        # The state of widgets is in no notebook that was graded: without it, a view is an error.
        data.pop(_VIEW, None)
        output: Output = {"output_type": kind, "data": data, "metadata": metadata}
        if kind == "execute_result":
            output["execution_count"] = content["execution_count"]
        display_id = (content.get("transient") or {}).get("display_id")
        model = view.get("model_id") if isinstance(view, dict) else None
        area.add(_Entry(output, display_id, str(model or "")))
