"""`autograder wheelhouse`: what it makes installs and works where there is no network at all."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from packaging.utils import parse_wheel_filename

from autograder.commands import wheelhouse_command
from autograder.commands.wheelhouse_command import Wheelhouse, WheelhouseError, make_wheelhouse
from tests.left_out import leave_out
from tests.machine import needs_isolation, needs_own_mounts

pytestmark = [pytest.mark.timeout(1800), pytest.mark.xdist_group("wheelhouse")]

ROOT = Path(__file__).parents[3]
LONG_S = 1500.0


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Wheelhouse:
    try:
        return make_wheelhouse(tmp_path_factory.mktemp("wheelhouse"))
    except WheelhouseError as error:
        leave_out(str(error))


def offline(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a script where there is a loopback and nothing else, and no setting of pip's."""
    loopback = "ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo"
    alone = ["unshare", "-n"] if os.geteuid() == 0 else ["unshare", "-rn"]
    home = folder.parent / "home"
    home.mkdir(exist_ok=True)
    env = {
        "HOME": str(home), "PIP_CONFIG_FILE": os.devnull, "LANG": "C.UTF-8", "COLUMNS": "200",
        "PATH": f"{Path(sys.base_prefix) / 'bin'}:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
    }  # fmt: skip
    return subprocess.run(
        [*alone, "bash", "-ec", f"{loopback}\n{script}"], cwd=folder, env=env, text=True,
        capture_output=True, timeout=LONG_S, check=False,
    )  # fmt: skip


@needs_isolation
@needs_own_mounts
def test_the_course_installs_and_works_without_any_network(made: Wheelhouse) -> None:
    text = (made.folder / wheelhouse_command.README).read_text(encoding="utf-8")
    [install] = [line.strip() for line in text.splitlines() if "pip install" in line]
    assert "://" not in text
    reached = offline("exec 3<>/dev/tcp/192.0.2.1/80", made.folder)
    assert "Network is unreachable" in reached.stderr
    done = offline(
        f"{install} --quiet\ncd ~\n"
        "~/ros2-course-env/bin/course doctor\n"
        "~/ros2-course-env/bin/autograder try qos right-chapter",
        made.folder,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "The course runs here" in done.stdout or "All is well" in done.stdout
    assert "visible: 10 of 10" in done.stdout


def test_the_folder_holds_each_wheel_once_at_the_version_that_was_tested(made: Wheelhouse) -> None:
    assert {path.name for path in made.folder.iterdir()} == {"wheels", "README.txt"}
    found = [parse_wheel_filename(path.name) for path in (made.folder / "wheels").iterdir()]
    pinned = {f"{name}=={version}" for name, version, *_ in found}
    constraints = (ROOT / ".ci" / "constraints.txt").read_text(encoding="utf-8").splitlines()
    assert pinned - {*constraints} == {f"ros2-course=={metadata.version('ros2-course')}"}
    assert len(pinned) == made.count, "pip has nothing to choose from"
    assert any(name == "ros-jazzy-rclpy" for name, *_ in found)
    assert 100e6 < made.size < 400e6


def test_bad_input_is_one_sentence_and_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "wheels").mkdir()
    (tmp_path / "wheels" / "photo.jpg").touch()
    with pytest.raises(WheelhouseError, match="holds other things than wheels"):
        make_wheelhouse(tmp_path)
    assert (tmp_path / "wheels" / "photo.jpg").is_file()
    (tmp_path / "file").touch()
    with pytest.raises(WheelhouseError, match="cannot be written"):
        make_wheelhouse(tmp_path / "file" / "below")
    with pytest.raises(WheelhouseError, match=r"is no wheel of ros2-course"):
        make_wheelhouse(tmp_path / "new", tmp_path / "other-1.0.whl")
    earlier = tmp_path / "stick" / "wheels"
    earlier.mkdir(parents=True)
    (earlier / "a-1.0.whl").touch()
    monkeypatch.setattr(
        wheelhouse_command, "_run_pip", lambda *_: (_ for _ in ()).throw(WheelhouseError("no"))
    )
    with pytest.raises(WheelhouseError, match="no"):
        make_wheelhouse(tmp_path / "stick")
    assert [path.name for path in (tmp_path / "stick").iterdir()] == ["wheels"]
    assert [path.name for path in earlier.iterdir()] == ["a-1.0.whl"]


def test_an_installed_course_says_that_it_needs_its_own_wheel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("course.workspace.content._CLONE", tmp_path)
    monkeypatch.setattr("course.workspace.content._DATA", tmp_path)
    (tmp_path / ".ci").mkdir()
    (tmp_path / ".ci" / "constraints.txt").touch()
    with pytest.raises(WheelhouseError, match="name its file with --wheel"):
        make_wheelhouse(tmp_path / "new")
    own = tmp_path / "ros2_course-0.1.0-py3-none-any.whl"
    own.touch()
    with pytest.raises(WheelhouseError, match="pip could not get all wheels"):
        make_wheelhouse(tmp_path / "new", own)  # an empty file is no wheel
