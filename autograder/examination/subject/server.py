"""The subject's side of an exam: makes nodes of the student's classes when the examiner asks.

The subject server lives in the student's process, so nothing it says is evidence: it only carries
out requests, and the examiner believes what it observes on DDS.
"""

from __future__ import annotations

import asyncio
import gc
import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from typing import Any

from IPython import get_ipython
from rclpy.node import Node
from std_msgs.msg import String

from autograder.examination.subject.student_errors import (
    MUST_NOT_SPIN,
    ThreadErrors,
    describe_error,
    is_spin_error,
    own_line,
    student_trace,
)
from autograder.examination.subject.wall_waits import wall_waits
from autograder.processes.channel import Channel, ChannelClosed
from course.runtime.context.context import default_context_beside
from course.runtime.core_session import CoreSession
from course.runtime.requests.service_ends import count_known_clients, count_known_servers
from course.runtime.teardown import destroy_leftovers

MAX_VALUE_CHARS = 64 * 1024
"""Characters of JSON that a value or a returned object may have."""

MAX_NOTES = 500
"""Characters that are told of the error of a cell."""

LAST_CALLBACKS_S = 0.5  # that callbacks of an exam's earlier session are given to end
MOST_CLEANUPS = 100
"""Nodes whose cleanup may raise while a session is closed."""

OpenSession = Callable[[int, bool], CoreSession]
"""Makes a session of so many threads, with simulated time or not."""


class SubjectServer:
    """Carries out an examiner's requests on the nodes of one namespace."""

    def __init__(
        self,
        open_session: OpenSession,
        namespace: Mapping[str, Any],
        show: Callable[[Any], object] = lambda _: None,
    ) -> None:
        """Serve what ``namespace`` (a notebook's globals) has, in sessions of ``open_session``.

        ``show`` is given what an examiner tells of its progress, as JSON knows it: in the thread
        that serves, because what another one displays may land in another cell.
        """
        self._show_progress = show
        self._open_session = open_session
        self._session: CoreSession | None = None
        self._beside = ExitStack()
        self._namespace = namespace
        self._nodes: dict[str, Any] = {}
        self._declared: dict[str, Callable[[], Any]] = {}
        # What a constructor raised is kept, as a notebook keeps it, and with it all that its
        # frames refer to: what they leave behind does not go away by chance.
        self._raised: list[Exception | SystemExit] = []
        self._threads = ThreadErrors()

    def serve(self, channel: Channel) -> None:
        """Answer requests until the examiner says that it is done or goes away."""
        with self._threads, _as_in_a_program():
            try:
                while (request := channel.receive())["op"] != "done":
                    channel.send(self._answer(request))
            except ChannelClosed:
                pass
            finally:
                self._close()

    def _answer(self, request: dict[str, Any]) -> dict[str, Any]:
        try:
            operation = {
                "open": self._open, "start": self._start, "declare": self._declare,
                "start_declared": self._start_declared, "mark": self._mark, "stop": self._stop,
                "pause": self._pause, "resume": self._resume, "collect": self._collect,
                "advance": self._advance, "nudge": self._nudge,
                "call": self._call, "value": self._value,
                "errors": self._errors, "sees": self._sees, "wall_waits": self._wall_waits,
                "own_errors": self._own_errors, "show": self._show,
            }[request["op"]]  # fmt: skip
            return {"ok": True, **operation(request)}
        except _Missing as missing:
            return {"ok": False, "missing": str(missing)[:2000]}
        # sys.exit() in a constructor ends a program, but not the examination of it.
        except (Exception, SystemExit) as error:  # noqa: BLE001 - student's code may raise anything
            return {
                "ok": False,
                "error": describe_error(error)[:2000],
                "trace": student_trace(error),
            }

    @property
    def _hosting_session(self) -> CoreSession:
        return self._session or self._begin_session(1, False)

    def _begin_session(self, threads: int, sim_time: bool) -> CoreSession:
        session = self._open_session(threads, sim_time)
        self._session = session
        self._beside.enter_context(default_context_beside(session.domain_id, sim_time=sim_time))
        return session

    def _close(self) -> None:
        self._nodes.clear()
        self._raised.clear()
        self._threads.items.clear()
        session, self._session = self._session, None
        if session is not None:
            _close_session(session)
            self._beside.close()
            gc.collect()

    def _open(self, request: dict[str, Any]) -> dict[str, Any]:
        self._close()
        self._begin_session(int(request["threads"]), bool(request["sim_time"]))
        return {}

    def _find_variable(self, name: str) -> Any:
        try:
            return self._namespace[name]
        except KeyError:
            raise _Missing(
                f"No {name} was defined: did its cell end with an error?{_cell_error(name)}"
            ) from None

    def _start(self, request: dict[str, Any]) -> dict[str, Any]:
        name = request["name"]
        factory = self._find_variable(name)
        if request["args"]:
            factory = partial(factory, *request["args"])
        return {"node": self._run_node(name, factory)}

    def _declare(self, request: dict[str, Any]) -> dict[str, Any]:
        name = request["name"]
        design = self._find_variable(name)
        if not hasattr(design, "node_factories"):
            kind = type(design).__name__
            raise TypeError(f"{name} is of type {kind}, which has no nodes; a course.Design has")
        factories = design.node_factories()
        self._declared = {str(label): factory for label, factory in factories.items()}
        return {"labels": list(self._declared)}

    def _start_declared(self, request: dict[str, Any]) -> dict[str, Any]:
        label = request["label"]
        return {"node": self._run_node(f"{request['name']}.{label}", self._declared[label])}

    def _run_node(self, name: str, factory: Any) -> str:
        # Two classes may share a node name, or come out of one function: both have to run.
        try:
            node = self._hosting_session.run_beside(factory)
        except (Exception, SystemExit) as error:
            self._raised.append(error)
            raise
        self._nodes[name] = node
        return str(node.get_fully_qualified_name())

    def _mark(self, request: dict[str, Any]) -> dict[str, Any]:
        self._hosting_session.run_beside(partial(_marker_node, request["name"]))
        return {}

    def _stop(self, request: dict[str, Any]) -> dict[str, Any]:
        name = request["name"]
        if request["bare"]:
            self._destroy_unaided(self._nodes[name])
        elif (node := self._nodes.pop(name, None)) is not None:
            self._hosting_session.stop(node)
            destroy_leftovers(node)  # a session does not know what it has let go of
        return {}

    def _destroy_unaided(self, node: Any) -> None:
        self._hosting_session.let_go(node)
        try:
            node.destroy_node()
        except BaseException:
            destroy_leftovers(node)
            raise

    def _collect(self, request: dict[str, Any]) -> dict[str, Any]:
        gc.collect()
        return {}

    def _pause(self, request: dict[str, Any]) -> dict[str, Any]:
        self._hosting_session.pause(self._nodes[request["name"]])
        return {}

    def _resume(self, request: dict[str, Any]) -> dict[str, Any]:
        self._hosting_session.resume(self._nodes[request["name"]])
        return {}

    def _advance(self, request: dict[str, Any]) -> dict[str, Any]:
        seconds, step, patience = (float(request[k]) for k in ("seconds", "step", "patience"))
        self._hosting_session.sim.advance(seconds, step, patience)
        return {"goes_on": bool(self._hosting_session.blocked_callbacks(0.0))}

    def _nudge(self, _: dict[str, Any]) -> dict[str, Any]:
        self._hosting_session.sim.nudge()
        return {}

    def _call(self, request: dict[str, Any]) -> dict[str, Any]:
        node = self._nodes[request["node"]]
        method = getattr(node, request["method"], None)
        if not callable(method):
            raise LookupError(f"{request['node']} has no method {request['method']}()")
        returned = method(*request["args"])
        try:
            return {"value": _as_json(returned)}
        except (TypeError, ValueError, RecursionError):
            return {"value": repr(returned)[:1000]}

    def _value(self, request: dict[str, Any]) -> dict[str, Any]:
        found = self._find_variable(request["name"])
        try:
            return {"value": _as_json(found)}
        except (TypeError, ValueError, RecursionError):
            raise TypeError(
                f"{request['name']} must be made of strings, numbers, lists and dictionaries"
            ) from None

    def _sees(self, request: dict[str, Any]) -> dict[str, Any]:
        node = self._nodes[request["name"]]
        counts = {
            "publishers": node.count_publishers, "subscribers": node.count_subscribers,
            "services": partial(count_known_servers, node),
            "clients": partial(count_known_clients, node),
        }  # fmt: skip
        return {
            "counts": {
                # The examiner's names: a student's node may live in a namespace of its own.
                kind: {name: counts[kind]("/" + name.lstrip("/")) for name in names}
                for kind, names in request["endpoints"].items()
            }
        }

    def _wall_waits(self, request: dict[str, Any]) -> dict[str, Any]:
        waits = wall_waits(self._hosting_session.blocked_callbacks(0.0))
        return {"waits": [told[:500] for told in waits]}

    def _errors(self, request: dict[str, Any]) -> dict[str, Any]:
        recent = self._hosting_session.errors[-5:]
        return {
            "errors": [
                f"{e.callback} of {e.node}: {describe_error(e.exception)}"[:500]
                + (MUST_NOT_SPIN if is_spin_error(e.exception) else "")
                for e in recent
            ],
            "of_threads": [str(error)[:500] for error in self._threads.items[-5:]],
        }

    def _show(self, request: dict[str, Any]) -> dict[str, Any]:
        self._show_progress(request["progress"])
        return {}

    def _own_errors(self, request: dict[str, Any]) -> dict[str, Any]:
        found = [(error, own_line(error.exception)) for error in self._hosting_session.errors]
        return {
            "errors": [
                {"told": f"{e.callback} {e.problem} (at {line})"[:500], "count": e.count}
                for e, line in found
                if line
            ]
        }


@contextmanager
def _as_in_a_program() -> Iterator[None]:
    """Hide the event loop that a kernel runs while a cell is executed.

    The main thread of a program has none: there a node may run a loop of its own to the end, when
    it is destroyed, say, and asyncio would refuse that inside of another.
    """
    running = asyncio.events._get_running_loop()
    asyncio.events._set_running_loop(None)
    try:
        yield
    finally:
        asyncio.events._set_running_loop(running)


def _marker_node(name: str) -> Node:
    node = Node(name, start_parameter_services=False, enable_rosout=False)
    node.create_publisher(String, name, 1)
    node.create_subscription(String, name, lambda _: None, 1)
    return node


class _Missing(Exception):  # noqa: N818 - nothing of the student's raised it
    """The notebook has not defined what the examiner asks for; the message says so."""


def _cell_error(missing: str) -> str:
    """Return, as a sentence, what a cell ended with, if IPython knows of an error.

    Where a notebook is run from top to bottom that is its first: later ones may come of it. A
    kernel knows the last alone, and that ``missing`` is missing is no news.
    """
    last = getattr(sys, "last_value", None)
    error = getattr(get_ipython(), "first_error", None) or last
    if error is None or (isinstance(error, NameError) and error.name == missing):
        return ""
    which = "last" if error is last else "first"
    return f" The {which} error of a cell was {describe_error(error)[:MAX_NOTES].rstrip('.')}."


def _close_session(session: CoreSession) -> None:
    """Close a session, whatever the student's cleanups raise."""
    for _ in range(MOST_CLEANUPS):
        with suppress(
            Exception, SystemExit
        ):  # close() can be called again, and goes on where it was
            session.close(LAST_CALLBACKS_S)
            return


def _as_json(value: Any) -> Any:
    """Return a copy of ``value`` as JSON knows it; raises TypeError or ValueError if it cannot."""
    text = json.dumps(value)
    if len(text) > MAX_VALUE_CHARS:
        raise ValueError(
            f"{len(text)} characters are more than the {MAX_VALUE_CHARS} that are read"
        )
    return json.loads(text)
