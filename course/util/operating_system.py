"""What Linux has and other systems have not, each with a way that any POSIX system knows.

Linux is where the course is developed and graded. With `COURSE_PORTABLE=1` in the environment the
other way is taken there as well, so that tests see both.
"""

from __future__ import annotations

import os
import socket
import sys
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

PORTABLE = "COURSE_PORTABLE"
"""Environment variable that, set to 1, has Linux do as other systems do."""

IANA_EPHEMERAL = range(49152, 65536)
"""Ports that a system gives to whoever asks for any (RFC 6335, section 6; macOS keeps to it)."""

_UDP_TABLES = ("/proc/net/udp", "/proc/net/udp6")
_UNIX_TABLE = "/proc/net/unix"
_PORT_RANGE = "/proc/sys/net/ipv4/ip_local_port_range"
_LOOPBACK = "127.0.0.1"


def is_linux() -> bool:
    """Return whether this is Linux, and may be taken for it."""
    return sys.platform == "linux" and os.environ.get(PORTABLE) != "1"


def ephemeral_ports() -> range:
    """Return the ports that the system hands out to whoever asks for any."""
    if is_linux():
        with suppress(OSError, ValueError):  # a hardened /proc
            first, last = Path(_PORT_RANGE).read_text(encoding="ascii").split()
            return range(int(first), int(last) + 1)
        return range(32768, 61000)  # the kernel's own default
    return IANA_EPHEMERAL


def open_udp_ports() -> set[int] | None:
    """Return the UDP ports that are open in this network namespace; None if nobody says."""
    if not is_linux():
        return None
    ports = set()
    for table in _UDP_TABLES:
        try:
            lines = Path(table).read_text(encoding="ascii").splitlines()[1:]
        except OSError:  # no IPv6, or a hardened /proc: a claim still keeps sessions apart
            continue
        ports |= {int(line.split()[1].rpartition(":")[2], 16) for line in lines}
    return ports


def is_port_open(port: int) -> bool:
    """Return whether a program listens on a UDP port of the loopback, by trying to do so."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        try:
            sock.bind((_LOOPBACK, port))
        except OSError:
            return True
    return False


class Claim(NamedTuple):
    """Something that one process of a machine can hold, known by a name and by a UDP port.

    On Linux it is an abstract Unix socket (unix(7)), elsewhere the port on the loopback. The kernel
    drops either when its process ends, however it ends, and either is scoped as the ports of DDS
    are: to a network namespace.
    """

    name: str
    port: int

    def take(self) -> socket.socket | None:
        """Return a datagram socket that holds it for as long as it is open; None if it is held."""
        sock = new_socket()
        try:
            sock.bind(self._address())
        except OSError:
            sock.close()
            return None
        return sock

    def send(self, sock: socket.socket, text: bytes) -> bool:
        """Send a datagram to who holds it; return whether anybody does, as far as can be told."""
        if not is_linux() and not is_port_open(self.port):
            return False
        try:
            sock.sendto(text, socket.MSG_DONTWAIT, self._address())
        except OSError:  # nobody holds it, or nobody reads there
            return False
        return True

    def _address(self) -> str | tuple[str, int]:
        return f"\0{self.name}" if is_linux() else (_LOOPBACK, self.port)


def claimed_names() -> set[str]:
    """Return the names that are claimed in this network namespace; nothing where nobody says."""
    try:
        lines = Path(_UNIX_TABLE).read_text(encoding="utf-8", errors="replace").splitlines()[1:]
    except OSError:
        return set()
    return {line.rpartition(" @")[2] for line in lines if " @" in line}


def new_socket() -> socket.socket:
    """Return a datagram socket of the kind that claims are made of, without an address."""
    return socket.socket(socket.AF_UNIX if is_linux() else socket.AF_INET, socket.SOCK_DGRAM)


def bind_anywhere(sock: socket.socket) -> None:
    """Give a socket an address that the system chooses, for answers to what it sends."""
    sock.bind("" if is_linux() else (_LOOPBACK, 0))


def try_lock(descriptor: int) -> bool:
    """Lock an open file for this process, unless another one has it locked; return whether.

    The lock ends with the process, or when the file is closed.
    """
    try:
        import fcntl
    except ImportError:  # no POSIX system: whoever comes last writes the same as the others
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def find_library(name: str, folders: Iterable[Path]) -> str:
    """Return what to load a C library by; macOS wants its path, which is in one of ``folders``."""
    if sys.platform != "darwin":
        return f"lib{name}.so"
    paths = (folder / f"lib{name}.dylib" for folder in folders)
    return str(next((path for path in paths if path.exists()), f"lib{name}.dylib"))


class ThreadSample(NamedTuple):
    """One look at a thread: whether it sleeps, how often it has run, and for how long (s).

    Where the system does not show its threads, ``switches`` is where in its code it is, and
    ``worked`` is the processor time of the whole process.
    """

    asleep: bool
    switches: str
    worked: float


def look_at(native_id: int, before: ThreadSample | None = None) -> ThreadSample:
    """Look at a thread of this process, last seen as `before`; one that ended is not asleep."""
    if not is_linux():
        return _look_at_code(native_id)
    task = f"/proc/self/task/{native_id}"
    try:
        status = _read_file(f"{task}/status")
    except OSError:
        return ThreadSample(False, "", 0.0)
    asleep = status.partition("\nState:\t")[2][:1] == "S"
    switches = status[status.index("voluntary_ctxt") :]
    if before is not None and asleep and switches == before.switches:
        return ThreadSample(True, switches, before.worked)  # it has not run since
    return ThreadSample(asleep, switches, _processor_seconds(task))


def _look_at_code(native_id: int) -> ThreadSample:
    """Look at a thread as Python knows it: one that does not move, and costs nothing, sleeps."""
    found = (t.ident for t in threading.enumerate() if t.native_id == native_id)
    frame = sys._current_frames().get(next(found, None) or 0)
    if frame is None:
        return ThreadSample(False, "", 0.0)
    return ThreadSample(True, f"{id(frame)} {frame.f_lasti}", time.process_time())


def system_call_of(native_id: int) -> list[str]:
    """Return the call that a thread is in, its number and arguments (proc(5)); empty if unknown."""
    if not is_linux():
        return []
    try:
        return _read_file(f"/proc/self/task/{native_id}/syscall").split()
    except OSError:  # the kernel does not say
        return []


def _processor_seconds(task: str) -> float:
    try:
        return int(_read_file(f"{task}/schedstat").split()[0]) / 1e9
    except (OSError, ValueError, IndexError):  # no CONFIG_SCHED_INFO: sleeping must do
        return 0.0


def _read_file(path: str) -> str:
    """Return what a small file of the kernel's holds; looks are many, and `open` is slower."""
    file = os.open(path, os.O_RDONLY)
    try:
        return os.read(file, 8192).decode("ascii", "replace")
    finally:
        os.close(file)
