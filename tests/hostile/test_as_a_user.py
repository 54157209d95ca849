"""Attacks on what one user's processes share, where an ordinary Unix user grades.

A user's sandboxes are made in user namespaces, and their processes are, to the kernel, the user's
own: what one user's processes share with each other (quotas, leases, signals) must not be a way
from a submission to its grader. So every attack on the machine is run, but for those that are left
out by name: what an exam sees or hears is the same for every user.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests import people
from tests.hostile.test_hostile import HERE, attacks
from tests.machine import needs_isolation, needs_users

GROUPS = 4
LEFT_OUT = {
    "Outputs are cut, and ends told, before or after any sandbox": """
        exits output-display output-flood segfault""",
    "Only the clock ends them, which takes the longest of all and asks nobody for his rights": """
        endless-deaf programs-that-never-get-up-resources programs-that-never-get-up-safety
        slow-replies""",
    "Another attack by the same way is run": """
        busy-threads-put-nothing-off cpu-hog cpu-hog-sessions daemon disk-one-file memory-bomb
        memory-bomb-children memory-bomb-headless socket-hoard-in-a-node""",
}
"""Attacks that are not run here, by the reason; each takes a core for 10 to 20 s."""
NAMES = sorted(
    {attack.name for attack in attacks() if attack.reaches_machine}
    - {name for names in LEFT_OUT.values() for name in names.split()}
)
TABLE = "tests/hostile/test_hostile.py::test_an_attack_is_contained_and_explained_and_hurts_nobody"
TAKEN = "tests/hostile/test_taken_examiner.py"

pytestmark = [needs_isolation, needs_users, pytest.mark.timeout(1800)]


def test_what_is_left_out_is_an_attack() -> None:
    left_out = [name for names in LEFT_OUT.values() for name in names.split()]
    assert all((HERE / "attacks" / f"{name}.py").is_file() for name in left_out)
    assert len(left_out) == len(set(left_out))


@pytest.mark.parametrize("group", range(GROUPS))
def test_the_attacks_are_contained_where_an_ordinary_user_grades(
    group: int, tmp_path: Path
) -> None:
    names = NAMES[group::GROUPS]
    said = run_as_a_user(tmp_path, *(f"{TABLE}[{name}]" for name in names))
    assert f"{len(names)} passed" in said


def test_a_taken_examiner_is_contained_where_an_ordinary_user_grades(tmp_path: Path) -> None:
    said = run_as_a_user(tmp_path, TAKEN, "-k", "test_a_taken_examiner")
    assert " passed" in said
    assert "skipped" not in said


def run_as_a_user(folder: Path, *tests: str) -> str:
    """Run tests as somebody who is not root; return what pytest says, which must pass."""
    users = people.People(folder, ["grader"])
    command = [
        sys.executable, "-P", "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider",
        "--rootdir", str(people.PROJECT), "--basetemp", str(users["grader"].home / "tests"), *tests,
    ]  # fmt: skip
    return users.run("grader", *command, cwd=people.PROJECT)
