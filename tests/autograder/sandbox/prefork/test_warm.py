"""Warm starts: what a fork is given, what it cannot reach, and how its end is told."""

from __future__ import annotations

import os
import select
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from autograder.examination.program import Cell
from autograder.processes import descriptors
from autograder.running import runner
from autograder.sandbox.prefork import ForkedProcess, Zygote, ZygoteError, ZygotePool
from autograder.sandbox.prefork import zygote_pool as nursery_module
from autograder.sandbox.prefork.fork_request import ForkRequest
from course.runtime.waiting import Pulse, poll_condition
from tests.machine import needs_warm_starts

PROGRAM = """
import atexit, os, signal, sys, threading

def preload():
    import rclpy  # and with it LTTng, which has threads that listen

def main(arguments):
    command, *rest = arguments
    if command == "say":
        os.write(int(rest[0]), " ".join([os.environ["NAME"], os.getcwd(), *sys.argv]).encode())
        os.write(int(rest[0]), ("|" + ",".join(sorted(os.listdir("/proc/self/fd")))).encode())
    elif command == "wait":
        os.read(0, 1)
        return 3
    elif command == "raise":
        raise ValueError("nothing of it")
    elif command == "signal":
        os.kill(os.getpid(), signal.SIGTERM)
    elif command == "leave":
        atexit.register(print, "last words")
        many = threading.Barrier(50)
        threads = [threading.Thread(target=many.wait) for _ in range(many.parties)]
        for thread in threads:  # their ends give the memory of stacks back to the machine
            thread.start()
        threading.Thread(target=lambda: threads[-1].join() or print("a thread ended")).start()
        if rest:
            sys.exit(rest[0])
    return 0
"""


@pytest.fixture(scope="module")
def zygote(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Zygote]:
    folder = tmp_path_factory.mktemp("modules")
    (folder / "forked_program.py").write_text(PROGRAM)
    path = os.pathsep.join([str(folder), *sys.path])
    made = Zygote("forked_program", {**os.environ, "PYTHONPATH": path})
    yield made
    made.close()


def forked(zygote: Zygote, *arguments: str, **options: object) -> tuple[ForkedProcess, int, int]:
    """Fork; return the process, what writes to its standard input, what reads its errors."""
    (reads, into), (out_of, writes) = os.pipe(), os.pipe()
    task = ForkRequest("forked_program", list(arguments), [0, 1, 2], **options)  # type: ignore[arg-type]
    process = zygote.fork(task, [reads, writes, writes])
    os.close(reads)
    os.close(writes)
    return process, into, out_of


def test_a_fork_has_its_own_arguments_environment_folder_and_descriptors(
    zygote: Zygote, tmp_path: Path
) -> None:
    process, into, out_of = forked(
        zygote, "say", "1", environment={"NAME": "student"}, folder=str(tmp_path)
    )
    assert process.wait(30) == 0
    with os.fdopen(out_of) as stream:
        said, numbers = stream.read().split("|")
    assert said == f"student {tmp_path} forked_program say 1"
    assert set(numbers.split(",")) - {"3"} == {"0", "1", "2"}, "3 is the look at the folder itself"
    os.close(into)


def test_how_it_ended_is_told_as_popen_tells_it(zygote: Zygote) -> None:
    process, into, out_of = forked(zygote, "wait")
    assert process.poll() is None
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.01)
    os.close(into)
    assert process.wait(30) == 3
    assert process.poll() == 3
    os.close(out_of)
    process, into, out_of = forked(zygote, "signal")
    assert process.wait(30) == -15
    for descriptor in (into, out_of):
        os.close(descriptor)


def test_what_a_fork_raises_is_read_from_its_errors(zygote: Zygote) -> None:
    process, into, out_of = forked(zygote, "raise")
    assert process.wait(30) == 1
    with os.fdopen(out_of) as stream:
        assert stream.read().splitlines()[-1] == "ValueError: nothing of it"
    os.close(into)


@pytest.mark.parametrize(("said", "code"), [([], 0), (["no submission"], 1)])
def test_a_fork_ends_as_a_program_does(zygote: Zygote, said: list[str], code: int) -> None:
    (says, output), (complains, errors) = os.pipe(), os.pipe()
    task = ForkRequest("forked_program", ["leave", *said], [1, 2])
    process = zygote.fork(task, [output, errors])
    os.close(output)
    os.close(errors)
    assert process.wait(30) == code
    with os.fdopen(says) as stream:
        assert stream.read().splitlines() == ["a thread ended", "last words"]
    with os.fdopen(complains) as stream:
        assert stream.read().splitlines() == said


def test_a_fork_that_cannot_join_is_refused_and_the_next_one_is_not(zygote: Zygote) -> None:
    with (
        Path(os.devnull).open() as no_namespace,
        pytest.raises(ZygoteError, match=r"could not be forked \(.*setns"),
    ):
        zygote.fork(
            ForkRequest("forked_program", ["say"], [0, 1, 2], namespaces=["net"]),
            [no_namespace.fileno()] * 4,
        )
    process, into, out_of = forked(zygote, "say", "1", environment={"NAME": "next"})
    assert process.wait(30) == 0
    for descriptor in (into, out_of):
        os.close(descriptor)


def test_a_module_that_cannot_be_imported_is_named() -> None:
    with pytest.raises(ZygoteError, match="no_such_module"):
        Zygote("no_such_module", dict(os.environ))


def test_a_nursery_has_one_zygote_for_a_module_and_environment(tmp_path: Path) -> None:
    (tmp_path / "forked_program.py").write_text(PROGRAM)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    nursery = ZygotePool()
    first = nursery.get_zygote("forked_program", environment)
    assert nursery.get_zygote("forked_program", environment) is first
    second = nursery.get_zygote("forked_program", {**environment, "NAME": "other"})
    assert second is not first
    assert not first.is_alive
    nursery.close()
    assert not second.is_alive


MEETING = """
def preload():
    open({fifo!r}, {mode!r}).close()  # waits until the other end is opened, too

def main(arguments):
    return 0
"""


def test_the_zygotes_of_two_modules_start_side_by_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(nursery_module, "START_TIMEOUT_S", 30.0)
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    for name, mode in (("meets_reading", "r"), ("meets_writing", "w")):
        (tmp_path / f"{name}.py").write_text(MEETING.format(fifo=str(fifo), mode=mode))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    nursery = ZygotePool()
    with ThreadPoolExecutor(2) as pool:
        starts = [
            pool.submit(nursery.get_zygote, f"meets_{what}", environment)
            for what in ("reading", "writing")
        ]
    assert all(start.result().is_alive for start in starts)
    nursery.close()


@needs_warm_starts
def test_a_subject_has_no_rights_and_nothing_of_its_zygote() -> None:
    source = """
import ctypes, os
status = dict(line.split(":\\t") for line in open("/proc/self/status").read().splitlines())
print([status[name] for name in ("CapEff", "CapPrm", "CapInh", "CapBnd", "CapAmb")])
print(status["NoNewPrivs"], status["Seccomp"])
links = {os.readlink(f"/proc/self/fd/{n}").split(":")[0] for n in os.listdir("/proc/self/fd")
         if os.path.exists(f"/proc/self/fd/{n}")}
print(sorted(links))
print(sorted(os.listdir("/home")), os.path.exists("/etc/shadow"))
for path in ("/proc/self/exe", "/proc/1/mem"):
    try:
        open(path, "r+b")
        print("opened", path)
    except OSError:
        pass
"""
    outcome = runner.run((Cell(source),))
    assert not outcome.notes
    assert outcome.outputs[0][0]["text"].splitlines() == [
        str(["0" * 16] * 5), "1 2", "['/dev/null', 'anon_inode', 'pipe', 'socket']",
        "['student'] False",
    ]  # fmt: skip


@needs_warm_starts
def test_two_subjects_are_two_processes_with_chances_of_their_own() -> None:
    source = "import random, numpy; print(random.random(), numpy.random.random(), end='')"
    runs = [runner.run((Cell(source),)).outputs[0][0]["text"].split() for _ in range(2)]
    assert not set(runs[0]) & set(runs[1])


@needs_warm_starts
def test_any_number_of_jobs_can_run_beside_one() -> None:
    descriptors.allow_many()
    others = [os.open(os.devnull, os.O_RDONLY) for _ in range(1200)]  # as of sixty jobs
    try:
        outcome = runner.run((Cell("print(6 * 7)"),))
    finally:
        for other in others:
            os.close(other)
    assert (outcome.outputs[0][0]["text"], outcome.notes) == ("42\n", [])


def subjects_of(pid: int) -> list[int]:
    """Return those descendants of a process that run under a system call filter."""
    found = []
    for task in Path(f"/proc/{pid}/task").glob("*"):
        with suppress(OSError):
            for child in map(int, (task / "children").read_text().split()):
                filtered = "Seccomp:\t2" in Path(f"/proc/{child}/status").read_text()
                forked_ = (
                    b"autograder.examination.subject.process"
                    in Path(f"/proc/{child}/cmdline").read_bytes()
                )
                found += [child] if filtered and forked_ else subjects_of(child)
    return found


@needs_warm_starts
def test_a_subject_ends_with_an_engine_that_is_killed() -> None:
    program = """
from autograder.processes import descriptors
from autograder.running import runner
from autograder.examination.program import Cell
runner.run((Cell("while True: pass"),), cell_timeout=600)
"""
    engine = subprocess.Popen([sys.executable, "-c", program])
    try:
        (subject,) = poll_condition(lambda: subjects_of(engine.pid), 120, Pulse()) or [0]
        assert subject
        handle = os.pidfd_open(subject)
    finally:
        engine.kill()
        engine.wait()
    assert select.select([handle], [], [], 60)[0], "the subject goes on"
    os.close(handle)
