"""Which threads sleep for a time that they were given, by the wall's clock, and how long still.

A thread that sleeps so (``time.sleep``, ``Event.wait(1.0)``, a time-out of rclpy's) is in a system
call with a time in it. The kernel tells which call that is (proc(5): ``syscall``), and the time is
in the thread's memory. A thread of Fast DDS does not count, nor an executor that waits for its
nodes until the next of their timers is due, nor a thread that flushes logs: no callback waits
there. They are told by what stands on their stacks.
"""

from __future__ import annotations

import os
import struct
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import NamedTuple

from autograder.processes.outside.holding import DDS_LIBRARIES, code_of, points_into

_POLL, _SELECT, _NANOSLEEP, _FUTEX, _CLOCK_NANOSLEEP, _PSELECT = 7, 23, 35, 202, 230, 270
_EPOLL_WAIT, _PPOLL, _EPOLL_PWAIT, _EPOLL_PWAIT2 = 232, 271, 281, 441
"""System calls of Linux on x86-64 that may end after some time."""
_MILLISECONDS = {_POLL: 2, _EPOLL_WAIT: 3, _EPOLL_PWAIT: 3}
_POINTERS = {_SELECT: 4, _NANOSLEEP: 0, _PSELECT: 4, _PPOLL: 2, _EPOLL_PWAIT2: 3}
"""Which argument has, or points to, a time from the call on."""
_COMMAND, _WAIT, _WAIT_UNTIL, _OF_THE_DAY = 0x7F, 0, 9, 0x100  # futex(2)
_ABSOLUTE = 1  # clock_nanosleep(2)
_TIME = struct.Struct("qq")
_WAIT_IN = (*DDS_LIBRARIES, "librmw_", "librcl_logging_", "libspdlog")
"""What the names of libraries begin with in which DDS waits, an executor, and a writer of logs."""
_STACK_BYTES = 1024
"""Bytes of a thread's stack, the innermost, in which there are places in those libraries then."""

Code = dict[str, list[range]]
"""Where the code of those libraries is in processes, by their folders."""


class Sleeper(NamedTuple):
    """A thread that sleeps for a time."""

    thread: int
    left_s: float
    """Seconds until it wakes up at the latest; the whole length where only that is known."""
    to_the_end: bool
    """Nothing wakes it before, as what it waits for might: it does nothing but sleep."""


def find_sleepers(process: str, threads: Iterable[int], code: Code) -> list[Sleeper]:
    """Return which of a process's ``threads`` sleep for a time.

    None are told if the kernel does not let us look (ptrace(2)).

    Args:
        process: its folder.
        threads: those to look at.
        code: what was found out at earlier looks; what is new is added.
    """
    found = []
    with suppress(OSError):
        memory = os.open(f"{process}/mem", os.O_RDONLY)
        try:
            for thread in threads:
                with suppress(OSError, ValueError, IndexError, OverflowError, struct.error):
                    call = _read_file(f"{process}/task/{thread}/syscall").split()
                    # "running" is no number
                    number, *given = int(call[0]), *(int(word, 16) for word in call[1:])
                    if (left := _sleep_left(number, given, memory)) is not None:
                        stack = os.pread(memory, _STACK_BYTES, given[-2])
                        if not _waits_in_ros(process, stack, code):
                            to_the_end = number in (_NANOSLEEP, _CLOCK_NANOSLEEP)
                            found.append(Sleeper(thread, left, to_the_end))
        finally:
            os.close(memory)
    return found


def _read_file(path: str) -> bytes:
    file = os.open(path, os.O_RDONLY)
    try:
        return os.read(file, 4096)
    finally:
        os.close(file)


def _sleep_left(number: int, given: Sequence[int], memory: int) -> float | None:
    """Return for how many s a system call will sleep; None if it does not do so for a time."""
    if number in _MILLISECONDS:
        milliseconds = given[_MILLISECONDS[number]] & 0xFFFFFFFF
        return milliseconds / 1e3 if milliseconds < 1 << 31 else None  # for ever if negative
    if number in _POINTERS and (pointer := given[_POINTERS[number]]):
        seconds, rest = _time_at(memory, pointer)
        return seconds + rest / (1e6 if number == _SELECT else 1e9)
    if number == _CLOCK_NANOSLEEP:
        return _seconds_until(memory, given[2], given[0], absolute=bool(given[1] & _ABSOLUTE))
    if number == _FUTEX and given[3] and given[1] & _COMMAND in (_WAIT, _WAIT_UNTIL):
        clock = time.CLOCK_REALTIME if given[1] & _OF_THE_DAY else time.CLOCK_MONOTONIC
        return _seconds_until(memory, given[3], clock, absolute=given[1] & _COMMAND == _WAIT_UNTIL)
    return None


def _waits_in_ros(process: str, stack: bytes, code: Code) -> bool:
    if points_into(stack, code.get(process, ())):
        return True
    code[process] = code_of(process, _WAIT_IN)  # libraries may have been loaded since
    return points_into(stack, code[process])


def _seconds_until(memory: int, pointer: int, clock: int, *, absolute: bool) -> float:
    seconds, nanoseconds = _time_at(memory, pointer)
    now = time.clock_gettime(clock) if absolute else 0.0
    return seconds + nanoseconds / 1e9 - now


def _time_at(memory: int, pointer: int) -> tuple[int, int]:
    """Return the two halves of a struct timespec, or timeval."""
    seconds, rest = _TIME.unpack(os.pread(memory, _TIME.size, pointer))
    return seconds, rest
