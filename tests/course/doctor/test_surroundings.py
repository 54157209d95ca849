"""WSL and containers: each is recognised by what it leaves, and says what matters there."""

from __future__ import annotations

from pathlib import Path

import pytest

from course.doctor.surroundings import examine_surroundings

LINUX, WSL2 = "6.8.0-45-generic", "5.15.153.1-microsoft-standard-WSL2"


@pytest.mark.parametrize(
    ("release", "folder", "status", "says"),
    [
        (WSL2, "/home/ana", "ok", "mirrored"),
        (WSL2, "/mnt/c/Users/Ana", "warning", "cd ~"),
        (WSL2, "/mnt/data/ana", "ok", "WSL 2"),
        ("4.4.0-19041-Microsoft", "/home/ana", "problem", "--set-version"),
    ],
)
def test_wsl_is_known_by_its_kernel(
    release: str, folder: str, status: str, says: str, tmp_path: Path
) -> None:
    [found] = examine_surroundings({}, release, tmp_path, Path(folder))
    assert (found.name, found.status) == ("WSL", status)
    assert says in f"{found.message} {found.mend}"


@pytest.mark.parametrize(
    ("variables", "mark", "kind"),
    [
        ({"CODESPACES": "true"}, ".dockerenv", "Codespaces"),
        ({"KUBERNETES_SERVICE_HOST": "10.0.0.1"}, None, "Kubernetes"),
        ({}, ".dockerenv", "Docker"),
        ({}, "run/.containerenv", "Podman"),
    ],
)
def test_a_container_is_known_by_what_it_leaves(
    variables: dict[str, str], mark: str | None, kind: str, tmp_path: Path
) -> None:
    if mark:
        (tmp_path / mark).parent.mkdir(exist_ok=True)
        (tmp_path / mark).touch()
    found, grading = examine_surroundings(variables, WSL2, tmp_path, allows_sandbox=lambda: True)
    assert (found.name, found.status) == ("container", "ok")
    assert f"one of {kind}," in found.message
    assert "--network=host" in found.message
    assert (grading.name, grading.status) == ("grading in this container", "ok")


@pytest.mark.parametrize(
    ("variables", "mark", "needed"),
    [
        ({}, ".dockerenv", ["seccomp=seccomp.json", "systempaths=unconfined", ".devcontainer"]),
        ({}, "run/.containerenv", ["unmask=ALL"]),
        ({"KUBERNETES_SERVICE_HOST": "10.0.0.1"}, None, ["procMount: Unmasked"]),
        ({"CODESPACES": "true"}, None, ["a machine of your own"]),
    ],
)
def test_a_container_without_namespaces_is_told_how_to_grade(
    variables: dict[str, str], mark: str | None, needed: list[str], tmp_path: Path
) -> None:
    if mark:
        (tmp_path / mark).parent.mkdir(exist_ok=True)
        (tmp_path / mark).touch()
    _, grading = examine_surroundings(variables, LINUX, tmp_path, allows_sandbox=lambda: False)
    assert grading.status == "ok", "no student needs it"
    for word in needed:
        assert word in grading.message


def test_a_machine_of_its_own_is_not_worth_a_line(tmp_path: Path) -> None:
    assert list(examine_surroundings({}, LINUX, tmp_path)) == []
