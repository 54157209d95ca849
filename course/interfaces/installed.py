"""Which interfaces are installed, read from the ament index (no import of any of them)."""

from __future__ import annotations

import difflib
import functools
import os
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

Package = frozenset[str]  # "msg/Pose", "srv/SetBool", ...


def ament_prefixes() -> list[Path]:
    """Return the ament prefixes: ``AMENT_PREFIX_PATH`` and the environment of the wheels."""
    named = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return list(dict.fromkeys(Path(p) for p in (*named, sys.prefix) if p))


@functools.cache
def read_index() -> Mapping[str, Package]:
    """Return, for each installed interface package, what it defines."""
    found: dict[str, Package] = {}
    for prefix in reversed(ament_prefixes()):
        index = prefix / "share/ament_index/resource_index/rosidl_interfaces"
        for entry in sorted(index.iterdir()) if index.is_dir() else ():
            files = entry.read_text(encoding="utf-8").split()
            found[entry.name] = frozenset(f.rpartition(".")[0] for f in files)
    return found


def prefix_of(package: str) -> Path:
    """Return the prefix that ``package`` is installed in; raise ``LookupError`` if in none."""
    for prefix in ament_prefixes():
        if (prefix / "share/ament_index/resource_index/rosidl_interfaces" / package).is_file():
            return prefix
    raise LookupError(package)


def message_names(package: str) -> set[str]:
    """Return the names of the messages of an installed package (empty if not installed)."""
    found = read_index().get(package, frozenset())
    return {name[4:] for name in found if name.startswith("msg/")}


def suggest_message(package: str, name: str, own: Iterable[str], own_package: str) -> list[str]:
    """Return up to three message types that ``package/name`` may have been meant to be."""
    every = {f"{p}/{m}" for p in read_index() for m in message_names(p)}
    every |= {f"{own_package}/{m}" for m in own}
    same_name = [t for t in every if t.partition("/")[2].lower() == name.lower()]
    close_package = difflib.get_close_matches(package, {t.partition("/")[0] for t in every}, 3, 0.7)
    ranked = sorted(same_name, key=lambda t: (t.partition("/")[0] not in close_package, len(t), t))
    ranked += difflib.get_close_matches(f"{package}/{name}", every, 3, 0.8)
    return list(dict.fromkeys(ranked))[:3]
