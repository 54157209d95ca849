"""Open a private rclpy Context: no signal handlers, nothing on the console, the network we choose.

How far DDS looks for others is process environment (ROS 2 docs, "Improved Dynamic Discovery"), read
when a context is initialised. It is set for that moment only, and put back.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, cast, get_args

import rclpy.context
import rclpy.utilities
from rclpy.context import Context

from course.errors import SessionError
from course.runtime.context.interruptible import SessionContext
from course.runtime.domains import port_files
from course.runtime.output import rcutils_tap

Discovery = Literal["LOCALHOST", "SUBNET", "SYSTEM_DEFAULT"]

_RANGE, _PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"
_environment_lock = threading.RLock()
_default_context_lock = threading.RLock()


def open_context(
    domain_id: int, discovery: Discovery, peers: Sequence[str], *, sim_time: bool
) -> SessionContext:
    """Return an initialised Context on `domain_id`.

    With `COURSE_DISCOVERY=inherit` in the environment, a discovery range that is set there is kept:
    a network namespace made for grading needs its own choice.

    Raises:
        SessionError: ROS 2 refuses to start, or `discovery` is not one of its names.
    """
    if discovery not in get_args(Discovery):
        names = ", ".join(get_args(Discovery))
        raise SessionError(f"Unknown discovery range {discovery!r}: choose one of {names}.")
    if isinstance(peers, str) or not all(isinstance(peer, str) for peer in peers):
        raise SessionError(f'peers is a list of addresses, such as ["192.168.1.7"], not {peers!r}.')
    ensure_log_dir()
    port_files.remove_abandoned(domain_id)
    arguments = ["--ros-args", "--disable-stdout-logs", "--disable-external-lib-logs"]
    # rclpy 7.1 leaves this service of a destroyed node on the graph, until the context ends.
    arguments += ["-p", "start_type_description_service:=false"]
    if sim_time:
        # The one way to reach a class that calls super().__init__("name") and nothing else.
        arguments += ["-p", "use_sim_time:=true"]
    context = SessionContext()
    with _set_environment(_discovery_variables(discovery, peers)):
        ours = rclpy.context.g_logging_ref_count == 0  # then our arguments configure logging
        try:
            context.init(arguments, domain_id=domain_id)
        except Exception as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise SessionError(
                f"ROS 2 did not start ({reason}): run `course doctor` to see why."
            ) from error
        rcutils_tap.install_handler(hand_on=ours)
    return context


def _discovery_variables(discovery: Discovery, peers: Sequence[str]) -> dict[str, str]:
    if os.environ.get("COURSE_DISCOVERY") == "inherit" and _RANGE in os.environ:
        return {}
    if discovery == "LOCALHOST":
        # Naming the loopback as a peer turns 3 s of discovery between processes into 0.2 s.
        peers = ["127.0.0.1", *peers]
    return {_RANGE: discovery, _PEERS: ";".join(peers)}


@contextlib.contextmanager
def _set_environment(variables: Mapping[str, str]) -> Iterator[None]:
    with _environment_lock:
        before = {name: os.environ.get(name) for name in variables}
        os.environ.update(variables)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value


def ensure_log_dir() -> None:
    """Point ROS_LOG_DIR at a writable folder; rclpy.init() raises without one."""
    home = os.environ.get("ROS_HOME", "~/.ros")
    folder = Path(os.environ.get("ROS_LOG_DIR") or Path(home) / "log").expanduser()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        usable = os.access(folder, os.W_OK | os.X_OK)
    except OSError:
        usable = False
    if not usable:
        fallback = Path(tempfile.gettempdir()) / f"ros2-course-log-{os.getuid()}"
        fallback.mkdir(parents=True, exist_ok=True)
        os.environ["ROS_LOG_DIR"] = str(fallback)


def default_context() -> Context | None:
    """Return the process's default Context if somebody has initialised one, else None."""
    with rclpy.utilities.g_context_lock:
        context = cast("Context | None", rclpy.utilities.g_default_context)
    return context if context is not None and context.ok() else None


def set_default_context(context: Context | None) -> None:
    """Make `context` what `rclpy.ok()`, `rclpy.spin_once(node)` and `Node("name")` act on."""
    module: Any = rclpy.utilities  # typed as None, because that is what it starts with
    with module.g_context_lock:
        module.g_default_context = context


def release_default_context(context: Context) -> None:
    """Leave the process without a default context if `context` is the one it has."""
    with rclpy.utilities.g_context_lock:
        if rclpy.utilities.g_default_context is context:
            rclpy.utilities.g_default_context = None


@contextlib.contextmanager
def as_default_context(context: Context) -> Iterator[None]:
    """Make `context` the process's default for a moment, so that `Node("name")` is made in it."""
    if default_context() is context:
        yield  # nothing to swap, so nothing to lock: a constructor may take its time
        return
    with _default_context_lock:
        with rclpy.utilities.g_context_lock:
            before = rclpy.utilities.g_default_context
        set_default_context(context)
        try:
            yield
        finally:
            set_default_context(before)


@contextlib.contextmanager
def default_context_beside(domain_id: int, *, sim_time: bool) -> Iterator[None]:
    """Give the process a default context of its own, on `domain_id`, and put back what was there.

    For nodes of a session that is not the process's: `while rclpy.ok():` in a thread of theirs goes
    on, a node that they make in a callback is on their domain, and `rclpy.shutdown()` ends neither
    their session nor the notebook's.

    Raises:
        SessionError: as from `open_context`.
    """
    beside = open_context(domain_id, "LOCALHOST", (), sim_time=sim_time)
    with rclpy.utilities.g_context_lock:
        before = rclpy.utilities.g_default_context
    set_default_context(beside)
    try:
        yield
    finally:
        with rclpy.utilities.g_context_lock:
            replaced = rclpy.utilities.g_default_context is not beside
        if not replaced:
            set_default_context(before)
        beside.try_shutdown()
