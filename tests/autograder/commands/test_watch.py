"""`autograder watch`: a class that hands in through nbgrader's exchange, and nobody at the desk."""

from __future__ import annotations

import os
import random
import shutil
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest
from filelock import FileLock

from autograder.commands.watch_command import GradingOptions, _Watch, watch_assignment
from autograder.corpus import Case
from autograder.gradebook.collecting import exchange as exchange_module
from autograder.gradebook.collecting.exchange_rights import ExchangeRightsError, require_exchange
from autograder.gradebook.collecting.placing import kept_folder
from autograder.gradebook.course_gradebook import CourseGradebook, Grade
from autograder.gradebook.release import make_release
from autograder.grading import engine
from autograder.grading.engine import AssignmentError
from autograder.running.interruption import Interruption
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course
from tests.exchange import COURSE, StudentExchange
from tests.left_out import leave_out
from tests.machine import needs_isolation

pytestmark = [needs_isolation, pytest.mark.xdist_group("watch"), pytest.mark.timeout(1800)]

NIGHT_S = 800.0


@pytest.fixture
def students(course: Course, tmp_path: Path) -> StudentExchange:
    found = StudentExchange(tmp_path / "exchange", course.root, tmp_path / "homes", ASSIGNMENT)
    found.release()
    return found


def grades(root: Path) -> dict[str, Grade]:
    return {grade.student: grade for grade in CourseGradebook(root).read_grades(ASSIGNMENT)}


@pytest.fixture
def start(course: Course, tmp_path: Path) -> Iterator[Callable[[], subprocess.Popen[bytes]]]:
    """Starts watches, each in a process group of its own; they share a log."""
    command = [
        str(Path(sys.executable).with_name("autograder")), "watch", ASSIGNMENT,
        "--root", str(course.root), "--jobs", "2", "--every", "0.5",
    ]  # fmt: skip
    with ExitStack() as stack, (tmp_path / "log").open("ab") as out:

        def start() -> subprocess.Popen[bytes]:
            watch = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=out, start_new_session=True
            )
            stack.callback(end, watch)
            return watch

        yield start


def end(watch: subprocess.Popen[bytes]) -> None:
    if watch.poll() is None:
        os.killpg(watch.pid, signal.SIGKILL)
    watch.wait(60)


def run(arguments: list[str], cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], cwd=cwd, capture_output=True, text=True, timeout=NIGHT_S,
        check=False,
    )  # fmt: skip


def wait_for(
    what: str, holds: Callable[[], bool], process: subprocess.Popen[bytes], log: Path
) -> None:
    deadline = time.monotonic() + NIGHT_S
    while not holds():
        with suppress(subprocess.TimeoutExpired):
            process.wait(0.1)
        assert process.poll() is None, log.read_text()
        assert time.monotonic() < deadline, f"{what}: {log.read_text()}"


def test_a_night_of_hand_ins_ends_as_one_plain_run_does(
    course: Course,
    cases: dict[str, Case],
    students: StudentExchange,
    start: Callable[[], subprocess.Popen[bytes]],
    tmp_path: Path,
) -> None:
    root, log = course.root, tmp_path / "log"
    seed = random.SystemRandom().randrange(10**6)
    work = {
        name: cases[name].make_submission(course.source, course.released)
        for name in ("right-chapter", "wrong-imu-single", "wrong-stub", "right-two-sides")
    }
    handed_in: dict[str, int] = {}

    def hand_in(*wave: tuple[str, str]) -> None:
        for student, case in wave:
            students.submit(student, work.get(case, "{"), NOTEBOOK)
            handed_in[student] = handed_in.get(student, 0) + 1

    def has_feedback(*names: str) -> Callable[[], bool]:
        return lambda: all(len(students.fetch_feedback(name)) == handed_in[name] for name in names)

    hand_in(
        ("ada", "wrong-stub"), ("bob", "right-chapter"), ("cy", "cut off"), ("dan", "wrong-stub")
    )
    watch = start()
    wait_for("the first wave", has_feedback("ada", "bob", "cy", "dan"), watch, log)
    hand_in(*((f"e{n}", ("right-two-sides", "wrong-stub")[n % 2]) for n in range(6)))
    with suppress(subprocess.TimeoutExpired):
        watch.wait(random.Random(seed).uniform(0.5, 6))
    os.killpg(watch.pid, signal.SIGKILL)
    assert watch.wait(60) == -signal.SIGKILL, log.read_text()

    hand_in(("ada", "right-chapter"), *((f"f{n}", "wrong-imu-single") for n in range(3)))
    watch = start()
    by_hand = run(["-m", "autograder", "grade", ASSIGNMENT, "--root", str(root)])
    assert by_hand.returncode == 0 or "Another `autograder grade` is at work" in by_hand.stderr
    wait_for("the whole class", has_feedback(*handed_in), watch, log)
    wait_for("grades", lambda: len(grades(root)) == len(handed_in), watch, log)
    watch.send_signal(signal.SIGTERM)
    assert watch.wait(60) == 128 + signal.SIGTERM, log.read_text()

    plain = tmp_path / "plain"
    left_out = (".autograder", "autograded", "feedback", "submitted", "gradebook.db", "grades.csv")
    shutil.copytree(root, plain, ignore=shutil.ignore_patterns(*left_out))
    make_release(plain, ASSIGNMENT)
    assert run(["-m", "nbgrader", "collect", ASSIGNMENT], cwd=plain).returncode == 0
    engine.grade(plain, ASSIGNMENT)
    assert grades(root) == grades(plain), f"seed {seed}: {log.read_text()}"
    assert len(handed_in) == 13
    assert (root / "grades.csv").is_file()
    new, old = sorted(students.fetch_feedback("ada").items(), reverse=True)
    assert "15 of 20 points" in new[1]
    assert "15 of 20 points" not in old[1]
    assert "Traceback" not in log.read_text()


@contextmanager
def watching(root: Path, said: list[str]) -> Iterator[_Watch]:
    with Interruption() as interruption:
        yield _Watch(root, ASSIGNMENT, GradingOptions(2), interruption, said.append)


def test_a_look_that_finds_nothing_new_says_and_holds_nothing(
    course: Course, students: StudentExchange
) -> None:
    said: list[str] = []
    with watching(course.root, said) as watch:
        watch.look()
        assert said == [], "nobody has submitted yet"
        students.submit("ada", "{", NOTEBOOK)
        watch.look()
        [line] = said
        look_at_her = "collected ada; graded ada (a person has to look at ada)"
        assert line.endswith(f"{look_at_her}; released feedback for 1 student")
        watch.look()  # once more without a change
        settled = watch._settled
        assert settled
        with FileLock(course.root / engine.LOCK):
            watch.look()
        assert said == [line]
        course.submit("bob", "{")  # by hand, not through the exchange
        watch.look()
        assert said[1].endswith("graded bob (a person has to look at bob)")
        with FileLock(course.root / engine.LOCK):
            students.submit("ada", "{ ", NOTEBOOK)
            watch.look()
            watch.look()
        assert len(said) == 3
        assert said[2].endswith("Somebody grades in this course: going on when that is done.")
        watch.look()
        assert "collected ada; graded ada" in said[3]
        place = course.root / "submitted" / "ada" / ASSIGNMENT
        assert (place / f"{NOTEBOOK}.ipynb").read_text() == "{ "
        assert (kept_folder(place) / f"{NOTEBOOK}.ipynb").read_text() == "{"


def collect(root: Path) -> exchange_module.Collected:
    return exchange_module.collect_submissions(
        CourseGradebook(root), ASSIGNMENT, lambda: engine.lock_course(root)
    )


def test_what_was_half_collected_is_collected_again(
    course: Course, students: StudentExchange
) -> None:
    students.submit("ada", "{", NOTEBOOK)
    assert collect(course.root).students == ("ada",)
    # What nbgrader's own leaves behind when it is killed: a time, and no work.
    left = course.root / exchange_module.COLLECTED / ASSIGNMENT / "ada" / ASSIGNMENT
    shutil.copytree(students.submit("ada", "{ }", NOTEBOOK), left)
    (left / f"{NOTEBOOK}.ipynb").unlink()
    assert collect(course.root).students == ("ada",)
    assert (course.folder("ada") / f"{NOTEBOOK}.ipynb").read_text() == "{ }"
    assert collect(course.root).students == ()


def test_one_folder_in_the_exchange_ends_nobody_elses_work(
    course: Course, students: StudentExchange, tmp_path: Path
) -> None:
    secret = tmp_path / "secret"
    secret.write_text("nobody's business")
    for student in ("ada", "bob", "cy", "dan", "eve"):
        students.submit(student, "{", NOTEBOOK)
    linked = next(students.inbound.glob("bob+*"))
    (linked / "plot.png").symlink_to(secret)
    os.mkfifo(next(students.inbound.glob("cy+*")) / "pipe")
    (students.inbound / f"mallory+{ASSIGNMENT}+no time+x").mkdir()
    (next(students.inbound.glob("dan+*")) / "timestamp.txt").write_text("whenever")
    found = collect(course.root)
    assert found.students == ("ada", "dan", "eve")
    bad, link, pipe = sorted(found.remarks, key=lambda said: said[:2] != "ma")
    assert bad == (
        f"mallory+{ASSIGNMENT}+no time+x in the exchange has no name that a submission has: it is "
        "left there."
    )
    both = {link.partition("+")[0]: link, pipe.partition("+")[0]: pipe}
    assert "is not collected: it holds a link, plot.png" in both["bob"]
    assert "is not collected" in both["cy"]
    assert "is a named pipe" in both["cy"]
    assert collect(course.root).students == (), "a time that nobody can read is no news"


def test_a_submission_under_anothers_name_is_left_in_the_exchange(
    course: Course, students: StudentExchange
) -> None:
    with (course.root / "nbgrader_config.py").open("a") as config:
        config.write("\nc.ExchangeCollect.check_owner = True\n")
    me = students.submit("ada", "{", NOTEBOOK).owner()
    students.submit(me, "{", NOTEBOOK)
    found = collect(course.root)
    assert found.students == (me,)
    [remark] = found.remarks
    assert f"was put there by {me}, not by ada: it is left there" in remark
    assert "check_owner = False" in remark


def test_one_watch_at_a_time_and_its_sentence(course: Course, students: StudentExchange) -> None:
    lock = course.root / ".autograder" / f"watch-{ASSIGNMENT}.lock"
    lock.parent.mkdir(exist_ok=True)
    with FileLock(lock):
        done = run(["-m", "autograder", "watch", ASSIGNMENT, "--root", str(course.root)])
    assert done.returncode == 1
    assert "Another `autograder watch ch05` is at work" in done.stderr
    assert done.stdout == ""


def problem(root: Path) -> str:
    with pytest.raises(ExchangeRightsError) as caught:
        require_exchange(CourseGradebook(root), ASSIGNMENT)
    return str(caught.value)


def test_an_exchange_that_cannot_be_used_is_one_sentence(
    course: Course, students: StudentExchange, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = students.root / COURSE
    assert require_exchange(CourseGradebook(course.root), ASSIGNMENT) == []
    closed: set[Path] = set()
    monkeypatch.setattr(  # root may do everything
        "autograder.gradebook.collecting.exchange_rights.os.access",
        lambda path, right: Path(path) not in closed or right == os.X_OK,
    )
    closed.add(students.root)
    assert problem(course.root).startswith(f"You may not write {students.root} (it is drwxrwxrwx")
    assert "the right w is missing" in problem(course.root)
    assert f"sudo chmod 777 {students.root}" in problem(course.root)
    closed.clear()
    closed.add(home / "inbound")
    assert f"You may not read {home / 'inbound'}" in problem(course.root)
    closed.clear()
    (home / "feedback").mkdir(mode=0o711)
    if os.geteuid() != 0:
        leave_out("only root can give a folder to another user")
    os.chown(home / "feedback", 4711, -1)
    assert f"{home / 'feedback'} belongs to user 4711" in problem(course.root)
    (home / "feedback").rmdir()
    (home / "inbound").rename(home / "elsewhere")
    assert "`nbgrader release_assignment ch05`" in problem(course.root)
    students.root.rename(students.root.parent / "moved")
    assert problem(course.root).startswith(f"There is no exchange at {students.root}: make it with")


def test_what_students_may_not_do_in_the_exchange_is_said(
    course: Course, students: StudentExchange
) -> None:
    home = students.root / COURSE
    (home / "feedback").mkdir()
    (home / "feedback").chmod(0o700)
    (home / "inbound").chmod(0o2731)
    said = require_exchange(CourseGradebook(course.root), ASSIGNMENT)
    assert said == [
        f"{home / 'inbound'} is {stat.filemode((home / 'inbound').stat().st_mode)}, so nobody else "
        f"can hand in: run `chmod o+w {home / 'inbound'}`, unless everybody's server runs as one "
        "user.",
        f"{home / 'feedback'} is drwx------, so nobody else can fetch feedback: run `chmod o+x "
        f"{home / 'feedback'}`, unless everybody's server runs as one user.",
    ]


def test_a_watch_without_an_exchange_ends_with_the_sentence(course: Course, tmp_path: Path) -> None:
    with (course.root / "nbgrader_config.py").open("a") as config:
        config.write(f"\nc.Exchange.root = {str(tmp_path / 'none')!r}\n")
    done = run(["-m", "autograder", "watch", ASSIGNMENT, "--root", str(course.root)])
    assert done.returncode == 1
    [line] = done.stderr.splitlines()
    assert line.startswith(f"autograder: There is no exchange at {tmp_path / 'none'}: make it")


@pytest.mark.parametrize("name", ["ch5", "..", "../submitted"])
def test_a_watch_of_what_is_no_assignment_ends_with_the_sentence(course: Course, name: str) -> None:
    course.submit("ada", "{")
    with pytest.raises(AssignmentError, match="There is no assignment"):
        watch_assignment(course.root, name, GradingOptions(2), say=str)
    assert (course.folder("ada") / f"{NOTEBOOK}.ipynb").is_file()
