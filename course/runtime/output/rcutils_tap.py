"""Hear everything that is logged through rcutils: what rclpy's loggers and rcl itself say.

rclpy offers no hook, rcutils does: one output handler for the process, set through its C API. Ours
keeps each line and hands it on to the handler that was there, so that /rosout works as ever.
"""

from __future__ import annotations

import collections
import contextlib
import ctypes
import functools
import operator
import platform
import threading
from collections.abc import Iterator

import rclpy.context
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.logging import get_logger_level, set_logger_level
from rclpy.node import Node

from course.interfaces.installed import ament_prefixes
from course.runtime.callbacks.callback_runs import current_job
from course.runtime.logs.log_store import store
from course.runtime.rclpy_fixes.logger_callers import spare_the_next_search
from course.util import operating_system

# void handler(location, int severity, const char *name, int64 stamp_ns, const char *format,
#              va_list *arguments): rcutils/logging.h, rcutils_logging_output_handler_t.
_Handler = ctypes.CFUNCTYPE(
    None,
    ctypes.c_void_p,
    ctypes.c_int,
    ctypes.c_char_p,
    ctypes.c_int64,
    ctypes.c_char_p,
    ctypes.c_void_p,
)
_VA_LIST_BYTES = 32 if platform.machine() == "aarch64" else 24
"""Size of a va_list (AAPCS64, section 10.1.5; System V ABI for x86-64, section 3.5.7)."""
_VA_LIST_IS_POINTER = (platform.system(), platform.machine()) == ("Darwin", "arm64")
"""Whether it is a plain pointer, which reading does not use up (Apple's ABI for arm64)."""
_TEXT_BYTES = 4096
_EVERYBODY = ""  # the logger whose level those without one of their own have
_MIDDLEWARE = ("rcl", "rcl_action", "rcl_lifecycle", "rcutils", "rmw", "rmw_fastrtps_cpp",
               "rmw_fastrtps_shared_cpp", "rmw_dds_common", "rosidl_typesupport")  # fmt: skip

_LIBRARY = operating_system.find_library("rcutils", (p / "lib" for p in ament_prefixes()))
_rcutils = ctypes.CDLL(_LIBRARY)
_rcutils.rcutils_logging_get_output_handler.restype = ctypes.c_void_p
_rcutils.rcutils_logging_set_output_handler.argtypes = [ctypes.c_void_p]
_console = ctypes.cast(_rcutils.rcutils_logging_console_output_handler, ctypes.c_void_p).value
# PyDLL and not CDLL: its functions keep the GIL.
_vsnprintf = ctypes.PyDLL(None).vsnprintf
_vsnprintf.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_void_p]

# What rcl says while rclpy makes or destroys a node is said under the mutex of rclpy's logging, and
# to hear it takes the GIL. A thread that holds the GIL then, and waits for that mutex to make or
# destroy another node, never goes on, and neither does this one. All that is regularly said there
# is a warning that /rosout has two publishers of one name: what is heard here needs no /rosout.
_SAID_UNDER_LOCK = "rcl.logging_rosout"

_HAND_ON_TIMEOUT_S = (
    1.0  # s that lines may be under way to the next handler before it is taken down
)

_lock = threading.Lock()
_next: ctypes._CFunctionType | None = None
_under_way = 0  # lines
_handed_on = threading.Condition()
_lowered: set[str] = set()
_being_made = 0  # nodes
_level_before = LoggingSeverity.UNSET


def install_handler(*, hand_on: bool) -> None:
    """Hear what is logged from now on. Idempotent, and to be repeated after each Context.init().

    Args:
        hand_on: whether the handler that is there now is to hear it as well.
    """
    global _next
    with _lock:
        address = _rcutils.rcutils_logging_get_output_handler()
        if address == _ours:
            return
        _next = _Handler(address) if hand_on and address else None
        set_logger_level(_SAID_UNDER_LOCK, LoggingSeverity.ERROR)
        _rcutils.rcutils_logging_set_output_handler(_ours)


@contextlib.contextmanager
def stay_installed() -> Iterator[None]:
    """Go on hearing while a context is shut down in the block, and afterwards.

    With the last context rclpy takes logging down, which turns the console on. But a callback may
    still run then, and a student may hold a node of a session that is closed: what they log would
    be written into a cell. So the block counts as one more user of logging, and it is taken down
    here, in one step with hearing again.
    """
    global _next
    with rclpy.context.g_logging_configure_lock:
        users, handed_on_to = rclpy.context.g_logging_ref_count, _next
        rclpy.context.g_logging_ref_count += 1
        if users == 1:
            # /rosout complains on stderr about publishers of a context that has ended, and without
            # a configuration the handlers of rcl write to the console.
            _hand_nothing_on()
    try:
        yield
    finally:
        with rclpy.context.g_logging_configure_lock:
            rclpy.context.g_logging_ref_count -= 1
            if rclpy.context.g_logging_ref_count > 0:  # somebody has come meanwhile, or is there
                _next = handed_on_to
            elif users > 0:
                _hand_nothing_on()
                # No other thread has a turn between the two: each is in C, and keeps the GIL.
                steps = (rclpy_implementation.rclpy_logging_fini, _hear_again)
                collections.deque(map(operator.call, steps), maxlen=0)


def uninstall_handler() -> None:
    """Let nobody hear what is logged from now on, if ours is still in place. Idempotent.

    Needed before the interpreter ends: threads of DDS may log later than that, and so may what
    destroys the last nodes.
    """
    with _lock:
        if _rcutils.rcutils_logging_get_output_handler() in (_ours, _console):
            _rcutils.rcutils_logging_set_output_handler(None)


@contextlib.contextmanager
def hearing_constructors() -> Iterator[None]:
    """Keep every level of what nodes log that are made in the block.

    A node has no logger before its constructor runs, so nobody can set that logger's level: for
    the length of the block, loggers without a level of their own emit DEBUG. The libraries of
    ROS 2 itself do not: they would talk about every entity.
    """
    global _being_made, _level_before
    with _lock:
        _being_made += 1
        if _being_made == 1:
            for name in _MIDDLEWARE:
                if get_logger_level(name) == LoggingSeverity.UNSET:
                    set_logger_level(name, LoggingSeverity.INFO)
            _level_before = get_logger_level(_EVERYBODY)
            set_logger_level(_EVERYBODY, LoggingSeverity.DEBUG)
    try:
        yield
    finally:
        with _lock:
            _being_made -= 1
            if _being_made == 0:
                set_logger_level(_EVERYBODY, _level_before)


def keep_every_level(node: Node) -> None:
    """Let `node`'s logger emit DEBUG, so that any level can be read back, unless it chose a level.

    What is below INFO is kept, but not handed on: /rosout carries what it carries in plain ROS 2.
    """
    logger = node.get_logger()
    if get_logger_level(logger.name) == LoggingSeverity.UNSET:
        logger.set_level(LoggingSeverity.DEBUG)
        _lowered.add(logger.name)


def _format_text(text_format: bytes, arguments: int) -> str:
    buffer = ctypes.create_string_buffer(_TEXT_BYTES)
    length = _print_text(buffer, text_format, arguments)
    if length >= _TEXT_BYTES:
        buffer = ctypes.create_string_buffer(length + 1)
        _print_text(buffer, text_format, arguments)
    return buffer.value.decode("utf-8", "replace")


def _print_text(buffer: ctypes.Array[ctypes.c_char], text_format: bytes, arguments: int) -> int:
    """Print into a buffer; return the length of the whole text, in bytes."""
    if _VA_LIST_IS_POINTER:
        first = ctypes.c_void_p.from_address(arguments).value
        return int(_vsnprintf(buffer, len(buffer), text_format, first))
    # The next handler needs the arguments too, and reading them uses them up: read a copy.
    copy = ctypes.create_string_buffer(ctypes.string_at(arguments, _VA_LIST_BYTES))
    return int(_vsnprintf(buffer, len(buffer), text_format, ctypes.addressof(copy)))


def _hear_line(
    location: int, severity: int, name: bytes, stamp: int, text_format: bytes, arguments: int
) -> None:
    spare_the_next_search()
    logger = (name or b"").decode("utf-8", "replace")
    job = current_job()
    home = None if job is None else job.home.session_key
    store.add(stamp / 1e9, severity, logger, _format_text(text_format, arguments), home)
    if _next is None or (severity < LoggingSeverity.INFO and _is_ours_to_lower(logger)):
        return
    with _handing_on() as handler:
        if handler is not None:
            handler(location, severity, name, stamp, text_format, arguments)


@contextlib.contextmanager
def _handing_on() -> Iterator[ctypes._CFunctionType | None]:
    """Give the next handler, if there is one, which stays in place for the block."""
    global _under_way
    with _handed_on:
        handler = _next
        _under_way += 1
    try:
        yield handler
    finally:
        with _handed_on:
            _under_way -= 1
            _handed_on.notify_all()


def _hand_nothing_on() -> None:
    """Return when no line is under way to the next handler, and none will be."""
    global _next
    with _handed_on:
        _next = None
        _handed_on.wait_for(lambda: not _under_way, _HAND_ON_TIMEOUT_S)


def _is_ours_to_lower(logger: str) -> bool:
    if _being_made and get_logger_level(logger) == LoggingSeverity.UNSET:
        return True
    while logger:
        if logger in _lowered:
            return True
        logger = logger.rpartition(".")[0]
    return False


_hear_in_c = _Handler(_hear_line)  # kept here: C only has its address
_ours = ctypes.cast(_hear_in_c, ctypes.c_void_p).value
_hear_again = functools.partial(
    ctypes.PyDLL(_LIBRARY).rcutils_logging_set_output_handler, ctypes.c_void_p(_ours)
)
