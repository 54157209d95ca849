"""The system calls that a submission does without: a filter for `bwrap --seccomp`.

Refused is what no limit reaches (memory that belongs to no process, or goes on when it has been let
go of: a map that is shared and has no file, System V semaphores, attributes of files), what opens
large parts of the kernel to a stranger (new user namespaces, io_uring, bpf, keyrings, tracing),
what one user's processes share with each other all over the machine (watches of files, leases,
which hold up any other process that opens the file), and sockets that lead out of a network
namespace (VM sockets). Written for x86-64, the one machine that ROS 2 wheels are made for. The
format is that of seccomp(2): an array of ``struct sock_filter``.
"""

from __future__ import annotations

import errno
import socket
import struct

_LOAD, _EQUAL, _GREATER_EQUAL, _ANY_BIT, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
_NUMBER, _ARCHITECTURE = 0, 4  # offsets in struct seccomp_data
_ARGUMENT_0, _ARGUMENT_1, _ARGUMENT_3 = 16, 24, 40
_X86_64 = 0xC000003E
_X32 = 0x40000000  # the first number of the x32 calls
_ALLOW, _KILL, _ERRNO = 0x7FFF0000, 0x80000000, 0x00050000
_NEW_USER_NAMESPACE = 0x10000000

REFUSED = {
    "shmget": 29, "shmat": 30, "semget": 64, "msgget": 68, "ptrace": 101, "pivot_root": 155,
    "mount": 165, "umount2": 166, "swapon": 167, "init_module": 175, "setxattr": 188,
    "lsetxattr": 189, "fsetxattr": 190, "mq_open": 240, "kexec_load": 246, "add_key": 248,
    "request_key": 249, "keyctl": 250, "inotify_init": 253, "unshare": 272, "inotify_init1": 294,
    "perf_event_open": 298, "fanotify_init": 300, "open_by_handle_at": 304, "setns": 308,
    "process_vm_readv": 310, "process_vm_writev": 311, "finit_module": 313, "memfd_create": 319,
    "kexec_file_load": 320, "bpf": 321, "userfaultfd": 323, "io_uring_setup": 425,
    "open_tree": 428, "move_mount": 429, "fsopen": 430, "fsconfig": 431, "fsmount": 432,
    "fspick": 433, "mount_setattr": 442, "memfd_secret": 447, "setxattrat": 463,
}  # fmt: skip
_MMAP, _CLONE, _CLONE3, _SOCKET, _FCNTL = 9, 56, 435, 41, 72
_COMMANDS = {"F_OFD_SETLK": 37, "F_OFD_SETLKW": 38, "F_SETLEASE": 1024, "F_NOTIFY": 1026}
"""Those of fcntl that are refused: a lock without an owner is counted for nobody."""
_SHARED, _ANONYMOUS = 0x01, 0x20  # of a map's flags
FAMILIES = (socket.AF_UNIX, socket.AF_INET, socket.AF_INET6, socket.AF_NETLINK)
"""Kinds of sockets that remain; DDS looks network interfaces up over netlink."""


def _pack_step(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("<HBBI", code, if_true, if_false, value)


def _refuse_call(error: int) -> bytes:
    return _pack_step(_RETURN, _ERRNO | error)


def filter_program() -> bytes:
    """Return the filter."""
    steps = [
        _pack_step(_LOAD, _ARCHITECTURE), _pack_step(_EQUAL, _X86_64, 1, 0),
        _pack_step(_RETURN, _KILL),
        _pack_step(_LOAD, _NUMBER), _pack_step(_GREATER_EQUAL, _X32, 0, 1),
        _refuse_call(errno.ENOSYS),
        # Its flags are in memory, where no filter can look: without it the C library uses clone.
        _pack_step(_EQUAL, _CLONE3, 0, 1), _refuse_call(errno.ENOSYS),
    ]  # fmt: skip
    for number in REFUSED.values():
        steps += [_pack_step(_EQUAL, number, 0, 1), _refuse_call(errno.EPERM)]
    steps += [
        _pack_step(_EQUAL, _MMAP, 0, 5), _pack_step(_LOAD, _ARGUMENT_3),
        _pack_step(_ANY_BIT, _ANONYMOUS, 0, 2),
        _pack_step(_ANY_BIT, _SHARED, 0, 1), _refuse_call(errno.EPERM), _pack_step(_RETURN, _ALLOW),
        _pack_step(_EQUAL, _FCNTL, 0, 3 + len(_COMMANDS)), _pack_step(_LOAD, _ARGUMENT_1),
        *(_pack_step(_EQUAL, command, len(_COMMANDS) - place, 0)
          for place, command in enumerate(_COMMANDS.values())),
        _pack_step(_RETURN, _ALLOW), _refuse_call(errno.EPERM),
        _pack_step(_EQUAL, _CLONE, 0, 4), _pack_step(_LOAD, _ARGUMENT_0),
        _pack_step(_ANY_BIT, _NEW_USER_NAMESPACE, 0, 1), _refuse_call(errno.EPERM),
        _pack_step(_RETURN, _ALLOW),
        _pack_step(_EQUAL, _SOCKET, 0, 2 + len(FAMILIES)), _pack_step(_LOAD, _ARGUMENT_0),
        *(_pack_step(_EQUAL, family, len(FAMILIES) - place, 0)
          for place, family in enumerate(FAMILIES)),
        _refuse_call(errno.EAFNOSUPPORT), _pack_step(_RETURN, _ALLOW),
    ]  # fmt: skip
    return b"".join(steps)
