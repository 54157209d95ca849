"""A changed exam changes the digests of what sits it, and of nothing else."""

from __future__ import annotations

import ast
import importlib
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import autograder
from autograder import exercises
from autograder.running import digests
from tests.modules import modules_of

HOME = Path(autograder.__file__).parents[1]


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("code")
    for package in digests.PACKAGES:
        shutil.copytree(
            HOME / package, root / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    return root


@contextmanager
def longer(path: Path, more: bytes = b"") -> Iterator[None]:
    content = path.read_bytes()
    path.write_bytes(content + more + b"\n")
    yield
    path.write_bytes(content)


def of_all(root: Path) -> dict[str, str]:
    digests.forget_code()
    return {name: digests.of_exams((name,), root) for name in exercises.exercise_names()}


def test_a_change_of_one_exam_runs_nothing_else_again(copy: Path) -> None:
    before = of_all(copy)
    with longer(copy / "autograder/exercises/qos/exam.py"):
        assert {name for name, digest in of_all(copy).items() if before[name] != digest} == {"qos"}
    for part, more in {"readings.py": b"", "points.toml": b"[late]\nimu_burst = 1"}.items():
        with longer(copy / "autograder/exercises/qos" / part, more):
            changed = {name for name, digest in of_all(copy).items() if before[name] != digest}
            assert changed == {"qos"}, part
    with longer(copy / "autograder/sandbox/confinement/fastdds.xml"):
        assert not before.items() & of_all(copy).items()
    with longer(copy / "quizzes/banks/ch05.yaml"):
        assert of_all(copy) == before


def test_text_corpus_and_design_note_of_an_exercise_run_nothing_again(copy: Path) -> None:
    before = of_all(copy)
    corpus = copy / "autograder/exercises/qos/corpus"
    (corpus / "robot.xml").touch()  # of the kind that counts where the code is
    for file in ("task.py", "design.md", "corpus/mutants.toml", "corpus/right-batch.py",
                 "corpus/robot.xml", "../../corpus/every/broken-empty.py"):  # fmt: skip
        with longer(corpus.parent / file):
            assert of_all(copy) == before, file
    (corpus / "robot.xml").unlink()


@pytest.fixture(scope="module")
def covered() -> dict[str, set[str]]:
    """Return the modules that decide the verdicts of each exam."""
    return {name: digests.modules_of_exams([name]) for name in exercises.exercise_names()}


@pytest.mark.parametrize("name", exercises.exercise_names())
def test_an_exam_is_its_own_business(covered: dict[str, set[str]], name: str) -> None:
    module = f"autograder.exercises.{name}.exam"
    assert [exam for exam, modules in covered.items() if module in modules] == [name]


@pytest.mark.parametrize(
    ("module", "concerned"),
    [
        ("autograder.exercises.qos.readings", {"qos"}),
        ("autograder.exercises.qos.radio_gap", {"qos"}),
        ("autograder.exercises.safety.navigator_client", {"safety"}),
        ("autograder.examination.subject.server", set(exercises.exercise_names())),
        ("autograder.sandbox.resource_limits", set(exercises.exercise_names())),
        ("course.runtime.core_session", set(exercises.exercise_names())),
        ("autograder.cli", set()),
        ("autograder.gradebook.course_gradebook", set()),
    ],
)
def test_what_an_exam_imports_belongs_to_it(
    covered: dict[str, set[str]], module: str, concerned: set[str]
) -> None:
    assert module in digests._Code(None)._files
    assert {exam for exam, modules in covered.items() if module in modules} == concerned


def test_what_some_exams_need_of_the_course_belongs_to_these(covered: dict[str, set[str]]) -> None:
    for exam, needs_design in {"architecture": True, "patterns": True, "qos": False}.items():
        assert ("course.design.node" in covered[exam]) == needs_design, exam


@pytest.mark.parametrize(
    "shown_or_kept",
    [
        "course.views", "course.watch", "course.diagnosis", "course.doctor",
        "course.workspace",
        "course.learner_session.session", "course.cell_news", "course.notebook", "quizzes",
        "autograder.examination.verdict_text", "autograder.examination.pictures.drawing",
        "autograder.examination.pictures.wording", "autograder.running.live_report",
        "autograder.gradebook.feedback.feedback_page",
        "autograder.gradebook.safe_html.page_texts", "autograder.gradebook.feedback.sheets",
    ],
)  # fmt: skip
def test_what_is_shown_or_kept_changes_no_verdict(
    covered: dict[str, set[str]], shown_or_kept: str
) -> None:
    known = {m for m in digests._Code(None)._files if f"{m}.".startswith(f"{shown_or_kept}.")}
    assert known
    assert not known & set().union(*covered.values())


def test_what_makes_points_of_verdicts_enters_again_but_runs_nothing(copy: Path) -> None:
    before = digests.of_grading(("qos",), copy)
    for file in (
        "quizzes/banks/ch05.yaml",
        "autograder/gradebook/nbgrader_plugins/autograde_steps.py",
    ):
        with longer(copy / file):
            digests.forget_code()
            assert digests.of_grading(("qos",), copy) != before


def test_the_installed_code_has_the_digest_of_its_copy(copy: Path) -> None:
    digests.forget_code()
    assert digests.of_exams(("qos",)) == digests.of_exams(("qos",), copy)


@pytest.mark.parametrize("package", digests.PACKAGES)
def test_no_import_is_overlooked(package: str) -> None:
    for file in modules_of(HOME / package):
        source = file.read_bytes()
        found = digests._imported_modules("a.module", source)
        for node in of_a_run(ast.parse(source)):
            if isinstance(node, ast.Import):
                assert {alias.name for alias in node.names} <= found, file
            elif isinstance(node, ast.ImportFrom) and node.module:
                names = {f"{node.module}.{alias.name}" for alias in node.names}
                assert {node.module, *names} <= found, file


def of_a_run(tree: ast.Module) -> Iterator[ast.AST]:
    """Walk through a module, without what is there for types, or imported when a name is asked."""
    for statement in tree.body:
        for_types = isinstance(statement, ast.If) and ast.unparse(statement.test) == "TYPE_CHECKING"
        if for_types or (
            isinstance(statement, ast.FunctionDef) and statement.name == "__getattr__"
        ):
            continue
        yield from ast.walk(statement)


@pytest.mark.parametrize("package", ["autograder", "course"])
def test_what_a_package_imports_on_demand_is_followed_to_its_module(package: str) -> None:
    source = (HOME / package / "__init__.py").read_bytes()
    for name, (module, _) in digests._on_demand(package, source).items():
        own = getattr(importlib.import_module(package), name.rpartition(".")[2])
        assert own is getattr(importlib.import_module(module), name.rpartition(".")[2])
    assert digests._on_demand(package, source)
