"""Standard output for answers alone: whatever a library prints there goes to standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable


def claim_stdout() -> Callable[[str], None]:
    """Take standard output away from everybody else; return a function that writes a line there.

    Fast DDS prints complaints about shared memory that a killed process has left behind.
    """
    file = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())

    def answer(line: str) -> None:
        file.write(line + "\n")
        file.flush()

    return answer
