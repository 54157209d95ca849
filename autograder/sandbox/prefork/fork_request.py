"""What a zygote is asked to fork, and how a fork becomes that process."""

from __future__ import annotations

import fcntl
import json
import os
import signal
import sys
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from importlib import import_module
from pathlib import Path

from autograder.sandbox.prefork import linux
from autograder.sandbox.resource_limits import Limits


@dataclass(frozen=True)
class ForkRequest:
    """A process to be forked. Its descriptors are handed over beside it, in the order given here.

    Attributes:
        module: the module whose ``main(arguments)`` is run.
        arguments: its command line.
        descriptors: the numbers that its descriptors get; 0, 1 and 2 are among them.
        namespaces: kinds of namespaces that it joins, each by a descriptor of it.
        process: it joins all namespaces of one process, by a pidfd, and that ends when it does.
        user: as root only: the user id that it takes on, for good.
        calls: it gives up all capabilities, and this filter (hexadecimal) decides about its system
            calls.
        environment: its environment, if not the zygote's own.
        limits: what it may use, as `Limits.to_json` writes it, if that is limited.
        folder: where it works, if not where the zygote does.
    """

    module: str
    arguments: list[str]
    descriptors: list[int]
    namespaces: list[str] = field(default_factory=list)
    process: bool = False
    user: int | None = None
    calls: str = ""
    environment: dict[str, str] | None = None
    limits: str = ""
    folder: str | None = None

    def to_json(self) -> bytes:
        """Return the request as JSON."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def from_json(cls, text: bytes) -> ForkRequest:
        """Read what `to_json` wrote."""
        return cls(**json.loads(text))

    def join_namespaces(self, handed: list[int]) -> tuple[list[int], int | None]:
        """Join the namespaces, by the first of the descriptors.

        Returns:
            The descriptors that are left, and the pidfd of the process that ends with this one.
        """
        pidfd = None
        if self.process:
            pidfd, *handed = handed
            linux.join_namespace(pidfd, _differing_namespaces(pidfd))
        for kind in self.namespaces:
            namespace, *handed = handed
            # The kernel lets nobody join the user namespace that it is in.
            if os.fstat(namespace).st_ino != Path(f"/proc/self/ns/{kind}").stat().st_ino:
                linux.join_namespace(namespace, linux.NAMESPACES[kind])
        return handed, pidfd

    def become_process(self, handed: list[int]) -> None:
        """Turn this process, a fork of a fork that has joined, into the one that is wanted.

        Nothing of the zygote's is left within its reach but the modules in its memory.
        """
        for number in (signal.SIGCHLD, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        os.setsid()
        _put_in_order(dict(zip(self.descriptors, handed, strict=True)))
        if self.environment is not None:
            os.environ.clear()
            os.environ.update(self.environment)
        if self.folder is not None:
            os.chdir(self.folder)
        if self.limits:
            Limits.from_json(self.limits).apply()
        if self.calls:
            linux.bound_capabilities()  # while it still has the right to
        if self.user is not None:
            os.setgroups([])
            os.setresgid(self.user, self.user, self.user)
            os.setresuid(self.user, self.user, self.user)
        if self.calls:
            linux.drop_capabilities()
            linux.allow_looking()
            linux.filter_calls(bytes.fromhex(self.calls))

    def run(self) -> int:
        """Run the module's ``main``; return its exit code."""
        sys.argv = [self.module, *self.arguments]
        if "numpy.random" in sys.modules:
            # Python's own generator is seeded again in a fork; this one must not be everybody's.
            sys.modules["numpy.random"].seed()
        return int(import_module(self.module).main(self.arguments) or 0)


def _differing_namespaces(pidfd: int) -> int:
    """Return the flags of those namespaces in which a process is not already where this one is."""
    info = Path(f"/proc/self/fdinfo/{pidfd}").read_text().splitlines()
    pid = next(int(line.split()[1]) for line in info if line.startswith("Pid:"))
    flags = 0
    for kind, flag in linux.NAMESPACES.items():
        theirs, ours = (Path(f"/proc/{who}/ns/{kind}").stat() for who in (pid, "self"))
        if theirs.st_ino != ours.st_ino:
            flags |= flag
    return flags


def _put_in_order(wanted: Mapping[int, int]) -> None:
    """Give each descriptor its number, as in {number: descriptor}, and close all others."""
    above = max(wanted) + 1  # where none is overwritten while they are moved
    high = {
        number: fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, above)
        for number, descriptor in wanted.items()
    }
    for number, descriptor in high.items():
        os.dup2(descriptor, number)
    close_others(wanted)


def close_others(kept: Iterable[int]) -> None:
    """Close all descriptors of this process but these."""
    low = 0
    for number in sorted(kept):
        if low < number:  # Python takes an empty range that starts at 0 for one without an end
            os.closerange(low, number)
        low = number + 1
    os.closerange(low, 2**31 - 1)
