"""Find callbacks that do not return, and say why: a session that is held up must not be silent."""

from __future__ import annotations

import contextlib
import linecache
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from types import FrameType
from typing import Any

from rclpy.action.client import ActionClient
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.client import Client
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

from course.runtime.callbacks.callback_errors import callback_name
from course.runtime.callbacks.callback_runs import CallbackRun
from course.runtime.executor.background import BackgroundExecutor
from course.runtime.ros_names import node_name

_CLIENTS = ("rclpy.client", "rclpy.action.client")
_MOST_LINES = 5  # of a stack, in a sentence
_WAITS_FOR_SERVER = ("wait_for_service", "wait_for_server")


@dataclass(frozen=True)
class BlockedCallback:
    """A callback that has been running for long.

    Attributes:
        node: fully qualified name of its node, or "" if it belongs to none.
        callback: its qualified name, such as ``Asker.ask``.
        seconds: how long it has been running.
        stack: the lines of the learner's code that it is in, the callback's own first and the one
            where it is last; empty if that is unknown.
        reason: why it cannot go on, if it waits for what cannot come; else "".
        holds_up: whether callbacks of other nodes have to wait for it.
        advice: what to do about it.
        wall_wait: the method of rclpy in which it waits by the wall clock, such as
            ``wait_for_service``, or "".
        thread_id: Python's identifier of the thread that runs it.
        key: tells this run of the callback from any other.
    """

    node: str
    callback: str
    seconds: float
    stack: tuple[str, ...]
    reason: str
    holds_up: bool
    advice: str
    wall_wait: str
    thread_id: int
    key: tuple[int, float]

    @property
    def what(self) -> str:
        """The callback and where it is: ``Asker.ask of /asker (at line 7: client.call(x))``."""
        of = f" of {self.node}" if self.node else ""
        where = ", called from ".join(self.stack[: -_MOST_LINES - 1 : -1])
        return f"{self.callback}{of}" + (f" (at {where})" if where else "")

    @property
    def line(self) -> str:
        """The line of the learner's code where it is, or "" if that is unknown."""
        return self.stack[-1] if self.stack else ""

    def __str__(self) -> str:
        """Return what is known of it and what to do, in a few sentences."""
        held = ", and no other callback can run meanwhile" if self.holds_up else ""
        parts = [f"{self.what} has been running for {self.seconds:.0f} s{held}."]
        return " ".join([*parts, *([self.reason] if self.reason else []), self.advice])


def blocked_callbacks(
    executors: Iterable[BackgroundExecutor], longer_than: float
) -> list[BlockedCallback]:
    """Return the callbacks that have been running for over `longer_than` seconds, longest first."""
    jobs = [
        job
        for executor in executors
        for job in executor.running.copy()
        if job.thread_id and time.monotonic() - job.since > longer_than
    ]
    return [describe_job(job) for job in sorted(jobs, key=lambda job: job.since)]


def describe_job(job: CallbackRun) -> BlockedCallback:
    """Return what can be seen of `job` from outside."""
    frames = list(_walk_frames(job))
    home: Any = job.home
    client, method = next(
        ((client, frame.f_code.co_name) for frame in frames if (client := _client_of(frame))),
        (None, ""),
    )
    reason, advice = "", _ADVICE_SLOW
    if client is not None and method in _WAITS_FOR_SERVER:
        reason, advice = f"It waits for {_target_name(client)}, which nobody offers.", _ADVICE_LATER
    elif client is not None:
        reason, advice = _why_no_answer(client, job)
    name = node_name(job.node)
    return BlockedCallback(
        node="" if "/_" in name else name,
        callback=callback_name(job),
        seconds=time.monotonic() - job.since,
        stack=tuple(line for frame in reversed(frames) if (line := _learners_line(frame))),
        reason=reason,
        holds_up=len({other.thread_id for other in home.running.copy()} - {0}) >= home.threads,
        advice=advice,
        wall_wait=next((name for frame in frames if (name := _wall_wait(frame))), ""),
        thread_id=job.thread_id,
        key=(id(job), job.since),
    )


_ADVICE_SLOW = (
    "A callback should return soon: let a timer do what a loop with sleep() does, or run the node "
    "with more threads, as in course.run(…, threads=4)."
)
_ADVICE_ONE_THREAD = (
    "Use call_async() or send_goal_async() and let a done callback go on, or make the callback "
    "`async def` and await the answer."
)
_ADVICE_LATER = (
    "Start the server first, or look with service_is_ready() or server_is_ready() and try again "
    "later."
)
_ADVICE_GROUP = (
    "Put the client in a callback group of its own (callback_group=...), or use call_async() or "
    "send_goal_async()."
)


def _walk_frames(job: CallbackRun) -> Iterator[FrameType]:
    """Go through the frames of the thread that runs `job`, the innermost first."""
    frame = sys._current_frames().get(job.thread_id)
    while frame is not None:
        yield frame
        frame = frame.f_back


def _client_of(frame: FrameType) -> Client | ActionClient | None:
    """Return the client whose blocking method `frame` is in, if it is in one."""
    if frame.f_globals.get("__name__") not in _CLIENTS:
        return None
    client = frame.f_locals.get("self")
    return client if isinstance(client, Client | ActionClient) else None


def _wall_wait(frame: FrameType) -> str:
    """Return the method that `frame` is in, if that waits for a client's server by the wall clock.

    A blocking call does so only if it is given a time-out: else its future's end is what it awaits.
    """
    if _client_of(frame) is None:
        return ""
    name = frame.f_code.co_name
    timed = name == "call" and frame.f_locals.get("timeout_sec") is not None
    return name if timed or name in _WAITS_FOR_SERVER else ""


def _target_name(client: Client | ActionClient) -> str:
    """Return the name of what `client` asks; rclpy has no public name for an action."""
    found = client.srv_name if isinstance(client, Client) else client.__dict__.get("_action_name")
    return str(found or "an action")


def _why_no_answer(client: Client | ActionClient, job: CallbackRun) -> tuple[str, str]:
    """Return why the answer that `job` waits for does not come, and what to do about it."""
    home: Any = job.home
    name = _target_name(client)
    # Its own node may have been taken out of the executor just now, to be stopped.
    nodes = [*home.get_nodes(), *([job.node] if job.node is not None else [])]
    asker = next((node for node in nodes if _has_client(node, client)), None)
    servers = list(_find_servers(nodes, client)) if isinstance(client, Client) else []
    if home.threads == 1 and (asker is not None or servers):
        whose = "the answer" if asker is not None else "the request"
        return (
            f"Deadlock: it waits for the answer of {name}, and the only thread that could take "
            f"{whose} up is the one that waits.",
            _ADVICE_ONE_THREAD,
        )
    group = getattr(job.entity, "callback_group", None)
    if isinstance(group, MutuallyExclusiveCallbackGroup) and any(
        other.callback_group is group for other in [client, *servers]
    ):
        return (
            f"Deadlock: it waits for the answer of {name}, which is handled in the same mutually "
            "exclusive callback group as this callback, and so only after it.",
            _ADVICE_GROUP,
        )
    if isinstance(client, Client) and not _is_ready(client):
        return f"It waits for the answer of {name}, which nobody offers.", _ADVICE_LATER
    return "", f"It waits for the answer of {name}."


def _has_client(node: Node, client: Client | ActionClient) -> bool:
    return client in (node.clients if isinstance(client, Client) else node.waitables)


def _find_servers(nodes: list[Node], client: Client) -> Iterator[Any]:
    with contextlib.suppress(InvalidHandle):  # destroyed meanwhile
        for node in nodes:
            yield from (one for one in node.services if one.service_name == client.service_name)


def _is_ready(client: Client) -> bool:
    try:
        return bool(client.service_is_ready())
    except InvalidHandle:
        return False


def _learners_line(frame: FrameType) -> str:
    """Return the line that `frame` is in, unless it is ours, rclpy's or Python's own code."""
    package = str(frame.f_globals.get("__name__", "")).partition(".")[0]
    if package in ("rclpy", "course") or package in sys.stdlib_module_names:
        return ""
    text = linecache.getline(frame.f_code.co_filename, frame.f_lineno).strip()
    return f"line {frame.f_lineno}" + (f": {text}" if text else "")
