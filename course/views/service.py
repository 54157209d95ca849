"""A console for one service: a form made from its type, and its latest calls."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from course.errors import CourseError
from course.messages.yaml_text import for_json, format_count, one_line
from course.runtime.core_session import CoreSession
from course.views.shared import truncate
from course.views.shared.live_view import Frame, LiveView
from course.watch import forms
from course.watch.calls import Call, Calls

MAX_BYTES = 3000
"""Bytes of a request, and of an answer, that are shown."""


class ServiceConsole(LiveView):
    """Calls a service by a form. ``calls`` has what was asked and answered."""

    label = "Service console"
    script = "service"
    shared = ("forms",)

    def __init__(
        self, session: CoreSession, srv_type: Any, name: str, timeout: float = 5.0
    ) -> None:
        """Call ``name``, and wait ``timeout`` s for each answer."""
        super().__init__(session, name)
        self._model = Calls(session, srv_type, name)
        self._timeout = timeout
        self._problem = ""

    @property
    def calls(self) -> list[Call]:
        """The latest calls, oldest first."""
        return self._model.latest_calls

    def call(self, **typed: Any) -> None:
        """Call with values by field, as the form does; the answer comes in the background.

        Raises:
            MisfitError: a value that does not fit its field.
        """
        self._model.send({path.replace("__", "."): v for path, v in typed.items()}, self._timeout)

    def handle_control(self, message: dict[str, Any]) -> None:
        """Call with what was typed."""
        if not isinstance(message.get("call"), dict):
            return
        try:
            self._model.send(message["call"], self._timeout)
            self._problem = ""
        except CourseError as error:
            self._problem = str(error)

    def make_frame(self) -> Frame:
        """Return the form and the calls."""
        return {
            "title": f"Service {self._model.name}",
            "fields": [asdict(field) for field in forms.form_fields(self._model.srv_type.Request)],
            "problem": self._problem,
            "calls": [_call_data(call) for call in self.calls],
        }

    def words(self) -> str:
        """Return the calls as text."""
        lines = [f"Service {self._model.name}, {format_count(len(self.calls), 'call')}"]
        for call in self.calls:
            shown = _call_data(call)
            outcome = (
                "waiting" if call.is_waiting else shown["problem"] or one_line(shown["answer"])
            )
            lines.append(f"  {call.number}: {one_line(shown['request'])} -> {outcome}")
        return "\n".join([*lines, *([self._problem] if self._problem else [])])


def _call_data(call: Call) -> dict[str, Any]:
    return {
        "number": call.number,
        "request": truncate.cut_data(for_json(call.request), MAX_BYTES),
        "answer": truncate.cut_data(for_json(call.answer), MAX_BYTES),
        "problem": truncate.cut_text(call.problem, MAX_BYTES),
        "time": "" if call.seconds is None else f"{call.seconds * 1000:.1f} ms",
    }
