"""Callbacks that wait by the wall clock, whatever they call for it, as the kernel tells.

A thread that sleeps for a time it was given (``time.sleep``, ``Event.wait(1.0)``, a time-out of
rclpy's) is in a system call with a time in it; one that waits for the node's clock, a message or
another callback is in one without. Naps do not count: a callback that looks at the node's clock in
between waits by that clock.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from pathlib import Path

from course.runtime.executor.blocked import BlockedCallback
from course.util.operating_system import ThreadSample, look_at

NAP_S = 0.1
"""Seconds beyond which a callback's sleep is no nap any more."""
_LOOK_S = 0.005
_TIMED_CALLS = {
    35: None,  # nanosleep
    230: None,  # clock_nanosleep
    202: 3,  # futex
    7: 2,  # poll
    271: 2,  # ppoll
    23: 4,  # select
    270: 4,  # pselect6
    232: 3,  # epoll_wait
    281: 3,  # epoll_pwait
}
"""System calls of Linux on x86-64, and which argument is the time; None: it always has one."""
_FOR_EVER = {0, 2**32 - 1, 2**64 - 1}  # no pointer to a time, or -1 ms


def wall_waits(callbacks: Iterable[BlockedCallback]) -> list[str]:
    """Return which of these wait by the wall clock for longer than a nap, and where.

    Each is like ``wait_for_service: Asker.ask of /asker (at line 7: ...)``, if it waits in a method
    of rclpy's, or begins with the callback.
    """
    ids = {thread.ident: thread.native_id or 0 for thread in threading.enumerate()}
    found = list(callbacks)
    named = [one for one in found if one.wall_wait]
    asleep = [
        (one, native_id, look_at(native_id))
        for one in found
        if not one.wall_wait and is_timed(native_id := ids.get(one.thread_id, 0))
    ]
    deadline = time.monotonic() + NAP_S
    over = threading.Event()  # never set
    while asleep and time.monotonic() < deadline:
        over.wait(_LOOK_S)
        asleep = [(one, thread, look) for one, thread, look in asleep if _sleeps_on(thread, look)]
    return [_describe_wait(one) for one in (*named, *(one for one, _, _ in asleep))]


def _sleeps_on(native_id: int, before: ThreadSample) -> bool:
    look = look_at(native_id, before)
    return look.asleep and look.switches == before.switches


def is_timed(native_id: int) -> bool:
    """Return whether a thread of this process is in a system call that ends after some time.

    False as well if it has ended, or if the kernel does not tell (CONFIG_HAVE_ARCH_TRACEHOOK).
    """
    try:
        call, *words = Path(f"/proc/self/task/{native_id}/syscall").read_text().split()
        number, arguments = int(call), [int(word, 16) for word in words]
    except (OSError, ValueError):  # "running" is no number
        return False
    if number not in _TIMED_CALLS:
        return False
    place = _TIMED_CALLS[number]
    return place is None or arguments[place] not in _FOR_EVER


def _describe_wait(one: BlockedCallback) -> str:
    return f"{one.wall_wait}: {one.what}" if one.wall_wait else one.what
