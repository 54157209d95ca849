"""The few system calls that Python 3.11 has no function for.

Each raises OSError with the kernel's reason. Constants are those of the kernel's own headers.
"""

from __future__ import annotations

import ctypes
import errno
import os
from collections.abc import Mapping

NAMESPACES: Mapping[str, int] = {
    "user": 0x10000000, "mnt": 0x00020000, "pid": 0x20000000, "ipc": 0x08000000,
    "uts": 0x04000000, "net": 0x40000000, "cgroup": 0x02000000,
}  # fmt: skip
"""The kinds of namespaces, as ``/proc/PID/ns`` spells them, and their flags for setns(2)."""

_SET_DUMPABLE, _SET_SECCOMP, _DROP_FROM_BOUNDING_SET = 4, 22, 24
_NO_NEW_PRIVILEGES, _AMBIENT, _CLEAR_ALL_AMBIENT = 38, 47, 4
_FILTER = 2
_CAPABILITY_VERSION_3 = 0x20080522

_libc = ctypes.CDLL(None, use_errno=True)


class _Program(ctypes.Structure):
    """``struct sock_fprog`` of seccomp(2)."""

    _fields_ = (("length", ctypes.c_ushort), ("steps", ctypes.c_char_p))


class _CapabilityHeader(ctypes.Structure):
    """``struct __user_cap_header_struct`` of capset(2)."""

    _fields_ = (("version", ctypes.c_uint32), ("pid", ctypes.c_int))


def join_namespace(descriptor: int, flags: int) -> None:
    """Join the namespace, or those ``flags`` of a process (given by a pidfd), of ``descriptor``.

    A process namespace is joined by the children of this process, not by itself.
    """
    _check_result(_libc.setns(descriptor, flags), "setns")


def bound_capabilities() -> None:
    """Empty the bounding set: no program that is executed later brings a capability back."""
    for capability in range(64):
        try:
            _call_prctl(_DROP_FROM_BOUNDING_SET, capability)
        except OSError as error:
            if error.errno != errno.EINVAL:
                raise
            return  # the kernel knows no more of them


def drop_capabilities() -> None:
    """Give up every capability, for good."""
    _call_prctl(_AMBIENT, _CLEAR_ALL_AMBIENT)
    header = _CapabilityHeader(_CAPABILITY_VERSION_3, 0)
    _check_result(_libc.capset(ctypes.byref(header), (ctypes.c_uint32 * 6)()), "capset")
    _call_prctl(_NO_NEW_PRIVILEGES, 1)


def filter_calls(program: bytes) -> None:
    """Let a filter, an array of ``struct sock_filter``, decide about all further system calls."""
    given = _Program(len(program) // 8, program)
    _check_result(_libc.prctl(_SET_SECCOMP, _FILTER, ctypes.byref(given), 0, 0), "seccomp")


def allow_looking() -> None:
    """Let this process see its own /proc entries again: the kernel hides them from a new user."""
    _call_prctl(_SET_DUMPABLE, 1)


def _call_prctl(option: int, value: int) -> None:
    _check_result(_libc.prctl(option, value, 0, 0, 0), "prctl")


def _check_result(result: int, call: str) -> None:
    if result == -1:
        number = ctypes.get_errno()
        raise OSError(number, f"{call}: {os.strerror(number)}")
