"""Remove shared-memory ports of Fast DDS that a killed program has left half made.

Fast DDS makes a file for each port, sizes it, and marks it as initialised. A participant that opens
a file which is not marked yet waits for the process that makes it, without a deadline
(Boost.Interprocess, ``managed_open_or_create_impl``). If that process was killed just then, as a
kernel is that does not end by itself when it is restarted, every later participant on this port
hangs for ever.
"""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from pathlib import Path

from course.runtime.domains.rtps_ports import DOMAIN_GAIN, USUAL_BASE

FOLDER = Path("/dev/shm")
MAKING_S = 1.0
"""Seconds that making a port takes at most; it takes some microseconds."""

_INITIALISED = (2).to_bytes(4, "little")
_LOOK_AGAIN_S = 0.01


def remove_abandoned(domain_id: int, folder: Path = FOLDER) -> None:
    """Remove a domain's ports that were left half made; wait for one that may be in the making.

    Another user's stay: DDS may not open them and goes on without. Other domains' ports are not
    looked at: where kernels are killed, there are thousands of them in time.
    """
    first = USUAL_BASE + DOMAIN_GAIN * domain_id
    for port in range(first, first + 2 * DOMAIN_GAIN):  # the last participants' are the next one's
        path = folder / f"fastrtps_port{port}"
        with suppress(OSError):  # there is none; its maker has removed it, or is another user
            if _is_abandoned(path):
                path.unlink()


def _is_abandoned(path: Path) -> bool:
    never = threading.Event()
    while not _is_initialised(path):
        if not 0 <= time.time() - path.stat().st_mtime < MAKING_S:
            return True
        never.wait(_LOOK_AGAIN_S)
    return False


def _is_initialised(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(_INITIALISED)) == _INITIALISED
