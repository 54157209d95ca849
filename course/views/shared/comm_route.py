"""ipykernel 7.4: what a view's controls say must not wait for the cell that runs.

JupyterLab sends what a widget's page says to a subshell (JEP 91), a thread of the kernel beside the
one that runs cells. Since 7.4 (for its issue 1510) ipykernel hands it to the shell instead in whose
name the widget has spoken last. A view is kept up to date by a thread, which speaks in the name of
the newest cell: all its controls would wait until that cell ends. No longer needed once
tests/browser/test_busy_kernel.py passes without it.
"""

from __future__ import annotations

from typing import Any

_ROUTE = "_reply_subshell_for"


def keep_senders_choice(comm: Any) -> None:
    """Let each message to ``comm`` be handled by the shell that it was sent to."""
    if hasattr(comm, _ROUTE):
        setattr(comm, _ROUTE, lambda _data, senders_choice: senders_choice)
