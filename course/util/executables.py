"""Where the system's tools are."""

from __future__ import annotations

import os
import shutil


def find_tool(name: str) -> str | None:
    """Return where a tool is: Debian has some where an ordinary user's PATH does not lead."""
    return shutil.which(name, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")
