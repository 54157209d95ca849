"""What a course takes off for lateness: by which rule, and what came of it, in words."""

from __future__ import annotations

import hashlib
import inspect
import json
from pathlib import Path
from typing import Any

from nbgrader.preprocessors import AssignLatePenalties
from traitlets.config import Config


def rule_digest(config: Config) -> str:
    """Return a digest of the plugin that sets penalties: its class, its code, its settings.

    Raises:
        Exception: the configuration names a plugin that cannot be loaded; whatever that raises.
    """
    plugin: type[Any] = AssignLatePenalties(config=config).plugin_class
    classes = [AssignLatePenalties, *plugin.__mro__]
    settings = {kind.__name__: dict(config.get(kind.__name__, {})) for kind in classes}
    state = hashlib.sha256(json.dumps(settings, sort_keys=True, default=_qualified_name).encode())
    for kind in plugin.__mro__:
        state.update(_qualified_name(kind).encode() + b"\0" + _source_bytes(kind) + b"\0")
    return state.hexdigest()


def lateness_text(seconds: float) -> str:
    """Return how late something came, as people say it; empty if it was in time."""
    if seconds <= 0:
        return ""
    minutes = max(1, round(seconds / 60))
    days, rest = divmod(minutes, 24 * 60)
    hours, minutes = divmod(rest, 60)
    if days:
        return f"{days} d {hours} h"
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min"


def _source_bytes(kind: type[Any]) -> bytes:
    try:
        file = inspect.getsourcefile(kind)
        return Path(file).read_bytes() if file else b""
    except (TypeError, OSError):  # built in, or written in the configuration itself
        return b""


def _qualified_name(value: object) -> str:
    """Return what stands for a value that JSON does not have, the same in every process."""
    kind = value if isinstance(value, type) or callable(value) else type(value)
    return f"{getattr(kind, '__module__', '')}.{getattr(kind, '__qualname__', '')}"
