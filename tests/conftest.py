"""Tests that need what a machine may lack: they carry the mark ``needs`` with what is missing."""

from __future__ import annotations

import signal

import pytest

from tests.left_out import leave_out


def pytest_configure(config: pytest.Config) -> None:
    # A shell's script has what it starts in the background ignore Ctrl-C, and so does what that
    # starts: but some tests end a command by it, as people do.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    config.addinivalue_line("markers", "needs(problem): why the test cannot run here, or ''")


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Leave a test out before its fixtures are made: they need what it needs."""
    for mark in item.iter_markers("needs"):
        if problem := mark.args[0]:
            leave_out(problem)
