"""What people meet first: dependencies, commands, platforms, and the README's promises."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
import typer
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from course.errors import CourseError
from course.util.platform_check import (
    UnsupportedPlatformError,
    find_problem,
    require_supported_platform,
)
from course.workspace import content
from tests.modules import modules_of

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
CONSTRAINTS = (ROOT / ".ci" / "constraints.txt").read_text(encoding="utf-8").splitlines()
HERE = {
    "system": "Linux", "machine": "x86_64", "implementation": "CPython", "version": (3, 12),
    "libc": "glibc", "ros": False,
}  # fmt: skip


@pytest.fixture(scope="module")
def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def requirements(project: dict[str, Any]) -> list[Requirement]:
    texts = [*project["project"]["dependencies"], *project["dependency-groups"]["dev"]]
    return [Requirement(text) for text in texts]


def test_every_dependency_has_a_lower_and_an_upper_bound(project: dict[str, Any]) -> None:
    for requirement in requirements(project):
        operators = {specifier.operator for specifier in requirement.specifier}
        assert {">=", "<"} <= operators, requirement


def test_the_constraints_are_versions_and_nothing_else(project: dict[str, Any]) -> None:
    assert sorted(set(CONSTRAINTS), key=lambda line: line.partition("==")[0]) == CONSTRAINTS
    pinned = {}
    for line in CONSTRAINTS:
        found = re.fullmatch(r"([a-z0-9-]+)==([0-9][0-9a-z.]*)", line)
        assert found, line
        pinned[found[1]] = found[2]
    for requirement in requirements(project):
        version = pinned[canonicalize_name(requirement.name)]
        assert requirement.specifier.contains(version), requirement


@pytest.mark.skipif("PYTEST_XDIST_WORKER" not in os.environ, reason="one process runs all")
@pytest.mark.xdist_group("together")
def test_tests_of_one_group_share_a_process(request: pytest.FixtureRequest) -> None:
    # pytest-xdist goes by the ending of the id, and says nothing when it can set none.
    assert request.node.nodeid.endswith("@together")


def test_no_lock_file_and_no_address_of_an_index_is_kept() -> None:
    assert "uv.lock" in (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()
    for name in ("pyproject.toml", ".ci/constraints.txt", ".ci/run"):
        assert "://" not in (ROOT / name).read_text(encoding="utf-8"), name


def test_a_wheel_carries_what_the_commands_look_for(project: dict[str, Any]) -> None:
    included = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    for path in included:
        assert (ROOT / path).exists(), path
    notebooks = {path.name for path in (ROOT / "notebooks").iterdir()}
    made_by_nbgrader = {"release", "submitted", "autograded", "feedback", "gradebook.db"}
    own = {n for n in notebooks - made_by_nbgrader if not n.startswith((".", "__"))} - {
        "grades.csv"
    }
    assert {Path(path).name for path in included if path.startswith("notebooks/")} == own
    assert included.keys() - {f"notebooks/{name}" for name in own} == {".ci/constraints.txt"}
    for target in included.values():
        assert target.startswith("course/data/")


def test_a_plain_jupyter_lab_has_the_settings_of_course_lab(tmp_path: Path) -> None:
    """They lie in the environment, so that a hub, too, needs nothing but the package."""
    code = """
import json
from jupyterlab_server.config import get_page_config
from jupyter_core.paths import jupyter_config_path
from nbgrader.apps import NbGrader
app = NbGrader()
app.load_config_file()
page = get_page_config(jupyter_config_path())
print(json.dumps([app.config.Execute.timeout, page["disabledExtensions"]]))
"""
    none = {name: str(tmp_path) for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR")}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env={**os.environ, **none},
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    settings = Path(content.__file__).parent / "jupyter"
    timeout, disabled = json.loads(done.stdout)
    assert (
        timeout == json.loads((settings / "nbgrader_config.json").read_text())["Execute"]["timeout"]
    )
    page = json.loads((settings / "labconfig" / "page_config.json").read_text())
    for name, off in page["disabledExtensions"].items():
        assert (name in disabled) == off, name


def test_the_material_is_found_beside_the_packages_or_in_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert content.content_root() == ROOT / "notebooks"
    monkeypatch.setattr(content, "_CLONE", tmp_path / "site-packages")
    monkeypatch.setattr(content, "_DATA", tmp_path / "data")
    with pytest.raises(CourseError, match="missing from this installation"):
        content.content_root()
    (tmp_path / "data" / "notebooks").mkdir(parents=True)
    assert content.content_root() == tmp_path / "data" / "notebooks"


def test_the_course_root_to_work_in_is_never_the_installed_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert content.working_root() == ROOT / "notebooks"
    inside = content.copy_authoring(content.content_root(), tmp_path / "mine") / "authoring"
    monkeypatch.chdir(inside)
    assert content.working_root() == tmp_path / "mine"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(content, "_CLONE", tmp_path / "site-packages")
    with pytest.raises(CourseError, match="--root"):
        content.working_root()


def test_copying_the_sources_leaves_out_what_nobody_wrote(tmp_path: Path) -> None:
    mine = content.copy_authoring(content.content_root(), tmp_path / "mine")
    for rubbish in ("__pycache__", ".ipynb_checkpoints"):
        (mine / "authoring" / "assignments" / rubbish).mkdir()
    copy = content.copy_authoring(mine, tmp_path / "copy")
    names = {path.name for path in (copy / "authoring").rglob("*")}
    assert "ch05.toml" in names
    assert not names & {"__pycache__", ".ipynb_checkpoints"}


def test_copying_the_sources_says_what_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(CourseError, match="it is not a course root"):
        content.copy_authoring(tmp_path, tmp_path / "new")
    (tmp_path / "file").touch()
    with pytest.raises(CourseError, match="cannot be copied to"):
        content.copy_authoring(content.content_root(), tmp_path / "file")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"system": "Darwin", "machine": "arm64"}, "not for Darwin arm64"),
        ({"system": "Darwin"}, "not for Darwin x86_64"),
        ({"system": "Windows", "machine": "AMD64"}, "WSL 2"),
        ({"system": "Windows", "machine": "AMD64", "ros": True}, "WSL 2"),
        ({"machine": "aarch64", "ros": True, "version": (3, 10)}, "not CPython 3.10"),
        ({"machine": "aarch64"}, "not for Linux aarch64"),
        ({"libc": ""}, "glibc"),
        ({"version": (3, 10)}, "not CPython 3.10"),
        ({"version": (3, 15)}, "not CPython 3.15"),
        ({"implementation": "PyPy"}, "not PyPy 3.12"),
    ],
)
def test_a_platform_without_wheels_is_one_clear_sentence(change: dict[str, Any], says: str) -> None:
    sentence = find_problem(**{**HERE, **change})
    assert sentence is not None
    assert says in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize("version", [(3, 11), (3, 12), (3, 13), (3, 14)])
def test_the_platforms_that_have_wheels_are_welcome(version: tuple[int, int]) -> None:
    assert find_problem(**{**HERE, "version": version}) is None
    require_supported_platform()


@pytest.mark.parametrize(
    "change",
    [
        {"machine": "aarch64"},
        {"system": "Darwin", "machine": "arm64", "libc": ""},
        {"system": "Darwin", "libc": ""},
        {"libc": ""},
    ],
)
def test_a_ros_that_is_there_already_is_welcome_where_there_are_no_wheels(
    change: dict[str, Any],
) -> None:
    assert find_problem(**{**HERE, **change, "ros": True}) is None


def test_pip_asks_for_the_wheels_only_where_there_are_some(project: dict[str, Any]) -> None:
    wheels = [r for r in requirements(project) if r.name.startswith("ros-")]
    assert len(wheels) >= 10
    here = {"sys_platform": "linux", "platform_machine": "x86_64"}
    for change in ({}, {"platform_machine": "aarch64"}, {"sys_platform": "darwin"}):
        for wheel in wheels:
            assert wheel.marker is not None
            assert wheel.marker.evaluate({**here, **change}) == (not change), (wheel, change)


def test_the_platform_check_and_the_metadata_agree(project: dict[str, Any]) -> None:
    bounds = Requirement(f"python{project['project']['requires-python']}").specifier
    for minor in range(9, 18):
        welcome = find_problem(**{**HERE, "version": (3, minor)}) is None
        assert bounds.contains(f"3.{minor}") == welcome, minor


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )


@pytest.mark.parametrize("command", ["course", "autograder"])
def test_a_command_on_a_foreign_platform_says_so_before_anything_is_imported(command: str) -> None:
    code = "import platform; platform.system = lambda: 'Darwin'\n"
    code += "import course.util.platform_check as check; check.has_rclpy = lambda: False\n"
    code += f"from course.command_line.launch import {command}; {command}()"
    done = run(code)
    assert done.returncode == UnsupportedPlatformError.exit_code == 2
    assert done.stdout == ""
    [line] = done.stderr.splitlines()
    assert line.startswith(f"{command}: There is no ROS 2 here")


@pytest.mark.parametrize(
    ("command", "arguments", "told"),
    [
        ("autograder", ["demo"], "autograder: "),
        ("course", ["lab", "there"], "course: "),
        ("course", ["doctor"], "problem  ROS 2: "),
    ],
)
def test_a_command_without_rclpy_says_how_to_get_it_back(
    command: str, arguments: list[str], told: str, tmp_path: Path
) -> None:
    """As after a second `uv sync`: all is there but the modules that it took for strangers."""
    libraries = tmp_path / "libraries"
    libraries.mkdir()
    for path in Path(sysconfig.get_path("purelib")).iterdir():
        if path.name != "rclpy":
            (libraries / path.name).symlink_to(path)
    code = f"import sys; sys.path[:0] = {[str(ROOT), str(libraries)]}; sys.argv[1:] = {arguments}\n"
    code += f"from course.command_line.launch import {command}; {command}()"
    done = subprocess.run(
        [sys.executable, "-S", "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode != 0
    assert "Traceback" not in done.stdout + done.stderr
    said = done.stdout + done.stderr
    assert f"{told}Parts of ROS 2 are gone" in said
    assert "uv run --reinstall" in said


def test_the_commands_start_at_the_launcher_which_needs_nothing(project: dict[str, Any]) -> None:
    scripts = project["project"]["scripts"]
    assert scripts == {n: f"course.command_line.launch:{n}" for n in ("course", "autograder")}
    done = run(
        "import sys; before = set(sys.modules); import course.command_line.launch\n"
        "new = {name.partition('.')[0] for name in set(sys.modules) - before}\n"
        "print(sorted(new - set(sys.stdlib_module_names) - {'course'}))"
    )
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_the_installed_metadata_are_those_of_this_project(project: dict[str, Any]) -> None:
    assert metadata.version("ros2-course") == project["project"]["version"]


def commands(app: typer.Typer) -> set[str]:
    own = {c.name or c.callback.__name__ for c in app.registered_commands if c.callback}
    return own | {group.name for group in app.registered_groups if group.name}


def test_every_command_in_the_readme_exists() -> None:
    from autograder.cli import app as autograder
    from course.command_line.cli import app as course

    named = set(re.findall(r"uv run (course|autograder) ([a-z]+)", README))
    there = {("course", name) for name in commands(course)}
    there |= {("autograder", name) for name in commands(autograder)}
    assert named <= there
    assert {("course", "lab"), ("course", "doctor"), ("autograder", "demo")} <= named


def test_every_path_in_the_readme_exists() -> None:
    named = set(
        re.findall(r"`((?:notebooks|autograder|course|quizzes|tests|\.ci)/[\w./-]*)`", README)
    )
    made_on_the_way = {"notebooks/release/ch05", "notebooks/grades.csv"}
    patterns = {path.split("NAME")[0].split("ASSIGNMENT")[0] for path in named - made_on_the_way}
    assert {path for path in patterns if not (ROOT / path).exists()} == set()


def test_ci_ends_with_the_readmes_own_test_command() -> None:
    script = ROOT / ".ci" / "run"
    assert script.stat().st_mode & 0o111
    subprocess.run(["bash", "-n", script], check=True, timeout=10)
    last = script.read_text(encoding="utf-8").splitlines()[-1]
    assert last == "uv run pytest"
    assert f"pip install uv && {last}" in README
    assert "pip install uv && uv run autograder demo" in README


def test_nothing_in_the_packages_reaches_the_wrong_way() -> None:
    """Imports run one way: autograder to course to quizzes, and these to nothing of ours."""
    allowed = {
        "course": {"course", "quizzes"}, "autograder": {"autograder", "course", "quizzes"},
        "quizzes": {"quizzes"},
    }  # fmt: skip
    ours = {*allowed, "notebooks", "tests"}
    for package, may in allowed.items():
        for path in modules_of(ROOT / package):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
                names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
                wrong = {name.partition(".")[0] for name in names} & ours - may
                assert not wrong, f"{path.relative_to(ROOT)} imports {wrong}"
