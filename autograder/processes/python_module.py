"""How processes of ours are started: no working folder is ever on their path (``-P``).

A submission lies under the course root, which is where commands are run; a module of its own must
not be found there by any process of ours.
"""

from __future__ import annotations

import sys


def command(module: str) -> list[str]:
    """Return the beginning of a command that runs a module's ``main``."""
    return [sys.executable, "-P", "-m", module]
