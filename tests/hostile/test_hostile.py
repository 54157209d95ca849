"""Attacks on the grader: contained, explained in the grade, and of no effect on anybody else.

Each ``attacks/<name>.py`` is the last cell before the first check, under a header of comments:

    # title: what it tries
    # told: a fragment of what the grade says about it (any number of them), or " | " between two
      of which either may be said
    # prints: a fragment of what the cell itself must print, an error included
    # exercise: the exercise; qos if left out
    # base: the corpus case that the rest of the submission is; an empty solution if left out
    # score: the automatic points that it deserves; 0 if left out, "any" if they do not matter,
    #     "at most 10" where what cannot be examined any more depends on the moment
    # seconds: what a cell of it may take, if not as long as always
    # reaches: "the exam" if it tries nothing but to mislead it; the machine if left out

While an attack on the machine runs, so does a neighbour's right submission, which must get what it
gets in quiet.
"""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell

from autograder import corpus
from autograder.assignments import submission
from autograder.assignments.build_notebooks import build
from autograder.corpus import Case
from autograder.corpus.trials import notebooks_of
from autograder.examination import points
from autograder.examination.program import Program
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.release import make_release
from autograder.grading import engine
from autograder.running import runner
from autograder.running.runner import CELL_TIMEOUT_S, Outcome
from autograder.sandbox.confinement import network
from tests.machine import needs_isolation

HERE = Path(__file__).parent
EMPTY = "broken-empty"
FULL = 15.0
SEED = 36
"""Not the usual one: what is known by heart from other runs must not be right by chance."""

pytestmark = needs_isolation


@dataclass(frozen=True)
class Attack:
    name: str
    title: str
    text: str
    told: list[str] = field(default_factory=list)
    prints: list[str] = field(default_factory=list)
    exercise: str = "qos"
    base: str = EMPTY
    score: str = "0"
    seconds: float = CELL_TIMEOUT_S
    reaches_machine: bool = True


def attacks() -> list[Attack]:
    return [attack_of(file) for file in sorted((HERE / "attacks").glob("*.py"))]


def attack_of(file: Path) -> Attack:
    text = file.read_text()
    fields: dict[str, list[str]] = {}
    for key, value in re.findall(r"^# (\w+): (.*)$", text, re.MULTILINE):
        fields.setdefault(key, []).append(value)

    def first(key: str, default: str) -> str:
        return fields.get(key, [default])[0]

    return Attack(
        file.stem, fields["title"][0], text, fields.get("told", []), fields.get("prints", []),
        first("exercise", "qos"), first("base", EMPTY), first("score", "0"),
        float(first("seconds", str(CELL_TIMEOUT_S))), first("reaches", "the machine") != "the exam",
    )  # fmt: skip


@dataclass(frozen=True)
class Class:
    root: Path
    notebooks: dict[str, tuple[NotebookNode, NotebookNode]]
    cases: dict[tuple[str, str], Case]

    def program(self, base: str, attack: str = "", exercise: str = "qos") -> Program:
        source, released = self.notebooks[exercise]
        notebook = self.cases[exercise, base].make_submission(source, released)
        if attack:
            place = next(
                number for number, cell in enumerate(notebook.cells)
                if submission.grade_id(cell) == f"{exercise}-visible"
            )  # fmt: skip
            notebook.cells.insert(place, new_code_cell(attack))
        return submission.extract_program(submission.restore_cells(notebook, source, released)[0])


@pytest.fixture(scope="module")
def class_(tmp_path_factory: pytest.TempPathFactory) -> Class:
    return class_in(tmp_path_factory.mktemp("course"))


def class_in(folder: Path) -> Class:
    exercises = sorted({attack.exercise for attack in attacks()} | {"qos"})
    root = notebooks_of(folder, exercises, "ch05")
    build(root)
    make_release(root, "ch05")
    notebooks, cases = {}, {}
    for name in exercises:
        file = f"ch05/{points.table()[name].notebook}.ipynb"
        source, released = (
            submission.read_notebook(root / step / file) for step in ("source", "release")
        )
        notebooks[name] = source, released
        cases.update({(name, c.name): c for c in corpus.load_cases(name)})
    return Class(root, notebooks, cases)


@pytest.fixture
def scratch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "scratch"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def host() -> Iterator[tuple[int, list[socket.socket]]]:
    """Listen on the host where a submission might call; give the port, and who listens."""
    with socket.create_server(("127.0.0.1", 0)) as internet, socket.socket(socket.AF_UNIX) as local:
        port = internet.getsockname()[1]
        local.bind(f"\0ros2-course-hostile-{port}")
        local.listen()
        yield port, [internet, local]


@pytest.fixture
def namespaces(monkeypatch: pytest.MonkeyPatch) -> Iterator[set[int]]:
    """Collect the process namespaces of the sandboxes that are made from now on.

    Each is held open: the kernel gives the number of one that is gone to the next that is made,
    which may be the sandbox of a test in another worker.
    """
    made: set[int] = set()
    find = network.child
    with ExitStack() as held:

        def spy(info: int, process: subprocess.Popen[bytes]) -> int:
            init = find(info, process)
            namespace = held.enter_context(Path(f"/proc/{init}/ns/pid").open("rb"))
            made.add(os.fstat(namespace.fileno()).st_ino)
            return init

        monkeypatch.setattr(network, "child", spy)
        yield made


def running(namespaces: set[int]) -> list[str]:
    """Return the processes that are in one of the process namespaces."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if (process / "ns/pid").stat().st_ino in namespaces:
                found.append(process.name)
    return found


def heard(listeners: list[socket.socket]) -> list[bytes]:
    """Return what whoever called has said: other programs of the host may mistake the port."""
    said = []
    for listener in listeners:
        listener.setblocking(False)
        with suppress(BlockingIOError):
            while True:
                caller, _ = listener.accept()
                with caller, suppress(OSError):
                    caller.settimeout(1.0)
                    said.append(caller.recv(100))
    return said


def score(outcome: Outcome) -> float:
    return sum(verdict.score for verdict in outcome.verdicts.values())


def gist(outcome: Outcome) -> str:
    """Return what the grade says first: why it ended, or the first check that did not pass."""
    checks = [check for verdict in outcome.verdicts.values() for check in verdict.checks]
    complaints = [*outcome.notes, *(check.actual for check in checks if check.status != "passed")]
    return complaints[0].splitlines()[0] if complaints else "every check passed"


def grade_text(outcome: Outcome) -> str:
    checks = [check for verdict in outcome.verdicts.values() for check in verdict.checks]
    return "\n".join([*outcome.notes, *(f"{check.expected} {check.actual}" for check in checks)])


def timed(class_: Class) -> tuple[Outcome, float]:
    """Grade a right submission; return what became of it, and how long that took, in s."""
    began = time.monotonic()
    outcome = runner.run(class_.program("right-chapter"), hidden=[class_.root])
    return outcome, time.monotonic() - began


@pytest.fixture(scope="module")
def usual(class_: Class) -> float:
    """Return how many s a right submission takes beside another right one."""
    with ThreadPoolExecutor(2) as pool:
        (_, seconds), _ = pool.map(timed, [class_, class_])
    return seconds


@pytest.mark.parametrize("attack", attacks(), ids=lambda attack: attack.name)
def test_an_attack_is_contained_and_explained_and_hurts_nobody(
    attack: Attack,
    class_: Class,
    usual: float,
    scratch: Path,
    host: tuple[int, list[socket.socket]],
    namespaces: set[int],
    record_property: Callable[[str, object], None],
) -> None:
    port, listeners = host
    text = attack.text.replace("PORT", str(port)).replace("ROOT", repr(str(class_.root)))
    with ThreadPoolExecutor(2) as pool:
        neighbour = pool.submit(timed, class_) if attack.reaches_machine else None
        hostile = pool.submit(
            runner.run, class_.program(attack.base, text, attack.exercise), hidden=[class_.root],
            cell_timeout=attack.seconds, seed=SEED,
        )  # fmt: skip
        outcome = hostile.result()
    for name, value in {
        "attack": f"{attack.name}: {attack.title}",
        "what the grade says": gist(outcome),
        "points got / deserved": f"{score(outcome):g} / {attack.score}",
    }.items():
        record_property(name, value)
    if neighbour is not None:
        beside, seconds = neighbour.result()
        record_property("neighbour's points", f"{score(beside):g} of {FULL:g}")
        record_property("neighbour's time", f"{seconds:.1f} s (beside a right one: {usual:.1f} s)")
        assert score(beside) == FULL, grade_text(beside)

    said, shown = grade_text(outcome), json.dumps(outcome.outputs, ensure_ascii=False)
    if attack.score.startswith("at most "):
        assert score(outcome) <= float(attack.score.removeprefix("at most ")), said
    elif attack.score != "any":
        assert score(outcome) == float(attack.score), said
    for either in attack.told:
        assert any(fragment in said for fragment in either.split(" | ")), said
    for fragment in attack.prints:
        assert fragment in shown
    assert "Traceback" not in said
    assert not outcome.has_grader_error, said
    assert len(shown) < 2_000_000
    each = (
        2 if neighbour is None else 4
    )  # a submission and its examiner, and plain programs of theirs
    assert len(namespaces) >= each
    # What was killed takes the kernel a moment to clear away; what was not stays.
    deadline, never = time.monotonic() + 10, threading.Event()
    while running(namespaces) and time.monotonic() < deadline:
        never.wait(0.05)
    assert not running(namespaces), "something is still running"
    assert list(scratch.iterdir()) == [], "something was left on disk"
    assert b"hostile" not in heard(listeners), "an attack reached the host"


def test_odd_files_in_a_submission_folder(class_: Class) -> None:
    right = class_.cases["qos", "right-chapter"].make_submission(*class_.notebooks["qos"])

    def folder(student: str) -> Path:
        path = class_.root / "submitted" / student / "ch05"
        path.mkdir(parents=True)
        return path

    nbformat.write(right, folder("honest") / "qos-design.ipynb")
    (folder("link") / "qos-design.ipynb").symlink_to("../../honest/ch05/qos-design.ipynb")
    (folder("large") / "qos-design.ipynb").write_bytes(b'{"cells": ["' + b"x" * 200 * 2**20)
    (folder("nested") / "qos-design.ipynb").write_text("[" * 200_000 + "]" * 200_000)
    climbing = folder("climbing")
    nbformat.write(right, climbing / "qos-design.ipynb")
    (climbing / "gradebook.db").symlink_to(class_.root / "gradebook.db")
    (climbing / "up").symlink_to("../../..")

    graded = {g.student: g for g in engine.grade(class_.root, "ch05")}
    grades = {g.student: g for g in CourseGradebook(class_.root).read_grades("ch05")}

    assert {name: grade.score for name, grade in grades.items()} == {
        "honest": FULL, "climbing": FULL, "link": 0, "large": 0, "nested": 0,
    }  # fmt: skip
    assert "is not a file" in graded["link"].problem
    assert "200 MB" in graded["large"].problem
    assert "not valid JSON" in graded["nested"].problem
