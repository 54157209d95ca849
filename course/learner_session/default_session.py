"""The session that belongs to this process: `course.run(...)` without making a session first."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from rclpy.node import Node
from rclpy.qos import QoSProfile

from course.errors import SessionError
from course.learner_session.session import Session
from course.runtime.context.close_order import CloseReport
from course.runtime.context.context import (
    default_context,
    release_default_context,
    set_default_context,
)
from course.runtime.logs.table import LogTable
from course.runtime.requests.actions import GoalRun
from course.runtime.requests.recorder import Recorder
from course.util import argument_checks

if TYPE_CHECKING:
    from course.views.lives import Lives
    from course.views.world import World

T = TypeVar("T")

_lock = threading.RLock()
_session: Session | None = None


def session(**options: Any) -> Session:
    """Return this process's session; make it, with `options`, at first use.

    Unless you called rclpy.init() yourself, its context is also rclpy's default context:
    `rclpy.ok()`, `rclpy.create_node(...)` and `rclpy.spin_once(node)` act on it.

    Args:
        options: as for `Session`. With a session that is open already, they must agree with it.

    Raises:
        SessionError: the open session was made with other options.
    """
    global _session
    with _lock:
        if _session is not None and not _session.closed:
            _check_options(_session, options)
            return _session
        if _session is not None:
            _session.close()  # rclpy.shutdown() ended its context: let its threads go as well
        _session = Session(**options)
        if default_context() is None:
            set_default_context(_session.context)
            _session.on_close(functools.partial(release_default_context, _session.context))
        return _session


def current_session() -> Session | None:
    """Return this process's session if it is open, else None."""
    return _session if _session is not None and not _session.closed else None


def run(factory: Callable[..., Node] | Node, *args: Any, **kwargs: Any) -> Node:
    """Make a node and spin it in the background; see `Session.run`."""
    return session().run(factory, *args, **kwargs)


def stop(*what: Any) -> None:
    """Stop nodes of this process's session; see `Session.stop`."""
    if (open_session := current_session()) is not None:
        open_session.stop(*what)


def close(timeout: float = 5.0) -> CloseReport:
    """Close this process's session; the next use makes a new one. See `Session.close`."""
    with _lock:
        return CloseReport() if _session is None else _session.close(timeout)


def until(condition: Callable[[], T], timeout: float = 5.0, what: str = "the condition") -> T:
    """Return the first true value of `condition`; see `Session.until`."""
    return session().until(condition, timeout, what)


def next_message(
    msg_type: Any, topic: str, *, qos: QoSProfile | int | None = None, timeout: float = 5.0
) -> Any:
    """Return the next message on `topic`; see `Session.next_message`."""
    return session().next_message(msg_type, topic, qos=qos, timeout=timeout)


def wait_for_service(srv_type: Any, name: str, timeout: float = 5.0) -> None:
    """Return when a server of `name` is ready; see `Session.wait_for_service`."""
    session().wait_for_service(srv_type, name, timeout)


def call(srv_type: Any, name: str, request: Any, timeout: float = 5.0) -> Any:
    """Call a service and return its response; see `Session.call`."""
    return session().call(srv_type, name, request, timeout)


def send_goal(
    action_type: Any,
    name: str,
    goal: Any,
    *,
    timeout: float = 10.0,
    on_feedback: Callable[[Any], None] | None = None,
) -> GoalRun:
    """Send a goal; return when it is accepted or rejected. See `Session.send_goal`."""
    return session().send_goal(action_type, name, goal, timeout=timeout, on_feedback=on_feedback)


def record(
    topic: str,
    msg_type: Any | None = None,
    *,
    qos: QoSProfile | int | None = None,
    limit: int = 1000,
    timeout: float = 5.0,
) -> Recorder:
    """Record a topic from now on; see `Session.record`."""
    return session().record(topic, msg_type, qos=qos, limit=limit, timeout=timeout)


def pause(*what: Any) -> None:
    """Stop executing callbacks of nodes; see `Session.pause`."""
    session().pause(*what)


def resume(*what: Any) -> None:
    """Execute callbacks of paused nodes again; see `Session.resume`."""
    session().resume(*what)


def logs(node: Any = None, *, level: str = "INFO", last: int | None = 50) -> LogTable:
    """Return what nodes logged and callbacks printed; see `Session.logs`."""
    return session().logs(node, level=level, last=last)


def spin() -> None:
    """Block until Ctrl-C, SIGTERM or the end of the session; see `Session.spin`."""
    session().spin()


def world(name: str | Path = "warehouse", *, seed: int = 0) -> World:
    """Return a live view of a simulated floor with a robot on it; see `Session.world`."""
    return session().world(name, seed=seed)


def lives(
    make: Callable[[int], Node], topic: str, *, times: int = 5, timeout: float = 5.0
) -> Lives:
    """Run a node for so many lives, and return a picture of what each has left behind.

    Its threads, its open files and its endpoints are counted in this process, after each life. A
    life begins with ``make(number)`` and lasts until a message comes on ``topic``::

        course.lives(lambda life: CameraDriver(f"camera{life}"), "camera/image")

    Args:
        make: makes the node of a life; devices that an earlier life left open have other numbers.
        topic: what the node publishes on.
        times: how many lives; one more, which is not counted, comes first.
        timeout: seconds that a message may take.

    Raises:
        SessionError: ``make`` made no node, or an argument is none.
        WaitTimeout: no message came.
    """
    from course.views.lives import Lives
    from course.watch.lives import live_repeatedly

    argument_checks.check_function(make, "What makes a node", "lambda life: CameraDriver()")
    topic = argument_checks.check_text(topic, "A topic", "camera/image")
    argument_checks.check_whole_number(times, "times", least=1, example=5)
    timeout = argument_checks.check_seconds(timeout)
    return Lives(live_repeatedly(session(), make, topic, times, timeout))


def _check_options(open_session: Session, options: dict[str, Any]) -> None:
    for name, wanted in options.items():
        actual = open_session.domain_id if name == "domain_id" else open_session.options.get(name)
        if actual != wanted:
            raise SessionError(
                f"The session of this notebook is open with {name}={actual!r}, not {wanted!r}: "
                "call course.close() first, or make another one with course.Session(...)."
            )
