"""The image is built, without a daemon and a registry, and does what it is for."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.image.container import HOME, ROOT, Container

TOOLS = {"buildah": "buildah", "mmdebstrap": "mmdebstrap", "runc": "runc"}
MAX_COMPRESSED_MB = 350
BUILD_TIMEOUT_S = 1500


def build_problem() -> str:
    """Say why the image cannot be built and started here; empty if it can."""
    if os.geteuid() != 0:
        return "The image is built by root."
    missing = [TOOLS[tool] for tool in TOOLS if shutil.which(tool) is None]
    return f"The image needs: apt install {' '.join(missing)}" if missing else ""


pytestmark = [
    pytest.mark.needs(build_problem()),
    pytest.mark.xdist_group("image"),
    pytest.mark.timeout(BUILD_TIMEOUT_S + 300),
]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Give the folder that .devcontainer/build has filled."""
    folder = tmp_path_factory.mktemp("image")
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    done = subprocess.run(
        [ROOT / ".devcontainer" / "build", folder],
        env={**os.environ, "PATH": path}, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, timeout=BUILD_TIMEOUT_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    (folder / "rootfs" / ".dockerenv").touch()  # as Docker does, by which it is known
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="module")
def plain(built: Path) -> Container:
    return Container(built / "rootfs")


@pytest.fixture(scope="module")
def grader(built: Path) -> Container:
    return Container(built / "rootfs", may_grade=True)


def test_it_is_small(built: Path) -> None:
    assert int((built / "size").read_text()) <= MAX_COMPRESSED_MB * 10**6


def test_the_doctor_finds_nothing_and_says_what_grading_takes(
    plain: Container, grader: Container
) -> None:
    done = plain.run("course", "doctor", timeout_s=120)
    assert done.returncode == 0, done.stdout
    assert "seccomp=seccomp.json --security-opt systempaths=unconfined" in done.stdout
    profile = "/opt/ros2-course/share/ros2-course/seccomp.json"
    assert f"cat {profile}" in done.stdout
    assert plain.run("cat", profile, timeout_s=60).stdout == (
        ROOT / ".devcontainer" / "seccomp.json"
    ).read_text(encoding="utf-8")
    done = grader.run("course", "doctor", timeout_s=120)
    assert "it may make the namespaces that a sandbox takes" in done.stdout


def test_interfaces_are_built_with_its_compiler(plain: Container) -> None:
    program = (
        "import course.interfaces; from example_interfaces.action import Fibonacci; "
        "print(course.interfaces.status()['example_interfaces'].name)"
    )
    done = plain.run("python", "-c", program, timeout_s=300)
    assert done.returncode == 0, done.stdout
    assert done.stdout.split()[-1] == "BUILT", done.stdout


@pytest.mark.parametrize(
    ("notebook", "shows"),
    [
        ("ch05-building-blocks.ipynb", r"Next number in sequence"),
        ("ch05/qos-design.ipynb", r"\d+ of \d+ points"),
    ],
)
def test_a_student_runs_the_chapter_and_a_check(
    plain: Container, notebook: str, shows: str
) -> None:
    execute = ("jupyter", "nbconvert", "--to", "notebook", "--execute", "--stdout")
    done = plain.run(*execute, f"ros2-course/{notebook}", timeout_s=300)
    assert done.returncode == 0, done.stdout
    assert re.search(shows, done.stdout), done.stdout


def test_it_grades_the_demo_in_the_sandbox(grader: Container) -> None:
    done = grader.run("autograder", "demo", timeout_s=600)
    assert done.returncode == 0, done.stdout
    assert "without a sandbox" not in done.stdout


def test_grading_is_refused_where_docker_forbids_namespaces(
    built: Path, plain: Container, grader: Container
) -> None:
    root = f"{HOME}/ros2-course-demo"
    grades = built / "rootfs" / root.lstrip("/") / "grades.csv"
    if not grades.exists():
        assert grader.run("autograder", "demo", timeout_s=600).returncode == 0
    before = grades.read_bytes()
    done = plain.run("autograder", "grade", "ch05", "--fresh", "--root", root, timeout_s=300)
    assert done.returncode == 1, done.stdout
    assert "this container may not make namespaces" in done.stdout
    assert "--security-opt systempaths=unconfined" in done.stdout
    assert "Traceback" not in done.stdout
    assert grades.read_bytes() == before, "nothing is lost"


def test_jupyterlab_is_what_it_starts(plain: Container) -> None:
    done = plain.run("course", "lab", "--no-browser", "--ip=0.0.0.0", "--version", timeout_s=120)
    assert done.returncode == 0, done.stdout
    assert f"Your working copy is {HOME}/ros2-course" in done.stdout
