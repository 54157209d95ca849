"""`autograder new hub`: what it writes, and what a hub says of bad input before it starts."""

from __future__ import annotations

import ast
import pwd
import re
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from autograder import cli
from autograder.commands import new_command
from autograder.commands.new_command import NewError
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.hub import hub_settings, new_hub
from autograder.hub.hub_settings import HubError, HubSettings

SOMEBODY = pwd.getpwuid(0).pw_name
"""A user that there is."""


@pytest.fixture
def tmp_path() -> Iterator[Path]:
    """A folder that everybody may enter, as pytest's own are closed."""
    with tempfile.TemporaryDirectory(prefix="hub-") as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return new_hub.make_hub(tmp_path / "hub", tmp_path / "exchange")


@pytest.fixture
def settings(folder: Path, tmp_path: Path) -> HubSettings:
    """Settings of a machine that has all but what a test takes away."""
    root = new_command.make_course(tmp_path / "course", course_id="robots-a")
    exchange = tmp_path / "exchange"
    for name, mode in {"": 0o777, "robots-a": 0o755, "robots-a/inbound": 0o2733}.items():
        (exchange / name).mkdir()
        (exchange / name).chmod(mode)
    found = hub_settings.read_settings(folder)
    course = found.courses["robots-a"].model_copy(update={"grader": SOMEBODY, "root": root})
    return found.model_copy(update={"courses": {"robots-a": course}})


def test_the_folder_is_written_and_python(tmp_path: Path) -> None:
    done = CliRunner().invoke(cli.app, ["new", "hub", str(tmp_path / "mine")])
    assert done.exit_code == 0
    files = {
        p.relative_to(tmp_path / "mine") for p in (tmp_path / "mine").rglob("*") if p.is_file()
    }
    assert {str(path) for path in files} == {
        "README.md", "hub.toml", "hub_settings.py", "jupyterhub_config.py",
        "jupyter/everybody/labconfig/page_config.json", "jupyter/users/nbgrader_config.py",
    }  # fmt: skip
    for path in files:
        text = (tmp_path / "mine" / path).read_text(encoding="utf-8")
        assert not re.search(r"@[A-Z]+@", text), path
        if path.suffix == ".py":
            ast.parse(text)
    assert stat.S_IMODE((tmp_path / "mine" / "hub.toml").stat().st_mode) == 0o600


def test_the_settings_that_are_written_are_sound(folder: Path, tmp_path: Path) -> None:
    settings = hub_settings.read_settings(folder)
    assert settings.exchange == tmp_path / "exchange"
    assert list(settings.courses) == ["robots-a", "robots-b"]


def test_a_folder_with_something_in_it_is_left_alone(folder: Path) -> None:
    with pytest.raises(new_hub.NewHubError, match="is not empty"):
        new_hub.make_hub(folder)


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("port = 8000", 'port = "far"', "port: Input should be a valid integer"),
        ("idle_minutes = 60", "idle_minute = 60", "idle_minute: Extra inputs"),
        ('memory = "2G"', 'memory = "much"', "memory: String should match"),
        ("[courses.robots-a]", "[courses.'Robots A']", "courses.Robots A"),
        ("port = 8000", "port = ", "cannot be read"),
    ],
)
def test_a_mistake_in_the_settings_is_one_sentence(
    folder: Path, before: str, after: str, says: str
) -> None:
    file = folder / "hub.toml"
    file.write_text(file.read_text("utf-8").replace(before, after), encoding="utf-8")
    with pytest.raises(HubError, match=re.escape(says)) as raised:
        hub_settings.read_settings(folder)
    assert str(raised.value).startswith(str(file))
    assert "\n" not in str(raised.value)


def test_a_machine_that_has_all_is_welcome(settings: HubSettings) -> None:
    hub_settings.require_machine(settings)


@pytest.mark.parametrize(
    ("place", "mode", "says"),
    [
        ("", 0o755, "may write {} (it is drwxr-xr-x; the right w is missing for others)"),
        ("", 0o770, "may read and write and enter {}"),
        ("robots-a", 0o750, "may enter {}"),
        (
            "robots-a/inbound",
            0o2730,
            "the right wx is missing for others): run `sudo chmod o+wx {}`",
        ),
    ],
)
def test_a_missing_right_is_named_with_its_folder(
    settings: HubSettings, place: str, mode: int, says: str
) -> None:
    folder = settings.exchange / place
    folder.chmod(mode)
    with pytest.raises(HubError, match=re.escape(says.format(folder))):
        hub_settings.require_machine(settings)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            {"exchange": Path("/nowhere/exchange")},
            "There is no exchange at /nowhere/exchange: make",
        ),
        ({"python": Path("/nowhere/python")}, "There is no Python at /nowhere/python"),
    ],
)
def test_what_is_not_there_is_said_with_the_command_that_makes_it(
    settings: HubSettings, change: dict[str, Path], says: str
) -> None:
    with pytest.raises(HubError, match=re.escape(says)):
        hub_settings.require_machine(settings.model_copy(update=change))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"grader": "nobody-at-all"}, "There is no user nobody-at-all, who grades robots-a"),
        ({"root": Path("/nowhere")}, "There is no course robots-a at /nowhere"),
    ],
)
def test_a_course_without_its_grader_or_its_root_is_named(
    settings: HubSettings, change: dict[str, object], says: str
) -> None:
    course = settings.courses["robots-a"].model_copy(update=change)
    with pytest.raises(HubError, match=re.escape(says)):
        hub_settings.require_machine(settings.model_copy(update={"courses": {"robots-a": course}}))


def test_a_course_of_a_hub_knows_its_id_and_its_exchange(tmp_path: Path) -> None:
    root = new_command.make_course(
        tmp_path / "course", course_id="robots-b", exchange=tmp_path / "exchange"
    )
    gradebook = CourseGradebook(root)
    assert gradebook.coursedir.course_id == "robots-b"
    assert gradebook.config.Exchange.root == str(tmp_path / "exchange")
    with pytest.raises(NewError, match="cannot have the id 'Robots B'"):
        new_command.make_course(tmp_path / "other", course_id="Robots B")
