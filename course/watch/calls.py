"""Service calls made from a form, each with its answer, or why there is none."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from course.errors import CourseError
from course.messages import values
from course.runtime.core_session import CoreSession
from course.watch import forms

KEPT_CALLS = 10


@dataclass(frozen=True)
class Call:
    """One call. At its end it has an answer or a problem, and took ``seconds``."""

    number: int
    request: dict[str, Any]
    answer: dict[str, Any] | None = None
    problem: str = ""
    seconds: float | None = None

    @property
    def is_waiting(self) -> bool:
        """Whether the answer is still to come."""
        return self.answer is None and not self.problem


class Calls:
    """Calls of one service; each waits in a thread of its own, so that nothing else has to."""

    def __init__(self, session: CoreSession, srv_type: Any, name: str) -> None:
        """Call the service ``name`` of ``session``."""
        self.name = name
        self.srv_type = srv_type
        self._session = session
        self._calls: deque[Call] = deque(maxlen=KEPT_CALLS)
        self._count = 0
        self._lock = threading.Lock()

    @property
    def latest_calls(self) -> list[Call]:
        """The latest calls, oldest first (a snapshot)."""
        with self._lock:
            return list(self._calls)

    def send(self, typed: Mapping[str, Any], timeout: float = 5.0) -> None:
        """Call with what was typed into the form, and wait ``timeout`` s in the background.

        Raises:
            MisfitError: something does not fit its field.
        """
        request = forms.build_message(self.srv_type.Request, typed)
        with self._lock:
            self._count += 1
            call = Call(self._count, values.to_data(request))
            self._calls.append(call)
        threading.Thread(
            target=self._await_answer,
            args=(call, request, timeout),
            name="ROS service call",
            daemon=True,
        ).start()

    def _await_answer(self, call: Call, request: Any, timeout: float) -> None:
        started = time.monotonic()
        try:
            response = self._session.call(self.srv_type, self.name, request, timeout)
            done = replace(call, answer=values.to_data(response))
        except CourseError as error:
            done = replace(call, problem=str(error))
        except Exception as error:  # noqa: BLE001 - the session may end under a call
            done = replace(call, problem=f"{type(error).__name__}: {error}")
        done = replace(done, seconds=time.monotonic() - started)
        with self._lock:
            for place, kept in enumerate(self._calls):
                if kept.number == call.number:
                    self._calls[place] = done
