"""Tests that need what a machine may lack: they carry the mark ``needs`` with what is missing."""

from __future__ import annotations

import pytest

from tests.left_out import leave_out


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "needs(problem): why the test cannot run here, or ''")


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Leave a test out before its fixtures are made: they need what it needs."""
    for mark in item.iter_markers("needs"):
        if problem := mark.args[0]:
            leave_out(problem)
