"""A node's parameters, live: sliders and inputs from their descriptors."""

from __future__ import annotations

import threading
from dataclasses import asdict
from typing import Any

from course.errors import CourseError
from course.messages.yaml_text import for_json, one_line
from course.runtime.core_session import CoreSession
from course.util import argument_checks
from course.views.shared import truncate
from course.views.shared.live_view import Frame, LiveView
from course.watch.parameter_values import ParameterError
from course.watch.parameters import ParameterSheet, SheetEntry

ASK_TIMEOUT_S = 2.0

MAX_BYTES = 2000
"""Bytes of a value that are shown."""


class ParameterPanel(LiveView):
    """Shows and changes the parameters of one node; what it refuses is shown with its reason."""

    label = "Parameter panel"
    script = "parameters"
    shared = ("forms",)
    period = 0.5  # s: each look is three service calls

    def __init__(self, session: CoreSession, node: str) -> None:
        """Show the parameters of ``node``.

        Raises:
            WaitTimeout: there is no such node, or it does not answer.
        """
        sheet = ParameterSheet(session, node)
        entries = sheet.read_entries()
        super().__init__(session, node)
        self._sheet = sheet
        self._entries = entries
        self._problem = ""
        self._changes = 0
        self._silent = ""
        self._lock = threading.Lock()
        self._asking = threading.Lock()

    @property
    def entries(self) -> list[SheetEntry]:
        """The parameters, as they were at the last look."""
        return list(self._entries)

    def set(self, name: str, value: Any) -> None:
        """Change a parameter.

        Raises:
            ParameterError: the node refused, for the reason in the message; or no such value.
            WaitTimeout: the node does not answer.
        """
        self._sheet.set(argument_checks.check_text(name, "The name of a parameter", "speed"), value)
        self._entries = self._sheet.read_entries()

    def handle_control(self, message: dict[str, Any]) -> None:
        """Change a parameter as typed."""
        if not isinstance(message.get("set"), str):
            return
        problem, entries = "", self._entries
        try:
            try:
                self._sheet.set(message["set"], message.get("value"), ASK_TIMEOUT_S)
            except ParameterError as error:
                problem = str(error)
            entries = self._sheet.read_entries(ASK_TIMEOUT_S)
        except CourseError as error:  # it does not answer: asking again would only take longer
            problem = problem or str(error)
        with self._lock:
            self._entries, self._problem, self._changes = entries, problem, self._changes + 1

    def make_frame(self) -> Frame:
        """Return the parameters, and what the last change led to."""
        self._refresh_entries()
        with self._lock:
            problem, changes = self._problem or self._silent, self._changes
        return {
            "title": f"Parameters of {self._sheet.node}",
            "entries": [_entry_data(entry) for entry in self._entries],
            "problem": problem,
            "changes": changes,
        }

    def _refresh_entries(self) -> None:
        """Ask for the values in a thread: a node that is stuck must not hold up other views."""
        if self._asking.acquire(blocking=False):
            threading.Thread(target=self._fetch_entries, name="ROS parameters", daemon=True).start()

    def _fetch_entries(self) -> None:
        before = self._changes
        try:
            entries, self._silent = self._sheet.read_entries(ASK_TIMEOUT_S), ""
            with self._lock:
                if self._changes == before:  # else these may be the values from before a change
                    self._entries = entries
        except CourseError as error:
            self._silent = str(error)
        except Exception as error:  # noqa: BLE001 - the session may end meanwhile
            self._silent = f"{type(error).__name__}: {error}"
        finally:
            self._asking.release()

    def words(self) -> str:
        """Return the parameters as text."""
        lines = [f"Parameters of {self._sheet.node}"]
        for entry in self._entries:
            limits = f" ({entry.least:g} to {entry.most:g})" if entry.least is not None else ""
            about = f"  # {entry.description}" if entry.description else ""
            value = truncate.cut_data(entry.value, MAX_BYTES)
            shown = "not set" if value is None else one_line(value)
            lines.append(f"  {entry.name}: {shown}{limits}{about}")
        if not self._entries:
            lines.append("  none: declare_parameter(…) makes one")
        with self._lock:
            problem = self._problem or self._silent
        return "\n".join([*lines, *([problem] if problem else [])])


def _entry_data(entry: SheetEntry) -> Frame:
    """Return what the browser draws: a list as the YAML that is typed to change it."""
    shown: Frame = for_json(asdict(entry))
    value = truncate.cut_data(entry.value, MAX_BYTES)
    shown["value"] = one_line(value) if isinstance(value, list) else for_json(value)
    if value != entry.value:  # what is typed into a part of it would replace the whole
        shown["read_only"] = True
        shown["description"] = f"too long to be edited here; {entry.description}".rstrip("; ")
    return shown
