"""File descriptors in the numbers that it takes to watch over many submissions at a time."""

from __future__ import annotations

import math
import resource
import select
from collections.abc import Iterable
from typing import Protocol

ENOUGH = 65536
"""More than any number of jobs at a time needs; one that runs holds about twenty."""


class HasDescriptor(Protocol):
    """A socket, a pipe, an open file."""

    def fileno(self) -> int:
        """Return its descriptor."""


def readable_descriptors(
    streams: Iterable[HasDescriptor | int], timeout: float | None
) -> list[int]:
    """Return the descriptors, of those streams, that can be read or are at their end.

    Waits for the first at most ``timeout`` seconds; None: as long as it takes. Unlike `select`,
    which knows the first 1024 descriptors of a process only.
    """
    poll = select.poll()
    for stream in streams:
        poll.register(stream, select.POLLIN)
    ready = poll.poll(None if timeout is None else math.ceil(max(0.0, timeout) * 1000))
    return [descriptor for descriptor, _ in ready]


def allow_many() -> None:
    """Let this process have as many open as the machine grants it; systems start with 1024."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = ENOUGH if hard == resource.RLIM_INFINITY else min(hard, ENOUGH)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
