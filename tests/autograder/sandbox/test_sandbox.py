"""The sandbox itself: whom it lets in, what it says where it does not work, what is examined in it.

What it keeps out is in tests/hostile.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import pytest

from autograder import exercises, sandbox
from autograder.corpus import Case
from autograder.examination.program import Cell
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.grading import engine
from autograder.processes.descriptors import readable_descriptors
from autograder.running import runner
from autograder.running.outcomes.outcome_store import KIND, OutcomeStore
from autograder.running.start import ExaminerError, ExaminerProcess
from autograder.sandbox import SandboxError, SandboxStartError, sandbox_support, warm_starts
from autograder.sandbox.confinement import network, seccomp
from autograder.sandbox.resource_limits import Limits
from autograder.sandbox.resources import proc_folder
from autograder.sandbox.resources.proc_folder import ProcFolder
from autograder.sandbox.resources.resource_watch import ResourceWatch
from autograder.sandbox.sandbox import Sandbox
from autograder.sandbox.sandboxed_subject import Warden
from autograder.util import exercise_folders
from autograder.util.state_table import StateTable
from course.util import containers
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course
from tests.machine import needs_sandbox

EXAM = Cell("", "qos-hidden", "qos", "hidden")


def without(tool: str, folder: Path) -> str:
    """Return a PATH on which everything is found but ``tool``."""
    folder.mkdir()
    for place in reversed(os.environ["PATH"].split(os.pathsep)):
        for file in Path(place).glob("*"):
            if file.name != tool:
                (folder / file.name).unlink(missing_ok=True)
                (folder / file.name).symlink_to(file)
    return str(folder)


def test_nobody_is_graded_without_a_sandbox(course: Course, tmp_path: Path) -> None:
    course.submit("right", course.released)
    path = without("bwrap", tmp_path / "bin")
    executable = shutil.which("autograder")
    assert executable is not None
    refused = subprocess.run(
        [executable, "grade", ASSIGNMENT, "--json"], cwd=course.root, check=False,
        env={**os.environ, "PATH": path}, capture_output=True, text=True, timeout=170,
    )  # fmt: skip
    assert refused.returncode == 1
    assert "sudo apt install bubblewrap iproute2 nftables" in refused.stderr
    assert "--trust-submissions" in refused.stderr
    assert len(refused.stderr.strip().splitlines()) == 1
    assert not (course.root / "grades.csv").exists()


def test_what_a_trusted_run_cannot_examine_is_left_to_a_person(
    course: Course, cases: dict[str, Case]
) -> None:
    course.submit("right", cases["right-chapter"].make_submission(course.source, course.released))
    engine.grade(course.root, ASSIGNMENT, trust=True)
    (entry,) = CourseGradebook(course.root).read_grades(ASSIGNMENT)
    assert entry.score == 13, "what needs a lossy network is neither passed nor failed"
    assert entry.needs_manual_grade
    feedback = (course.root / f"feedback/right/{ASSIGNMENT}/{NOTEBOOK}.html").read_text()
    assert "After a hand-in a person looks at it." in feedback
    assert "not examined here" in feedback


def test_appamor_is_named_where_it_is_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    setting = tmp_path / "apparmor_restrict_unprivileged_userns"
    setting.write_text("1\n")
    monkeypatch.setattr(sandbox_support, "_APPARMOR", setting)
    monkeypatch.setattr(containers, "name_container", lambda _environment: "")
    advice = sandbox_support._failure_advice("bwrap: setting up uid map: Permission denied")
    assert "AppArmor" in advice
    assert "apparmor_parser -r /etc/apparmor.d/bwrap" in advice
    assert "--trust-submissions" in advice
    assert sandbox_support.PROFILE.is_file()


def test_a_container_without_the_right_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sandbox_support, "_reads", lambda _path: "")
    for kind, needed in (("", "docker run --privileged"), ("Docker", "seccomp=seccomp.json")):
        monkeypatch.setattr(containers, "name_container", lambda _environment, kind=kind: kind)
        advice = sandbox_support._failure_advice("bwrap: No permissions to create new namespace")
        assert "No permissions to create new namespace" in advice
        assert needed in advice
        assert "--trust-submissions" in advice


def test_an_untrusted_program_never_falls_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        sandbox_support, "abilities", lambda: sandbox.Abilities("There is none here.")
    )
    with pytest.raises(SandboxError, match=r"There is none here\."):
        runner.run((Cell("1"),))


def test_outcomes_of_different_places_are_kept_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outcome = runner.Outcome([[]])
    trusting = OutcomeStore(tmp_path, trust=True)
    trusting.put((Cell("1"),), {}, outcome)
    assert trusting.get((Cell("1"),), {}) == outcome
    for loss in (True, False):
        monkeypatch.setattr(sandbox, "abilities", lambda x=loss: sandbox.Abilities(loss=x))
        assert OutcomeStore(tmp_path).get((Cell("1"),), {}) is None
        OutcomeStore(tmp_path).put((Cell("1"),), {}, outcome)
    assert len(StateTable(tmp_path, KIND).rows()) == 3


@needs_sandbox
def test_a_submission_finds_its_files_and_a_scratch_of_its_own() -> None:
    source = """
import os, tempfile
from helpers.profiles import DEPTH
print(DEPTH, os.getcwd(), os.environ["HOME"])
open("mine", "w").write("x" * 1000)
tempfile.TemporaryFile().write(b"x" * 1000)
"""
    outcome = runner.run((Cell(source),), {"helpers/profiles.py": b"DEPTH = 7"})
    assert outcome.outputs[0][0]["text"] == "7 /home/student /home/student\n"
    assert not outcome.notes


def contents(paths: Iterable[Path]) -> list[str]:
    """Return these files and all that is in these folders, those with something in them."""
    files = (file for path in paths for file in ([path] if path.is_file() else path.rglob("*")))
    return sorted(str(file) for file in files if file.is_file() and file.stat().st_size)


READS = """
import os, sys
from pathlib import Path
read = []
for name in {names}:
    try:
        read += [name] if open(name, "rb").read(1) else []
    except OSError:
        pass
marked = []
for folder in {{*sys.path, *(os.path.realpath(entry) for entry in sys.path)}}:
    for package in ("autograder", "course", "quizzes"):
        for path in Path(folder, package).rglob("*"):
            if path.is_file() and b"### BEGIN " + b"HIDDEN TESTS" in path.read_bytes():
                marked.append(path)
named = [m for m in sys.modules if m.startswith("autograder.exercises.") and m.endswith(".task")]
print(len(read), read[:3], marked, named)
"""


@needs_sandbox
@pytest.mark.parametrize("warm", [True, False])
def test_a_submission_reads_no_solution_no_hidden_test_and_no_corpus(
    monkeypatch: pytest.MonkeyPatch, warm: bool
) -> None:
    kept = contents(exercise_folders.kept_from_students())
    for name in exercises.exercise_names():
        own = [file for file in kept if f"/exercises/{name}/" in file]
        assert any(file.endswith("/task.py") for file in own)
        assert any(file.endswith("/design.md") for file in own)
        assert any("/corpus/" in file for file in own)
        assert not any(file.endswith("/exam.py") for file in own)
    if not warm:
        abilities = replace(sandbox.abilities(), warm=False)
        monkeypatch.setattr(sandbox_support, "abilities", lambda: abilities)
    outcome = runner.run((Cell(READS.format(names=kept)),))
    assert outcome.outputs[0][0]["text"] == "0 [] [] []\n"


def test_what_an_installer_has_compiled_is_kept_from_submissions_too(tmp_path: Path) -> None:
    folder = tmp_path / "exercises" / "one"
    for name in (
        "__pycache__/task.cpython-311.pyc", "__pycache__/exam.cpython-311.pyc", "corpus/right.py",
        "task.py", "task-Copy1.py", "exam.py", "rig.py", "points.toml", "notes", "../begun/task.py",
    ):  # fmt: skip
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    kept = exercise_folders.kept_from_students(tmp_path)
    assert {str(path.relative_to(tmp_path)) for path in kept} == {
        "exercises/one/__pycache__/task.cpython-311.pyc", "exercises/one/corpus",
        "exercises/one/task.py", "exercises/one/task-Copy1.py", "exercises/one/notes",
        "exercises/begun/task.py", "corpus/every", "corpus/README.md", "commands/demo_class.toml",
        "commands/new_exercise",
    }  # fmt: skip


@pytest.mark.parametrize("module", [warm_starts.SUBJECT, warm_starts.EXAMINER])
def test_what_submissions_are_forked_from_has_never_opened_them(module: str) -> None:
    program = f"""
import sys
opened = set()
sys.addaudithook(lambda event, its: opened.add(str(its[0])) if event == "open" else None)
import {module} as process
process.preload()
print(*opened, sep="\\n")
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True
    )
    opened = set(done.stdout.splitlines())
    assert opened
    assert not opened & set(contents(exercise_folders.kept_from_students()))


@needs_sandbox
def test_a_subjects_process_is_seen_from_outside() -> None:
    with sandbox.choose_isolation() as place:
        examiner = place.spawn(["sh", "-c", "read -r _"], stdin=subprocess.PIPE)
        program = "import os, sys; os.write(int(sys.argv[1]), b'up'); os.read(int(sys.argv[2]), 1)"
        (up, up_end), (stay, stay_end) = os.pipe(), os.pipe()
        command = [sys.executable, "-c", program, str(up_end), str(stay)]
        with place.start_subject(command, {}, [up_end, stay]) as subject:
            os.close(up_end)
            assert os.read(up, 2) == b"up"
            subject.ready()
            process = Path(f"/proc/{subject.pid}")
            assert program in (process / "cmdline").read_text()
            assert list((process / "task").iterdir())
            assert list((process / "fd").iterdir())
            assert int((process / "statm").read_text().split()[1]) > 0
        assert examiner.stdin is not None
        examiner.stdin.close()
        for descriptor in (up, stay, stay_end):
            os.close(descriptor)
    assert not process.exists()


@needs_sandbox
def test_who_is_not_root_gets_the_same_sandbox() -> None:
    """Root of a user namespace is a user like others: it takes the way of who is not root."""
    program = "from autograder import sandbox; print(sandbox.abilities())"
    ran = subprocess.run(
        ["unshare", "-r", sys.executable, "-c", program],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert ran.stdout.strip() == str(sandbox.abilities())


@needs_sandbox
def test_the_hidden_part_is_examined_in_full() -> None:
    outcome = runner.run((EXAM,))
    assert {check.status for check in outcome.verdicts["qos-hidden"].checks} == {"not_checked"}


@needs_sandbox
def test_the_time_of_children_that_nobody_waits_for_counts() -> None:
    program = """
import os, signal, time
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
while True:
    ended, end = os.pipe()
    if os.fork() == 0:
        while time.process_time() < 0.5:
            pass
        os._exit(0)
    os.close(end)
    os.read(ended, 1)
    os.close(ended)
"""
    limits = Limits(cpu=3, wall=60)
    with Sandbox(limits) as box:
        network = box.run_in_network(["sh", "-c", "read -r _"], stdin=subprocess.PIPE)
        with box.start([sys.executable, "-c", program], {}, ()) as subject:
            assert subject.describe_end(90) == "it used more than 3 s of processor time"
        network.communicate(b"\n")


def test_limits_survive_the_way_to_the_subject() -> None:
    limits = Limits(memory=1, wall=2)
    assert Limits.from_json(limits.to_json()) == limits


def test_the_machine_s_own_processes_do_not_count() -> None:
    # A process that is not in its sandbox yet, as bwrap's first one is while it makes it.
    with subprocess.Popen(["sleep", "infinity"]) as process:
        handle = os.pidfd_open(process.pid)
        watch = ResourceWatch(process.pid, handle, Limits(processes=1, cpu=0, memory=0, wall=1))
        assert process.wait(30) == -signal.SIGKILL
        watch.stop()
        os.close(handle)
    assert watch.reason == "it ran for more than 1 s"


CONNECTIONS = """
import socket, sys
listens = {where}
said = [listens]
print(flush=True)
sys.stdin.readline()
said += [socket.create_connection(listens.getsockname()[:2]), listens.accept()[0]]
said[1].send(bytes(1000))
listens.close()
print(flush=True)
sys.stdin.readline()
"""
"""Two sockets of which one holds what nobody reads, once their network is up."""


@needs_sandbox
@pytest.mark.parametrize(
    ("where", "table"),
    [("socket.create_server(('127.0.0.1', 0))", "tcp"),
     ("socket.create_server(('::1', 0), family=socket.AF_INET6)", "tcp6")],
)  # fmt: skip
def test_connections_are_seen_where_there_are_any(where: str, table: str) -> None:
    script = 'ip link set lo up; echo; read -r _; exec "$@"'
    command = [sys.executable, "-c", CONNECTIONS.format(where=where)]
    with subprocess.Popen(
        ["unshare", "-rn", "bash", "-c", script, "bash", *command],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as process:  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        net, seen, held = f"/proc/{process.pid}/net", [], []
        for _ in range(3):
            process.stdout.readline()
            seen.append(proc_folder.has_connections(net))
            held.append(sum(map(proc_folder.queued_bytes, proc_folder.read_rows(f"{net}/{table}"))))
            process.stdin.write(b"\n")
            process.stdin.flush()
    assert seen == [False, True, True]
    assert held == [0, 0, 1000]


def watch_that_kills() -> ResourceWatch:
    """Watch a process that does nothing until the watch has killed it; return the watch."""
    with subprocess.Popen(["sleep", "infinity"]) as process:
        handle = os.pidfd_open(process.pid)
        watch = ResourceWatch(process.pid, handle, Limits())
        assert process.wait(30) == -signal.SIGKILL
        watch.stop()
        os.close(handle)
    return watch


def test_nothing_runs_on_unwatched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the watch stumbles over: that is the grader's mistake, and the sandbox's end."""

    def stumble(*_: object) -> str:
        raise ValueError("odd")

    monkeypatch.setattr(ResourceWatch, "_excess", stumble)
    watch = watch_that_kills()
    assert watch.failed
    assert watch.reason == "the grader could not see what it used (ValueError: odd)"


def test_files_that_stay_unreadable_end_a_sandbox(monkeypatch: pytest.MonkeyPatch) -> None:
    looks = []

    def refuse(*_: object) -> str:
        looks.append("")
        raise PermissionError("refused")

    monkeypatch.setattr(ResourceWatch, "_excess", refuse)
    monkeypatch.setattr("autograder.sandbox.resources.resource_watch.BLIND_TIMEOUT_S", 0.2)
    watch = watch_that_kills()
    assert len(looks) > 1, "files may be missing for a moment"
    assert watch.failed


@needs_sandbox
def test_a_failure_of_the_watch_is_left_to_a_person(monkeypatch: pytest.MonkeyPatch) -> None:
    def stumble(_: ResourceWatch, processes: list[ProcFolder]) -> str:
        if (
            max(map(proc_folder.count_descriptors, processes), default=0) > 200
        ):  # the cell has been reached
            raise ValueError("odd")
        return ""

    monkeypatch.setattr(ResourceWatch, "_held", stumble)
    cell = "files = [open('/dev/null') for _ in range(200)]; import threading; "
    outcome = runner.run((Cell(cell + "threading.Event().wait()"), EXAM))
    assert {check.status for check in outcome.verdicts["qos-hidden"].checks} == {"grader_error"}
    assert "the grader could not see what it used" in outcome.notes[0]


def test_what_is_in_its_subjects_network_is_not_counted_against_an_examiner(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "autograder.sandbox.confinement.visible_files.SCRATCH", ()
    )  # of a sandbox, and here is none
    monkeypatch.setattr(proc_folder, "locked_devices", lambda _: [])
    with subprocess.Popen(["sleep", "infinity"]) as process:
        handle = os.pidfd_open(process.pid)
        watches = [
            ResourceWatch(process.pid, handle, limits)
            for limits in (Limits(sockets=0), Limits.of_examiner())
        ]
        found = [watch._kept_by_kernel() for watch in watches]
        for watch in watches:
            watch.stop()
        process.kill()
        os.close(handle)
    assert found == ["there were more than 0 sockets in its network", ""]
    assert watches[1]._queued == 0


@needs_sandbox
def test_an_examiner_that_fails_with_an_excessive_subject_is_no_grader_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ExaminerError("The examiner ended without a verdict.")

    monkeypatch.setattr(ExaminerProcess, "verdict", fail)
    monkeypatch.setattr(runner, "EXCESS_TIMEOUT_S", 4.0)  # to start 40 processes beside other work
    cell = (
        "import os, threading, time\n"
        "fork = lambda: [os.fork() or time.sleep(60) for _ in range(40)]\n"
        "threading.Timer(0.3, fork).start()"
    )
    outcome = runner.run((Cell(cell), EXAM))
    assert {check.status for check in outcome.verdicts["qos-hidden"].checks} == {"not_checked"}
    assert outcome.notes == ["The notebook's process ended: it started more than 32 processes."]


@needs_sandbox
def test_a_sandbox_that_is_gone_before_its_subject_says_why(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def stumble(*_: object) -> str:
        raise ValueError("odd")

    def late(arguments: list[str], fds: list[int], process: int, user: int | None) -> object:
        assert readable_descriptors([process], 30), "the watch ends the sandbox"
        return subject(arguments, fds, process, user)

    subject = warm_starts.subject
    monkeypatch.setattr(ResourceWatch, "_excess", stumble)
    monkeypatch.setattr(warm_starts, "subject", late)
    with pytest.raises(SandboxStartError, match=r"could not see what it used .*odd"):
        runner.run((EXAM,))


def test_the_filter_is_a_whole_number_of_instructions() -> None:
    program = seccomp.filter_program()
    assert len(program) % 8 == 0
    assert len(program) // 8 < 4096, "more than the kernel takes"


def test_a_tool_that_hangs_is_not_waited_for_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(network, "TOOL_TIMEOUT_S", 0.1)
    with subprocess.Popen(["sleep", "infinity"], stdout=subprocess.PIPE) as tool:
        assert tool.stdout is not None
        with pytest.raises(SandboxStartError, match="not there after"):
            network.require_word(tool.stdout, tool)
        assert tool.wait() == -signal.SIGKILL


def test_what_a_killed_tool_leaves_is_not_waited_for_either() -> None:
    """As bwrap does: its child has its standard error, and waits for it."""
    info, info_end = os.pipe()
    with subprocess.Popen(
        ["sh", "-c", "sleep infinity & echo odd >&2; kill -9 $$"],
        stderr=subprocess.PIPE, start_new_session=True,
    ) as tool:  # fmt: skip
        os.close(info_end)  # so that it has said nothing
        with pytest.raises(SandboxStartError, match="odd"):
            network.child(info, tool)


def test_a_warden_that_is_gone_is_let_go_when_it_is_told_something() -> None:
    with subprocess.Popen(
        ["true"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        process.wait()
        with Warden(process) as warden:
            warden.announce_subject(1, 1, [])
        for stream in (process.stdin, process.stdout, process.stderr):
            assert stream is not None
            assert stream.closed
