"""The authors' guide is right: its files make an exercise, and its commands are there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
import typer

from autograder import cli
from autograder.commands import new_command, try_command
from autograder.corpus import command
from autograder.corpus.case import CorpusError
from autograder.corpus.mutate import mutate
from autograder.util import exercise_folders
from course.workspace.content import content_root
from tests.machine import needs_sandbox

GUIDES = sorted((content_root() / "guides").glob("*.md"))
GUIDE = (content_root() / "guides" / "authors.md").read_text(encoding="utf-8")
IMPORTS = """
from rcl_interfaces.msg import SetParametersResult
from std_msgs.msg import Float32, String
from std_srvs.srv import Trigger
"""
STUB_SAYS = """# title: The stub as it was handed out
# fails: node_starts
# in: the stub
"""


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """Make the guide's exercise in a new course; return its folder."""
    root = new_command.make_course(tmp_path / "robots")
    made = new_command.make_exercise(root, "battery", "lab1")
    solution, exam = blocks("python")
    points, mutants = blocks("toml")
    task = (made / "task.py").read_text()
    task, count = re.subn(
        r"class Lamp\(Node\):.*### END SOLUTION\n", lambda _: solution, task, flags=re.DOTALL
    )
    assert count == 1
    task = task.replace("from std_msgs.msg import Bool\n", IMPORTS)
    (made / "task.py").write_text(task)
    (made / "exam.py").write_text(exam)
    (made / "points.toml").write_text(points)
    (made / "corpus" / "mutants.toml").write_text(mutants)
    (made / "corpus" / "right-two-timers.py").unlink()
    (made / "corpus" / "wrong-stub.py").write_text(STUB_SAYS)
    exercise_folders.use_course(root)
    yield made
    exercise_folders.use_course(None)


def test_it_is_short() -> None:
    assert len(GUIDE.splitlines()) <= 250


@needs_sandbox
def test_its_exercise_gets_the_verdicts_of_its_corpus(folder: Path) -> None:
    trials = command.run_corpus("battery")
    assert {trial.case.name for trial in trials} >= {"right-exemplar", "wrong-warns-always"}
    assert {trial.case.name: trial.difference for trial in trials if trial.difference} == {}
    tried = "\n".join(try_command.try_exam("battery").as_lines())
    assert "sent on /battery: " in tried
    assert "1 s pass: /warning: 'battery low'" in tried


@needs_sandbox
@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ('["battery low"] * 2', '["battery low"] * 3', "warns_again"),
        ("node.require(LIMIT, 0.2)", "node.draws.nummer()", "no attribute 'nummer'"),
    ],
)
def test_mistakes_are_not_made_in_an_exemplar_that_does_not_pass(
    folder: Path, right: str, wrong: str, said: str
) -> None:
    exam = (folder / "exam.py").read_text()
    assert right in exam
    (folder / "exam.py").write_text(exam.replace(right, wrong))
    with pytest.raises(CorpusError, match="The exemplar of battery does not pass its exam") as told:
        mutate("battery")
    assert said in str(told.value)
    assert said in try_command.try_exam("battery").difference


@pytest.mark.parametrize("page", GUIDES, ids=lambda page: page.stem)
def test_the_commands_of_the_guides_are_there(page: Path) -> None:
    for line in re.findall(r"\bautograder ([a-z][a-z ]*)", page.read_text(encoding="utf-8")):
        here: click.Command = typer.main.get_command(cli.app)
        for word in line.split():
            if not isinstance(here, click.Group):
                break
            assert word in here.commands, f"autograder {line}"
            here = here.commands[word]
        assert not isinstance(here, click.Group), f"autograder {line}: which one of its commands?"
