"""What tests need of a machine beyond Python packages.

Where it is missing, a test that is marked so is left out, with the reason; in CI it fails.
"""

from __future__ import annotations

import subprocess

import pytest

from autograder.sandbox import abilities
from course.interfaces.building.toolchain import compiler_problem
from course.qos_lab import link
from tests import people


def _needs(problem: str | None) -> pytest.MarkDecorator:
    return pytest.mark.needs(problem or "")


def _namespace_problem() -> str:
    tried = subprocess.run(
        ["unshare", "-rm", "true"], capture_output=True, text=True, timeout=60, check=False
    )
    return "" if tried.returncode == 0 else f"no mounts of one's own: {tried.stderr.strip()}"


def sandbox_problem() -> str:
    """Say why submissions cannot be sandboxed here, lost packets included; empty if they can."""
    able = abilities()
    return able.problem or ("" if able.loss else "The sandbox cannot lose packets: nft is missing.")


needs_isolation = _needs(abilities().problem)
"""A sandbox, be it one that cannot lose packets."""
needs_sandbox = _needs(sandbox_problem())
needs_warm_starts = _needs("" if abilities().warm else "The sandbox has no warm starts here.")
needs_compiler = _needs(compiler_problem())
needs_lossy_link = _needs(link.problem())
needs_own_mounts = _needs(_namespace_problem())
needs_users = _needs(people.problem())
