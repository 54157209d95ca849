"""Attacks on what one user's processes share, where an ordinary Unix user grades.

A user's sandboxes are made in user namespaces, and their processes are, to the kernel, the user's
own: what one user's processes share with each other (quotas, leases, signals) must not be a way
from a submission to its grader.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests import people
from tests.machine import needs_isolation, needs_users

GROUPS = 3
NAMES = [
    "blinds-the-watch", "broken-protocol", "child-leak", "daemon", "daemon-orphan",
    "empty-files", "escapes", "file-locks", "forged-frames", "forged-replies",
    "forged-verdict", "fork-bomb", "kills-everybody", "locks-our-files", "memory-bomb",
    "memory-bomb-shared", "monolith-hidden", "network", "page-tables", "patches",
    "poisons-cache", "reads-files", "socket-hoard", "talks-over-the-examiner",
    "type-name-as-path",
]  # fmt: skip
TABLE = "tests/hostile/test_hostile.py::test_an_attack_is_contained_and_explained_and_hurts_nobody"

pytestmark = [needs_isolation, needs_users, pytest.mark.timeout(1800)]


@pytest.mark.parametrize("group", range(GROUPS))
def test_the_attacks_are_contained_where_an_ordinary_user_grades(
    group: int, tmp_path: Path
) -> None:
    names = NAMES[group::GROUPS]
    users = people.People(tmp_path, ["grader"])
    command = [
        sys.executable, "-P", "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider",
        "--rootdir", str(people.PROJECT), "--basetemp", str(users["grader"].home / "tests"),
        *(f"{TABLE}[{name}]" for name in names),
    ]  # fmt: skip
    said = users.run("grader", *command, cwd=people.PROJECT)
    assert f"{len(names)} passed" in said
