"""Control groups of submissions, as files: in a folder that stands for what systemd delegates."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from autograder.sandbox.confinement import control_groups
from autograder.sandbox.resource_limits import Limits
from course.util.cgroups import delegated_group

OWN = "user.slice/grading.scope"


@pytest.fixture
def scope(tmp_path: Path) -> Path:
    folder = tmp_path / OWN
    folder.mkdir(parents=True)
    (folder / "cgroup.controllers").write_text("cpu memory pids\n")
    (folder / "cgroup.procs").write_text("11\n12\n")
    (tmp_path / "table").write_text(f"4:memory:/old\n0::/{OWN}\n")
    return folder


def found(scope: Path) -> Path | None:
    mount = scope.parents[1]
    return delegated_group(mount, mount / "table")


def test_only_what_was_delegated_is_divided(scope: Path) -> None:
    assert found(scope) is None
    try:
        os.setxattr(scope, "user.delegate", b"1")
    except OSError as error:
        pytest.skip(f"no attributes of files here: {error}")
    assert found(scope) == scope
    (scope / "grader").mkdir()
    (scope.parents[1] / "table").write_text(f"0::/{OWN}/grader\n")
    assert found(scope) == scope
    (scope / "cgroup.controllers").write_text("cpu\n")
    assert found(scope) is None


def test_without_cgroups_there_is_none(tmp_path: Path) -> None:
    assert delegated_group(tmp_path, tmp_path / "nothing") is None
    assert control_groups.enable_controllers(None) is None


def test_the_grader_moves_out_of_the_way_and_each_submission_is_bounded(scope: Path) -> None:
    (scope / "cgroup.subtree_control").write_text("")
    assert control_groups.enable_controllers(scope) == scope
    assert (scope / "grader/cgroup.procs").read_text() == "12"  # the last that was written
    assert (scope / "cgroup.subtree_control").read_text() == "+memory +pids"
    limits = Limits()
    group = control_groups.ControlGroup(scope, limits)
    (made,) = scope.glob("submission-*")
    group.add_process(77)
    said = {path.name: path.read_text() for path in made.iterdir()}
    assert said == {
        "memory.max": str(limits.memory), "memory.swap.max": "0", "pids.max": str(limits.tasks),
        "cgroup.procs": "77",
    }  # fmt: skip


def test_a_group_that_cannot_be_made_leaves_the_watch(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        control_groups.ControlGroup(tmp_path / "gone", Limits())
