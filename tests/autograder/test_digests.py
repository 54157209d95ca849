"""A changed exam changes the digests of what sits it, and of nothing else."""

from __future__ import annotations

import ast
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import autograder
from autograder import digests, exams

HOME = Path(autograder.__file__).parents[1]


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("code")
    for package in digests.PACKAGES:
        shutil.copytree(
            HOME / package, root / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    return root


def changed(copy: Path, file: str) -> set[str]:
    """Return the exams whose digest changes with a file."""
    before = dict(of_all(copy))
    with longer(copy / file):
        return {name for name, digest in of_all(copy) if before[name] != digest}


@contextmanager
def longer(path: Path) -> Iterator[None]:
    content = path.read_bytes()
    path.write_bytes(content + b"\n")
    yield
    path.write_bytes(content)


def of_all(root: Path) -> Iterator[tuple[str, str]]:
    digests.of_exams.cache_clear()
    for name in exams.names():
        yield name, digests.of_exams((name,), root)


@pytest.mark.parametrize("name", exams.names())
def test_an_exam_is_its_own_business(copy: Path, name: str) -> None:
    assert changed(copy, f"autograder/exams/{name}.py") == {name}


@pytest.mark.parametrize(
    ("file", "concerned"),
    [
        ("autograder/rigs/sensors.py", {"qos"}),
        ("autograder/rigs/gap.py", {"qos"}),
        ("autograder/rigs/trials/goals.py", {"safety"}),
        ("autograder/harness.py", set(exams.names())),
        ("autograder/sandbox/limits.py", set(exams.names())),
        ("autograder/sandbox/fastdds.xml", set(exams.names())),
        ("course/runtime/session.py", set(exams.names())),
        ("autograder/cli.py", set()),
        ("autograder/gradebook.py", set()),
        ("quizzes/banks/ch05.yaml", set()),
    ],
)
def test_what_an_exam_imports_belongs_to_it(copy: Path, file: str, concerned: set[str]) -> None:
    assert changed(copy, file) == concerned


def test_what_makes_points_of_verdicts_enters_again_but_runs_nothing(copy: Path) -> None:
    before = digests.of_grading(("qos",), copy)
    for file in ("quizzes/banks/ch05.yaml", "autograder/nbgrader_bridge.py"):
        assert changed(copy, file) == set()
        with longer(copy / file):
            digests.of_grading.cache_clear()
            assert digests.of_grading(("qos",), copy) != before


def test_the_installed_code_has_the_digest_of_its_copy(copy: Path) -> None:
    digests.of_exams.cache_clear()
    assert digests.of_exams(("qos",)) == digests.of_exams(("qos",), copy)


@pytest.mark.parametrize("package", digests.PACKAGES)
def test_no_import_is_overlooked(package: str) -> None:
    for file in (HOME / package).rglob("*.py"):
        source = file.read_bytes()
        found = digests._imports("a.module", source)
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Import):
                assert {alias.name for alias in node.names} <= found, file
            elif isinstance(node, ast.ImportFrom) and node.module:
                names = {f"{node.module}.{alias.name}" for alias in node.names}
                assert {node.module, *names} <= found, file
