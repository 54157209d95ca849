"""The image is built, without a daemon and a registry, and does what it is for."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.image.container import HOME, PROFILE, ROOT, Container

TOOLS = ("buildah", "mmdebstrap", "crun")
MAX_COMPRESSED_MB = 350
BUILD_TIMEOUT_S, RUN_TIMEOUT_S = 1200, 600
PROFILE_INSIDE = "/opt/ros2-course/share/ros2-course/seccomp.json"
DOCKER_OPTIONS = "--security-opt seccomp=seccomp.json --security-opt systempaths=unconfined"

START_LAB = r"""
import re, subprocess, sys, time, urllib.error, urllib.request
lab = subprocess.Popen(sys.argv[1:], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
for line in lab.stdout:
    print(line, end="", flush=True)
    if found := re.search(r"http://127\.0\.0\.1:8888/lab\S*\?token=\S+", line):
        break
while lab.poll() is None:  # it says its address a moment before it listens
    try:
        print("answer:", urllib.request.urlopen(found[0], timeout=60).status)
        lab.terminate()
        lab.wait(60)
    except urllib.error.URLError:
        time.sleep(0.1)
"""
"""Starts JupyterLab by the command given, as a browser opens the address that it says."""


def build_problem() -> str:
    """Say why the image cannot be built and started here; empty if it can."""
    if os.geteuid() != 0:
        return "The image is built by root."
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    return f"The image needs: apt install {' '.join(missing)}" if missing else ""


pytestmark = [
    pytest.mark.needs(build_problem()),
    pytest.mark.xdist_group("image"),
    pytest.mark.timeout(BUILD_TIMEOUT_S + 2 * RUN_TIMEOUT_S),
]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Give the folder that .devcontainer/build has filled, and remove it."""
    folder = tmp_path_factory.mktemp("image")
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}:/usr/sbin"
    try:
        done = subprocess.run(
            [ROOT / ".devcontainer" / "build", folder],
            env={**os.environ, "PATH": path}, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, timeout=BUILD_TIMEOUT_S, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout
        (folder / "rootfs" / ".dockerenv").touch()  # as Docker does, by which it is known
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="module")
def plain(built: Path) -> Container:
    return Container(built / "rootfs")


@pytest.fixture(scope="module")
def grader(built: Path) -> Container:
    return Container(built / "rootfs", may_grade=True)


def test_it_is_small_and_nothing_of_its_making_is_left(built: Path) -> None:
    assert {path.name for path in built.iterdir()} == {"rootfs", "ros2-course.tar.gz", "build.log"}
    assert (built / "ros2-course.tar.gz").stat().st_size <= MAX_COMPRESSED_MB * 10**6


def test_the_doctor_finds_nothing_and_says_what_grading_takes(
    plain: Container, grader: Container
) -> None:
    done = plain.run("course", "doctor", timeout_s=RUN_TIMEOUT_S)
    assert done.returncode == 0, done.stdout
    assert "All is well" in done.stdout
    assert DOCKER_OPTIONS in done.stdout
    assert f"cat {PROFILE_INSIDE}" in done.stdout
    profile = plain.run("cat", PROFILE_INSIDE, timeout_s=RUN_TIMEOUT_S).stdout
    assert profile == PROFILE.read_text(encoding="utf-8")
    done = grader.run("course", "doctor", timeout_s=RUN_TIMEOUT_S)
    assert "it may make the namespaces that a sandbox takes" in done.stdout


def test_jupyterlab_is_what_it_starts(plain: Container) -> None:
    text = (ROOT / ".devcontainer" / "Containerfile").read_text(encoding="utf-8")
    [default] = re.findall(r"^CMD (.+)$", text, re.MULTILINE)
    done = plain.run("python", "-c", START_LAB, *json.loads(default), timeout_s=RUN_TIMEOUT_S)
    assert f"Your working copy is {HOME}/ros2-course" in done.stdout, done.stdout
    assert "answer: 200" in done.stdout, done.stdout


def test_interfaces_are_built_with_its_compiler(plain: Container) -> None:
    program = (
        "import course.interfaces; from example_interfaces.action import Fibonacci; "
        "print(course.interfaces.status()['example_interfaces'].name)"
    )
    done = plain.run("python", "-c", program, timeout_s=RUN_TIMEOUT_S)
    assert done.returncode == 0, done.stdout
    assert done.stdout.split()[-1] == "BUILT", done.stdout


@pytest.mark.parametrize(
    ("notebook", "shows"),
    [
        ("ch05-building-blocks", "order 8:  [0, 1, 1, 2, 3, 5, 8, 13, 21] - status SUCCEEDED"),
        ("ch05/qos-design", "qos: 0 of 10 points"),
    ],
)
def test_a_student_runs_the_chapter_and_a_check(
    plain: Container, notebook: str, shows: str
) -> None:
    execute = ("jupyter", "nbconvert", "--to", "notebook", "--execute", "--stdout")
    done = plain.run(*execute, f"ros2-course/{notebook}.ipynb", timeout_s=RUN_TIMEOUT_S)
    assert done.returncode == 0, done.stdout
    assert shows in done.stdout, done.stdout


def test_it_grades_in_the_sandbox_and_refuses_where_docker_forbids_one(
    built: Path, plain: Container, grader: Container
) -> None:
    done = grader.run("autograder", "demo", timeout_s=RUN_TIMEOUT_S)
    assert done.returncode == 0, done.stdout
    root = f"{HOME}/ros2-course-demo"
    grades = built / "rootfs" / root.lstrip("/") / "grades.csv"
    before = grades.read_bytes()
    again = ("autograder", "grade", "ch05", "--fresh", "--root", root)
    done = plain.run(*again, timeout_s=RUN_TIMEOUT_S)
    assert done.returncode == 1, done.stdout
    assert "this container may not make namespaces" in done.stdout
    assert DOCKER_OPTIONS in done.stdout
    assert f"cat {PROFILE_INSIDE}" in done.stdout
    assert "Traceback" not in done.stdout
    assert grades.read_bytes() == before, "nothing is lost"
