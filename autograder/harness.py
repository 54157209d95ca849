"""The subject's side of an exam: makes nodes of the student's classes when the examiner asks.

The harness lives in the student's process, so nothing it says is evidence: it only carries out
requests (start, stop, pause, resume), and the examiner believes what it observes on DDS.
"""

from __future__ import annotations

import traceback
from collections.abc import Mapping
from typing import Any

from autograder.wire import Channel, ChannelClosed
from course import Session

TRACE_LINES = 6

SUBJECT_ENV = "AUTOGRADER_SUBJECT"
"""Set in a subject: `autograder.check` in a student's own cell then has nothing to do."""


class Harness:
    """Carries out an examiner's requests on the nodes of one namespace, in one session."""

    def __init__(self, session: Session, namespace: Mapping[str, Any]) -> None:
        """Serve the classes found in ``namespace`` (a notebook's globals) in ``session``."""
        self._session = session
        self._namespace = namespace
        self._nodes: dict[str, Any] = {}

    def serve(self, channel: Channel) -> None:
        """Answer requests until the examiner says that it is done or goes away."""
        try:
            while (request := channel.receive())["op"] != "done":
                channel.send(self._answer(request))
        except ChannelClosed:
            pass
        finally:
            self._session.stop()

    def _answer(self, request: dict[str, Any]) -> dict[str, Any]:
        try:
            operation = {
                "start": self._start, "stop": self._stop,
                "pause": self._pause, "resume": self._resume, "errors": self._errors,
            }[request["op"]]  # fmt: skip
            return {"ok": True, **operation(request)}
        except Exception as error:  # noqa: BLE001 - a student's code may raise anything
            return {
                "ok": False,
                "error": f"{type(error).__name__}: {error}"[:2000],
                "trace": _student_trace(error),
            }

    def _start(self, request: dict[str, Any]) -> dict[str, Any]:
        name = request["class"]
        try:
            factory = self._namespace[name]
        except KeyError:
            raise LookupError(f"there is no class named {name} in the notebook") from None
        # Two classes may share a node name, or come out of one function: both have to run.
        node = self._session.run_beside(factory)
        self._nodes[name] = node
        return {"node": node.get_fully_qualified_name()}

    def _stop(self, request: dict[str, Any]) -> dict[str, Any]:
        node = self._nodes.pop(request["class"], None)
        if node is not None:
            self._session.stop(node)
        return {}

    def _pause(self, request: dict[str, Any]) -> dict[str, Any]:
        self._session.pause(self._nodes[request["class"]])
        return {}

    def _resume(self, request: dict[str, Any]) -> dict[str, Any]:
        self._session.resume(self._nodes[request["class"]])
        return {}

    def _errors(self, request: dict[str, Any]) -> dict[str, Any]:
        recent = self._session.errors[-5:]
        return {
            "errors": [
                f"{e.callback} of {e.node}: {type(e.exception).__name__}: {e.exception}"[:500]
                for e in recent
            ]
        }


def _student_trace(error: BaseException) -> str:
    """Return the last frames of ``error`` that are not rclpy's or ours."""
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if not any(part in frame.filename for part in ("/rclpy/", "/course/", "/autograder/"))
    ]
    return "".join(traceback.format_list(frames[-TRACE_LINES:]))[:4000]
