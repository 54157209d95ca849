"""How much of the machine one submission may use.

Two mechanisms, because neither is enough: the kernel's resource limits hold for each process (and
for the number of processes of the sandbox's user), a watcher outside adds up the whole tree.
"""

from __future__ import annotations

import json
import resource
from dataclasses import asdict, dataclass

MIB = 1024 * 1024

EXAMINER_MEMORY = 3 * 1024 * MIB
"""Bytes of writable memory that an examiner may reserve."""


@dataclass(frozen=True)
class Limits:
    """Bounds for one submission; sizes in bytes, times in seconds.

    Attributes:
        memory: what all its processes together may hold.
        data: writable memory that one process may reserve; beyond it Python raises MemoryError.
        addresses: addresses that one process may use: a table of them costs memory, too, even where
            there is nothing yet (512 times less).
        tasks: processes and threads at a time.
        processes: processes at a time; a bomb is ended before it has slowed others down.
        busy: processes and threads that run, or wait for a processor, at a time.
        busy_processes: of these, processes. Nothing of an exercise needs more than two, and each in
            a session of its own has as much of the processor as all of a neighbour's (sched(7)).
        crowd: seconds that they may be more; every second in which they are not takes one back.
        crowd_of_processes: the same where it is the processes that are too many.
        cpu: processor time of all its processes together.
        file: largest file.
        open_files: open file descriptors of one process.
        all_files: those of all its processes.
        sockets: in its network, those included that no process has open any more, as they are under
            way to another; the kernel holds 200 KB of messages for one. None if the network is
            another's: then what waits in it is not its memory, either.
        locks: of parts of files.
        inodes: files and folders in each of its scratch folders, which cost memory if empty, too.
        scratch: room in its home folder, in /tmp and in /dev/shm, each.
        wall: time from start to end, exams included.
    """

    memory: int = 1536 * MIB
    data: int = 2048 * MIB
    addresses: int = 32 * 1024 * MIB
    tasks: int = 200
    processes: int = 32
    busy: int = 12
    busy_processes: int = 4
    crowd: int = 3
    crowd_of_processes: int = 1
    cpu: int = 300
    file: int = 64 * MIB
    open_files: int = 1024
    all_files: int = 2048
    sockets: int | None = 1200
    locks: int = 5000
    inodes: int = 20_000
    scratch: int = 64 * MIB
    wall: int = 900

    @classmethod
    def of_examiner(cls) -> Limits:
        """Return those of an examiner: a flood of messages ends it, not the machine.

        It is in its subject's network, where whatever there is too much of is the subject's doing.
        """
        return cls(
            memory=EXAMINER_MEMORY, data=EXAMINER_MEMORY, processes=8, cpu=900, scratch=16 * MIB,
            wall=1200, sockets=None,
        )  # fmt: skip

    def to_json(self) -> str:
        """Return the limits as JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Limits:
        """Read what `to_json` wrote."""
        return cls(**json.loads(text))

    def of_processes(self) -> dict[str, int]:
        """Return what the kernel holds each process to: {resource as in prlimit(1): most}.

        No process may have more than this one anyway.
        """
        wanted = {
            "data": self.data, "nproc": self.tasks, "cpu": self.cpu, "fsize": self.file,
            "nofile": self.open_files, "core": 0, "as": self.addresses, "msgqueue": 0,
            "sigpending": self.tasks,
        }  # fmt: skip
        bounds = {}
        for name, bound in wanted.items():
            _, hard = resource.getrlimit(_resource_number(name))
            bounds[name] = bound if hard == resource.RLIM_INFINITY else min(bound, hard)
        return bounds

    def apply(self) -> None:
        """Limit this process and all that it starts, for good."""
        for name, most in self.of_processes().items():
            resource.setrlimit(_resource_number(name), (most, most))


def _resource_number(name: str) -> int:
    number: int = getattr(resource, f"RLIMIT_{name.upper()}")
    return number
