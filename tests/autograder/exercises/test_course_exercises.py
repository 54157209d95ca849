"""An exercise of a course root's own is found like one of the package, from its text to a grade."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import nbformat
import pytest

import course
from autograder import exercises
from autograder.assignments import listing, submission
from autograder.assignments.build_notebooks import build
from autograder.corpus import command
from autograder.corpus.command import needs_trust
from autograder.examination import points
from autograder.examination.exam import ExamError
from autograder.examination.program import Cell
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.release import ReleaseError, make_release
from autograder.grading import engine
from autograder.grading.engine import Graded
from autograder.grading.run_progress import Collecting
from autograder.running import digests, runner
from autograder.running.grading_jobs import GradingJob
from autograder.running.workers.cluster import Cluster, ClusterError
from autograder.util import exercise_folders
from autograder.util.exercise_folders import ExerciseError
from course.errors import CourseError
from course.workspace import working_copy
from course.workspace.content import CONFIG, content_root, copy_authoring
from tests.machine import needs_sandbox

CELL = '{"grade": %s, "grade_id": "%s", "locked": %s, "schema_version": 3, "solution": %s%s}'
TEST = CELL % ("true", "lamp-%s", "true", "false", ', "points": 0')
TASK = f"""\
# %% nbgrader={CELL % ("false", "lamp-given", "true", "false", "")}
from rclpy.node import Node
from std_msgs.msg import Bool

# %% nbgrader={CELL % ("false", "lamp-solution", "false", "true", "")}
class Lamp(Node):
    def __init__(self) -> None:
        super().__init__("lamp")
        ### BEGIN SOLUTION
        self.lit = self.create_publisher(Bool, "lamp", 10)
        self.create_timer(0.05, lambda: self.lit.publish(Bool(data=True)))
        ### END SOLUTION

# %% nbgrader={TEST % "visible"}
from autograder import check

check("lamp")

# %% nbgrader={TEST % "hidden"}
### BEGIN HIDDEN TESTS
check("lamp", part="hidden")
### END HIDDEN TESTS
"""
EXAM = '''\
from contextlib import contextmanager

from autograder.examination.exam import Exam, Failed
from course.errors import WaitTimeout
from course_exercises.lamp.listener import Listener

from .words import EXPECTED


@contextmanager
def lamp(bench):
    bench.subject.open()
    listener = bench.session.run(Listener)
    bench.subject.start("Lamp")
    yield bench, listener


EXAM = Exam("lamp", lamp)


@EXAM.check(hints=("Publish.",))
def shines(rig):
    """The lamp shines."""
    bench, listener = rig
    try:
        bench.session.until(lambda: listener.heard, timeout=8.0, what="a message on /lamp")
    except WaitTimeout:
        raise Failed(expected=EXPECTED, actual="Nothing came on /lamp.") from None


@EXAM.check(needs=("shines",))
def is_lit(rig):
    """It says that it is lit."""
    if not rig[1].heard[0]:
        raise Failed(expected=EXPECTED, actual="It said False.")
'''
LISTENER = """\
from rclpy.node import Node
from std_msgs.msg import Bool


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
        self.heard = []
        self.create_subscription(Bool, "lamp", lambda message: self.heard.append(message.data), 10)
"""
MUTANTS = """\
[right-exemplar]
title = "The exemplar"
fails = []
splices = []

[wrong-dark]
title = "A lamp that is not lit"
fails = ["is_lit"]
says = { is_lit = "It said False." }
splices = [{ old = "data=True", new = "data=False" }]
"""
PICTURE = '<svg xmlns="http://www.w3.org/2000/svg"><title>A lamp</title></svg>'
FILES = {
    "task.py": TASK, "exam.py": EXAM, "listener.py": LISTENER,
    "words.py": 'EXPECTED = "A True comes on /lamp."\n',
    "points.toml": 'title = "The lamp"\n[visible]\nshines = 1\n[hidden]\nis_lit = 2\n',
    "corpus/wrong-stub.py": "# title: The stub\n# fails: the first\n# in: the stub\n\n",
    "corpus/mutants.toml": MUTANTS, "design.md": "Publishing.\n",
}  # fmt: skip
SHIPPED = {f"exercises/lamp/{name}" for name in ("exam.py", "listener.py", "words.py",
                                                 "points.toml")}  # fmt: skip


def write_exercise(root: Path, name: str = "lamp", **instead: str) -> Path:
    folder = root / "exercises" / name
    for file, text in {**FILES, **instead}.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text)
    return folder


@pytest.fixture(autouse=True)
def only_the_packages_afterwards() -> Iterator[None]:
    yield
    exercise_folders.use_course(None)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    assignments = root / "authoring" / "assignments"
    assignments.mkdir(parents=True)
    (assignments / "lab1.toml").write_text('exercises = ["lamp", "qos"]\n')
    shutil.copy(content_root() / CONFIG, root)
    write_exercise(root)
    return root


@pytest.fixture(scope="module")
def released_lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("lab") / "course"
    assignments = root / "authoring" / "assignments"
    assignments.mkdir(parents=True)
    (assignments / "lab2.toml").write_text('exercises = ["lamp"]\n')
    shutil.copy(content_root() / CONFIG, root)
    write_exercise(root)
    build(root)
    make_release(root, "lab2")
    return root


@pytest.fixture
def lab2(released_lab: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(released_lab, tmp_path / "course"))


def files_in(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def hand_in(root: Path, student: str, old: str = "", new: str = "") -> None:
    source, released = (
        submission.read_notebook(root / step / "lab2" / "lamp.ipynb")
        for step in ("source", "release")
    )
    for cell, solved in zip(released.cells, source.cells, strict=True):
        if submission.grade_id(cell) == "lamp-solution":
            cell.source = solved.source.replace(old, new)
    folder = root / "submitted" / student / "lab2"
    shutil.copytree(root / "release" / "lab2", folder)
    nbformat.write(released, folder / "lamp.ipynb")  # type: ignore[no-untyped-call]


def test_it_is_built_beside_those_of_the_package_and_only_its_exam_is_handed_out(
    root: Path,
) -> None:
    built = [str(path.relative_to(root)) for path in build(root)]
    assert built[:2] == ["source/lab1/lamp.ipynb", "source/lab1/qos-design.ipynb"]
    assert build(root, check=True)
    assert "lamp" not in exercises.exercise_names(), "it is one of that course only"
    released = make_release(root, "lab1")
    assert files_in(released) == {
        "lamp.ipynb", "qos-design.ipynb", "qos-design.svg", *SHIPPED,
    }  # fmt: skip
    text = "\n".join(path.read_text() for path in released.rglob("*") if path.is_file())
    assert "create_timer" not in text
    assert set(map(str, working_copy._course_files(root, assignments=True))) >= {
        f"lab1/{name}" for name in SHIPPED
    }


def test_another_chapter_changes_nothing_of_the_others(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy_authoring(content_root(), root)
    (root / "authoring" / "assignments" / "lab1.toml").unlink()
    (root / "authoring" / "assignments" / "ch07.toml").write_text('exercises = ["lamp"]\n')
    (root / "authoring" / "chapters" / "ch07-light.py").write_text("# %% [markdown]\n# # Light\n")
    built = {path.relative_to(root) for path in build(root)}
    first = {path.relative_to(content_root()) for path in build(content_root(), check=True)}
    added = {"chapters/ch07-light.ipynb", "source/ch07/lamp.ipynb",
             *(f"source/ch07/{name}" for name in SHIPPED)}  # fmt: skip
    assert set(map(str, built - first)) == added
    for path in first:
        assert (root / path).read_bytes() == (content_root() / path).read_bytes(), path
    make_release(root, "ch05-quiz")
    make_release(root, "ch07")
    working_copy.make_copy(tmp_path / "mine", root)
    monkeypatch.chdir(tmp_path / "mine")
    progress = course.progress()
    assert progress.notices == ()
    chapters = sorted((content_root() / "chapters").glob("ch*.ipynb"))
    assert len(progress.chapters) == len(chapters) + 1
    exams = [exercise.notebook.exam for exercise in progress.exercises]
    listed = [exam for a in listing.of_course(content_root()).values() for exam in a.exercises]
    assert (sorted(exams), exams[-1]) == (sorted([*listed, "lamp"]), "lamp")


def test_what_is_handed_out_is_in_step_with_the_exercise(root: Path) -> None:
    build(root)
    (root / "exercises" / "lamp" / "words.py").write_text('EXPECTED = "It shines."\n')
    with pytest.raises(CourseError, match=r"Not in step.*source/lab1/exercises/lamp/words\.py"):
        build(root, check=True)
    with pytest.raises(ReleaseError, match=r"words\.py is not in step with the exercise"):
        make_release(root, "lab1")


def test_its_picture_goes_with_its_notebook(root: Path) -> None:
    picture = root / "exercises" / "lamp" / "picture.svg"
    picture.write_text(PICTURE)
    assert root / "source" / "lab1" / "lamp.svg" in build(root)
    assert (make_release(root, "lab1") / "lamp.svg").read_text() == PICTURE
    assert (
        working_copy._course_files(root, assignments=True)[Path("lab1/lamp.svg")]
        == PICTURE.encode()
    )

    picture.write_text(PICTURE.replace("lamp", "bulb that is on"))
    with pytest.raises(CourseError, match=r"Not in step.*source/lab1/lamp\.svg"):
        build(root, check=True)
    with pytest.raises(ReleaseError, match=r"lamp\.svg is not in step with the exercise"):
        make_release(root, "lab1")
    build(root)

    picture.unlink()
    with pytest.raises(CourseError, match=r"Without a source.*lab1/lamp\.svg.*release/lab1/lamp"):
        build(root, check=True)
    with pytest.raises(ReleaseError, match=r"lamp\.svg would be handed out to students"):
        make_release(root, "lab1")


def test_a_picture_that_cannot_be_read_is_one_sentence(root: Path) -> None:
    (root / "exercises" / "lamp" / "picture.svg").mkdir()
    with pytest.raises(ExerciseError, match=r"picture\.svg cannot be read \(Is a directory\)"):
        build(root)


@needs_sandbox
def test_a_right_and_a_wrong_submission_are_graded_in_the_sandbox(lab2: Path) -> None:
    hand_in(lab2, "right")
    hand_in(lab2, "dark", "data=True", "data=False")
    hand_in(lab2, "own", "self.create_timer(", "print(")
    forged = lab2 / "submitted" / "own" / "lab2" / "exercises" / "lamp"
    (forged / "exam.py").write_text("raise RuntimeError('a submission brings no exam')\n")
    graded: dict[str, Graded] = {}
    engine.grade(lab2, "lab2", feedback=False, progress=Collecting(graded, then=engine.QUIET))
    verdicts = {
        student: {
            check.name: check.status
            for verdict in done.outcomes["lamp"].verdicts.values()
            for check in verdict.checks
        }
        for student, done in graded.items()
    }
    assert verdicts["right"] == {"shines": "passed", "is_lit": "passed"}
    assert verdicts["dark"] == {"shines": "passed", "is_lit": "failed"}
    assert verdicts["own"] == {"shines": "failed", "is_lit": "not_checked"}
    scores = {grade.student: grade.score for grade in CourseGradebook(lab2).read_grades("lab2")}
    assert scores == {"right": 3.0, "dark": 1.0, "own": 0.0}


@needs_sandbox
def test_nbgrader_itself_grades_it_as_well(lab2: Path) -> None:
    hand_in(lab2, "right")
    subprocess.run(
        [sys.executable, "-m", "nbgrader", "autograde", "lab2", "--create"], cwd=lab2, check=True,
        capture_output=True, timeout=120,
    )  # fmt: skip
    (grade,) = CourseGradebook(lab2).read_grades("lab2")
    assert grade.score == 3.0


def test_a_student_checks_it_with_what_was_released(lab2: Path) -> None:
    hand_in(lab2, "ana")
    notebook = submission.read_notebook(lab2 / "submitted" / "ana" / "lab2" / "lamp.ipynb")
    given, solution = (cell.source for cell in notebook.cells[:2])
    program = f"{given}\n{solution}\nfrom autograder import check\nprint(check('lamp'))"
    done = subprocess.run(
        [sys.executable, "-P", "-c", program], cwd=lab2 / "submitted" / "ana" / "lab2",
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.stderr == ""
    assert done.stdout.splitlines()[-1] == "1.0"


def test_its_corpus_is_run_like_one_of_the_package(root: Path) -> None:
    exercise_folders.use_course(root)
    only = ["right-exemplar", "wrong-dark", "wrong-stub"]
    trials = command.run_corpus("lamp", only=only)
    assert {trial.case.name: trial.difference for trial in trials} == dict.fromkeys(only, "")
    assert "lamp" in exercises.exercise_names()


READS = """
import os
from pathlib import Path
found = [str(path) for place in ("/run", "/home", {root!r}) for path in Path(place).rglob("*")
         if "lamp" in path.name]
print(found)
"""


@needs_sandbox
def test_a_submission_sees_nothing_of_it(root: Path) -> None:
    exercise_folders.use_course(root)
    program = (Cell(READS.format(root=str(root))), Cell("", "lamp-visible", "lamp", "visible"))
    outcome = runner.run(program, hidden=[root])
    assert outcome.outputs[0][0]["text"] == "[]\n"
    (check,) = outcome.verdicts["lamp-visible"].checks
    assert check.status == "failed", "there is no class Lamp"


def test_trusted_submissions_are_examined_too(root: Path) -> None:
    exercise_folders.use_course(root)
    needs_trust(lambda _line: None)
    cells = [part.partition("\n")[2] for part in TASK.split("# %% ")[1:3]]
    program = (*map(Cell, cells), Cell("", "lamp-visible", "lamp", "visible"))
    outcome = runner.run(program, trust=True)
    assert outcome.verdicts["lamp-visible"].score == 1.0


def test_its_digest_covers_exam_instruments_and_points_and_nothing_else(root: Path) -> None:
    exercise_folders.use_course(root)
    before, package = digests.of_exams(("lamp",)), digests.of_exams(("qos",))
    folder = root / "exercises" / "lamp"

    def after(file: str, more: str) -> str:
        path = folder / file
        text = path.read_text()
        path.write_text(text + more)
        exercise_folders.use_course(root)
        digest = digests.of_exams(("lamp",))
        assert digests.of_exams(("qos",)) == package
        path.write_text(text)
        return digest

    for file in ("task.py", "design.md", "corpus/mutants.toml", "corpus/wrong-stub.py"):
        assert after(file, "\n") == before, file
    for file in ("exam.py", "listener.py", "words.py"):
        assert after(file, "\n") != before, file
    assert after("points.toml", "late = 1\n") != before
    exercise_folders.use_course(root)
    assert digests.of_exams(("lamp",)) == before


def test_a_misspelt_name_is_one_sentence(root: Path) -> None:
    exercise_folders.use_course(root)
    with pytest.raises(ExamError, match=r"no exam 'lmap': there are .*lamp.* Did you mean 'lamp'"):
        exercises.load_exam("lmap")


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("qos", r"exercises/qos has the name of one that comes with the course: give its folder"),
        ("two-lamps", r"exercises/two-lamps cannot be called 'two-lamps': give its folder a name"),
    ],
)
def test_a_name_that_an_exercise_cannot_have_is_one_sentence(
    root: Path, name: str, says: str
) -> None:
    write_exercise(root, name)
    for door in (exercise_folders.use_course, build, lambda place: make_release(place, "lab1")):
        with pytest.raises(ExerciseError, match=says) as raised:
            door(root)
        assert len(str(raised.value).splitlines()) == 1
    assert exercises.exercise_names() == [n for n in exercises.exercise_names() if n != "lamp"]


@pytest.mark.parametrize(
    ("file", "text", "says"),
    [
        ("task.py", None, r"The exercise 'lamp' has no task\.py: write .*exercises/lamp/task\.py"),
        ("points.toml", None, r"The exercise 'lamp' has no points\.toml"),
        ("points.toml", "[visible]\nshines = 1\n", r"points\.toml must begin with the exercise's"),
        ("points.toml", "[broken", r"points\.toml is no table of points"),
        ("points.toml", "title = 't'\n[visible]\nshines = 'one'\n", "is no table of points"),
        ("points.toml", "title = 't'\nnotebook = 'patterns'\n[visible]\nshines = 1\n",
         "'lamp' and 'patterns' have a notebook of the same name, 'patterns'"),
    ],
)  # fmt: skip
def test_a_folder_that_is_not_sound_is_one_sentence(
    root: Path, file: str, text: str | None, says: str
) -> None:
    path = root / "exercises" / "lamp" / file
    path.unlink() if text is None else path.write_text(text)
    with pytest.raises(CourseError, match=says) as raised:
        build(root)
    assert len(str(raised.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("text", "error", "says"),
    [
        (None, ExerciseError, r"The exercise 'lamp' has no exam\.py"),
        ("x = 1\n", ExamError, r"exam\.py must make its exam with EXAM = Exam\('lamp', \.\.\.\)"),
    ],
)
def test_an_exam_that_is_none_is_one_sentence(
    root: Path, text: str | None, error: type[CourseError], says: str
) -> None:
    path = root / "exercises" / "lamp" / "exam.py"
    path.unlink() if text is None else path.write_text(text)
    exercise_folders.use_course(root)
    with pytest.raises(error, match=says):
        exercises.load_exam("lamp")


def test_the_exam_of_another_course_is_another(root: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    write_exercise(other, **{"exam.py": EXAM.replace("The lamp shines.", "It is bright.")})
    for place, title in ((root, "The lamp shines."), (other, "It is bright.")) * 2:
        exercise_folders.use_course(place)
        assert exercises.load_exam("lamp").checks["shines"].title == title
        assert points.table()["lamp"].title == "The lamp"
    assert str(root) not in sys.path


def test_workers_elsewhere_are_not_asked_for_it(root: Path) -> None:
    exercise_folders.use_course(root)
    cluster = object.__new__(Cluster)
    with pytest.raises(ClusterError, match=r"'lamp' is the course's own.*without --scheduler"):
        cluster.submit("key", GradingJob((Cell("", "lamp-visible", "lamp", "visible"),), {}))
