"""Hold a submission's threads from outside, while those of DDS go on receiving.

A consumer that is busy shows what its queues keep. A request to be busy would tell a process that
it is being looked at; a thread that the kernel stops (ptrace(2)) hears nothing of it. Threads of
Fast DDS are let go at once, so that what comes in is received meanwhile. Any thread can be given
their names, so they are recognised by the function that they began with.

The kernel lets only the thread that has stopped another one act on it, and lets all go when that
thread ends. So each hold has a thread of its own.
"""

from __future__ import annotations

import ctypes
import errno
import os
import re
import struct
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from queue import Empty, SimpleQueue

from course.errors import CourseError
from course.runtime.waiting import Deadline

HOLD_TIMEOUT_S = 5.0
"""Seconds within which all threads must stand still."""
CALM_S = 1.0
"""Seconds in which a moment is looked for when no thread is at work: one that is might have a lock
that DDS needs for receiving."""
LOOK_S = 0.002
"""Seconds between two looks at threads that are to stop, and between two tries."""
REAP_S = 0.02
"""Seconds after which a held thread that was killed is given back to the kernel."""

DDS_THREADS = b"dds."
"""What the names of Fast DDS's threads begin with."""
DDS_LIBRARIES = ("libfastrtps", "libfastdds")
"""What the names of its libraries begin with, before and since its version 3."""

_GET_REGISTERS, _DETACH, _SEIZE, _INTERRUPT = 12, 17, 0x4206, 0x4207
# struct user_regs_struct of x86-64: rax, orig_rax, and fs_base, where glibc describes the thread
_REGISTERS, _RESULT, _CALL, _DESCRIPTOR = 27, 10, 15, 21
_DESCRIPTOR_BYTES = 2048
"""Of glibc's struct pthread, or a little more: in it is the function that the thread began with."""
_TAKEN_OUT = {2**64 - number for number in (4, 512, 513, 514, 516)}  # EINTR, ERESTART...
_FUTEX, _FUTEX_WAIT, _CONTENDED = 202, 0, 2  # the value of a mutex of glibc that others wait for
_EVENT_STOP = 128
_NO_THREAD_OF_OTHERS = 0x20000000 | 0x40000000  # __WNOTHREAD | __WALL: of this thread's tracees
_ENDED, _BLOCKED = (b"Z", b"X"), b"D"

Processes = Callable[[], Iterable[int]]
"""Returns the processes whose threads are to be held, as far as there are any by now."""


class HoldError(CourseError):
    """Threads cannot be held here; the message says why, and what helps."""


@dataclass(frozen=True)
class HeldThreads:
    """What is held: how many threads, and which are those of DDS, which go on."""

    threads: int
    of_dds: frozenset[int]

    def is_jammed(self) -> bool:
        """Return whether DDS cannot receive just now, as one of its threads waits for a lock.

        The thread that has the lock is held, so DDS waits until the end: what the queues keep then
        says nothing about them. `hold_threads` looks for a moment when that is not so, and may not
        find one.
        """
        return any(map(_waits_for_a_lock, self.of_dds))


@contextmanager
def hold_threads(processes: Processes) -> Iterator[HeldThreads]:
    """Hold all threads but those of DDS for the length of the block.

    Args:
        processes: whose threads. New processes and threads are held as well, until there is none
            left that could make another.

    Raises:
        HoldError: this process has no right to hold them, or one does not stop.
    """
    hold = _Hold(processes)
    thread = threading.Thread(target=hold.run, name="hold")
    thread.start()
    try:
        yield hold.wait()
    finally:
        hold.over.set()
        thread.join()


@dataclass
class _Hold:
    """One hold; `run` belongs to its thread. ``stopped`` maps each to a signal that it is owed."""

    processes: Processes
    over: threading.Event = field(default_factory=threading.Event)
    _seized: set[int] = field(default_factory=set)
    _stopped: dict[int, int] = field(default_factory=dict)
    _of_dds: set[int] = field(default_factory=set)
    _outcome: SimpleQueue[HeldThreads | HoldError] = field(default_factory=SimpleQueue)

    def wait(self) -> HeldThreads:
        """Return what is held, once all is."""
        with suppress(Empty):
            outcome = self._outcome.get(timeout=4 * HOLD_TIMEOUT_S)
            if isinstance(outcome, HoldError):
                raise outcome
            return outcome
        raise HoldError("The threads of the submission could not be held: nothing stopped in time.")

    def run(self) -> None:
        """Hold, until it is over; the end of this thread lets go of what could not be let go of."""
        try:
            self._hold_in_a_calm_moment()
        except HoldError as error:
            self._let_go()
            self._outcome.put(error)
            return
        self._outcome.put(HeldThreads(len(self._stopped), frozenset(self._of_dds)))
        while not self.over.wait(REAP_S):
            self._note_stops()
        self._let_go()

    def _hold_in_a_calm_moment(self) -> None:
        calm = Deadline(CALM_S)
        while True:
            self._hold_all()
            if not calm.seconds_left or not any(map(_is_at_work, self._stopped)):
                return
            self._let_go()
            self.over.wait(LOOK_S)

    def _hold_all(self) -> None:
        deadline = Deadline(HOLD_TIMEOUT_S)
        # A process that is held loads no library, so that its memory map is read once.
        code = cache(partial(code_of, libraries=DDS_LIBRARIES))
        while new := self._new_threads():
            for tid in new:
                self._seize_thread(tid)
            self._await_stops(deadline)
            for tid in new.keys() & self._stopped.keys():
                if _is_of_dds(tid, partial(code, f"/proc/{new[tid]}")):
                    self._of_dds.add(tid)
                    self._detach_thread(tid)

    def _new_threads(self) -> dict[int, int]:
        """Return {thread: process} of the threads that are not held or known yet, and not ended."""
        found, known = {}, self._seized | self._of_dds
        for pid in self.processes():
            with suppress(OSError):
                for task in Path(f"/proc/{pid}/task").iterdir():
                    tid = int(task.name)
                    if tid not in known and not _has_ended(tid):
                        found[tid] = pid
        return found

    def _seize_thread(self, tid: int) -> None:
        try:
            _ptrace(_SEIZE, tid)
            _ptrace(_INTERRUPT, tid)
        except ProcessLookupError:
            return  # it has just ended
        except PermissionError:
            if _has_ended(tid):
                return
            raise HoldError(_explain_refusal()) from None
        self._seized.add(tid)

    def _await_stops(self, deadline: Deadline) -> None:
        """Wait until each seized thread stands still, or for what the kernel does not interrupt."""
        while True:
            self._note_stops()
            moving = self._seized - self._stopped.keys()
            if all(_thread_state(tid) == _BLOCKED for tid in moving):
                return
            if not deadline.seconds_left:
                raise HoldError(
                    f"The threads of the submission could not be held: {len(moving)} of them did "
                    f"not stop within {HOLD_TIMEOUT_S:.0f} s."
                )
            self.over.wait(LOOK_S)

    def _note_stops(self) -> None:
        """Note which have stopped or ended; a killed one is only gone once that has been noted."""
        while True:
            try:
                tid, status = os.waitpid(-1, os.WNOHANG | _NO_THREAD_OF_OTHERS)
            except ChildProcessError:  # a parent of the last one has noted its end
                self._seized.clear()
                self._stopped.clear()
                return
            if tid == 0:
                return
            if os.WIFSTOPPED(status):
                # One that was about to get a signal stops for that, and gets it afterwards.
                asked = status >> 16 == _EVENT_STOP
                self._stopped[tid] = 0 if asked else os.WSTOPSIG(status)
            else:
                self._seized.discard(tid)
                self._stopped.pop(tid, None)

    def _let_go(self) -> None:
        """Let all threads go on; one that has not stopped yet is let go as soon as it stops."""
        deadline = Deadline(HOLD_TIMEOUT_S)
        while self._seized and deadline.seconds_left:
            for tid in list(self._stopped):
                self._detach_thread(tid)
            self._note_stops()
            if self._seized - self._stopped.keys():
                threading.Event().wait(LOOK_S)

    def _detach_thread(self, tid: int) -> None:
        owed = self._stopped.pop(tid)
        with suppress(ProcessLookupError):  # it was killed
            _ptrace(_DETACH, tid, owed)
            self._seized.discard(tid)


def _is_of_dds(tid: int, code: Callable[[], Sequence[range]]) -> bool:
    """Return whether a held thread is one of Fast DDS: by its name, and by how it began.

    ``code`` returns where the code of DDS is in its process.
    """
    with suppress(OSError, ValueError):
        if Path(f"/proc/{tid}/comm").read_bytes().startswith(DDS_THREADS):
            registers = _read_registers(tid)
            with Path(f"/proc/{tid}/mem").open("rb", buffering=0) as memory:
                found = os.pread(memory.fileno(), _DESCRIPTOR_BYTES, registers[_DESCRIPTOR])
            return points_into(found, code())
    return False


def code_of(process: str, libraries: tuple[str, ...]) -> list[range]:
    """Return where the code of libraries of ROS 2 is in a process, as they were installed with it.

    A submission can have a file of the same name. But it cannot put it there.

    Args:
        process: its folder, or that of one of its threads.
        libraries: what the names of their files begin with.

    Raises:
        OSError: it has ended.
    """
    names = "|".join(map(re.escape, libraries))
    path = rf"{re.escape(str(_ros_prefix()))}/(?:[^\n]*/)?(?:{names})[^/\n]*"
    executable = rf"^([0-9a-f]+)-([0-9a-f]+) ..x\S+ \S+ \S+ \S+ +{path}$"
    mappings = Path(process, "maps").read_bytes()  # as text, other line ends would count as well
    found = re.findall(os.fsencode(executable), mappings, re.MULTILINE)
    return [range(int(start, 16), int(end, 16)) for start, end in found]


@cache
def _ros_prefix() -> Path:
    """Return where ROS 2 is installed: rclpy is in ``lib/python3.x/site-packages`` there."""
    rclpy = find_spec("rclpy")
    assert rclpy is not None
    assert rclpy.origin is not None
    return Path(rclpy.origin).resolve().parents[4]


def points_into(words: bytes, code: Sequence[range]) -> bool:
    """Return whether one of these words from a memory is a place in some code."""
    places = [place for (place,) in struct.iter_unpack("Q", words[: len(words) // 8 * 8])]
    return any(place in part for part in code for place in places)


def _thread_state(tid: int) -> bytes:
    with suppress(OSError):
        # The name of a thread may hold anything.
        return Path(f"/proc/{tid}/stat").read_bytes().rpartition(b") ")[2][:1]
    return _ENDED[0]


def _has_ended(tid: int) -> bool:
    return _thread_state(tid) in _ENDED


def _is_at_work(tid: int) -> bool:
    """Return whether a held thread was stopped at work, and not while it waited.

    One that waited has been taken out of a system call, which is to be begun again. One that waits
    for a lock may have another, and stands where the owner of it may let go at any moment.
    """
    with suppress(ProcessLookupError):
        registers = _read_registers(tid)
        waited = registers[_RESULT] in _TAKEN_OUT and registers[_CALL] < 2**63
        return not waited or _waits_for_a_lock(tid)
    return False


def _read_registers(tid: int) -> Sequence[int]:
    registers = (ctypes.c_ulonglong * _REGISTERS)()
    _ptrace(_GET_REGISTERS, tid, ctypes.addressof(registers))
    return list(registers)


def _waits_for_a_lock(tid: int) -> bool:
    """Return whether a thread is in the C library's wait for a mutex.

    Waits for a condition, a semaphore or a time are other operations on a futex, or other values.
    """
    with suppress(OSError, ValueError):
        text = Path(f"/proc/{tid}/syscall").read_text(encoding="ascii")
        call, _, operation, value, *_ = (int(word, 0) for word in text.split())
        return call == _FUTEX and operation & 0x7F == _FUTEX_WAIT and value == _CONTENDED
    return False


_libc = ctypes.CDLL(None, use_errno=True)
_libc.ptrace.restype = ctypes.c_long
_libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]


def _ptrace(request: int, tid: int, data: int = 0) -> None:
    if _libc.ptrace(request, tid, None, data) == -1:
        number = ctypes.get_errno()
        raise OSError(number, f"ptrace: {os.strerror(number)}")


def _explain_refusal() -> str:
    """Return one sentence about why threads cannot be held."""
    yama = Path("/proc/sys/kernel/yama/ptrace_scope")
    scope = ""
    with suppress(OSError):
        scope = yama.read_text(encoding="ascii").strip()
    if scope in ("2", "3"):
        helps = f"{yama} is {scope}: set it to 1 with `sudo sysctl kernel.yama.ptrace_scope=1`"
    else:
        helps = "allow it (docker run --cap-add SYS_PTRACE, for instance)"
    return (
        "The threads of a submission cannot be held here because this machine does not let the "
        f"grader trace processes ({os.strerror(errno.EPERM)}): {helps}."
    )
