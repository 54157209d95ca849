"""What an examiner in its sandbox can reach, and what is told to it from outside."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from autograder.examination.program import Cell
from autograder.examination.verdict import Verdict, VerdictError
from autograder.processes.outside import warden_requests
from autograder.processes.outside.asking import Here
from autograder.processes.outside.warden_requests import CannotLoseError, RequestError
from autograder.processes.process_folders import Sandboxed, number_inside
from autograder.running import runner
from autograder.sandbox.sandbox import Sandbox
from course.runtime.waiting import Pulse, poll_condition
from tests.machine import needs_sandbox, needs_warm_starts

EXAMINED = """
import json, os, socket, sys
from pathlib import Path

def tries(what):
    try:
        return repr(what())
    except Exception as error:
        return type(error).__name__

root, module = sys.argv[1:3]
status = dict(line.split(":\\t") for line in open("/proc/self/status").read().splitlines())
print(json.dumps({
    "root": tries(lambda: os.listdir(root)),
    "writes": tries(lambda: open(module, "a")),
    "writes beside": tries(lambda: Path(module).with_name("mine").write_text("x")),
    "processes": sorted(int(name) for name in os.listdir("/proc") if name.isdecimal()),
    "capabilities": int(status["CapEff"], 16),
    "filtered": status["Seccomp"],
    "networks": [name for _, name in socket.if_nameindex()],
    "token": "SECRET_TOKEN" in os.environ,
    "path": sys.path[0],
}), flush=True)
"""


@pytest.mark.parametrize("warm", [False, pytest.param(True, marks=needs_warm_starts)])
@needs_sandbox
def test_an_examiner_reaches_nothing_of_ours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, warm: bool
) -> None:
    monkeypatch.setenv("SECRET_TOKEN", "secret")
    (tmp_path / "gradebook.db").write_text("grades")
    ours = Path(runner.__file__)
    command = [sys.executable, "-P", "-c", EXAMINED, str(tmp_path), str(ours)]
    with Sandbox(hidden=[tmp_path], warm=warm) as box:
        examiner = box.spawn(command, stdout=subprocess.PIPE)
        assert examiner.stdout is not None
        with examiner.stdout:
            found = json.loads(examiner.stdout.read())
    refused = ("PermissionError", "OSError")  # of another user; read-only
    assert found["root"] == "FileNotFoundError"
    assert found["writes"] in refused
    assert found["writes beside"] in refused
    assert (found["capabilities"], found["filtered"]) == (0, "2")
    assert found["networks"] == ["lo"]
    assert not found["token"]
    assert max(found["processes"]) < 10
    assert found["path"] not in ("", str(Path.cwd()))


@needs_warm_starts
def test_a_forked_examiner_is_where_its_sandbox_is() -> None:
    """It is in no namespace of this process's but the time's, and has no right."""
    subject, control = socket.socketpair()
    with subject, control, Sandbox(warm=True) as box:
        command = [sys.executable, "-P", "-m", "autograder.running.examiner", "--domain", "1"]
        fd = control.fileno()
        examiner = box.spawn([*command, "--control", str(fd)], pass_fds=[fd])
        status = Path(f"/proc/{examiner.pid}/status")
        assert poll_condition(lambda: "Seccomp:\t2" in status.read_text(), 30.0, Pulse())
        for kind in ("mnt", "pid", "net", "ipc", "uts"):
            theirs, own = (Path(f"/proc/{who}/ns/{kind}") for who in (examiner.pid, os.getpid()))
            assert theirs.stat().st_ino != own.stat().st_ino, kind
        assert "CapEff:\t0000000000000000" in status.read_text()
        if os.geteuid() == 0:
            assert "Uid:\t0" not in status.read_text()
        assert examiner.poll() is None
        for stream in (examiner.stdin, examiner.stdout, examiner.stderr):
            assert stream is not None
            stream.close()


@needs_sandbox
def test_no_process_of_ours_imports_from_the_folder_that_it_is_started_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("json", "socket", "rclpy", "course", "autograder"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('imported')")
    monkeypatch.chdir(tmp_path)
    outcome = runner.run((Cell("print('ran')"), Cell("", "qos-visible", "qos", "visible")))
    assert outcome.outputs[0][0]["text"] == "ran\n"
    assert not outcome.has_grader_error


@contextmanager
def sandboxed(program: str) -> Iterator[tuple[Sandboxed, subprocess.Popen[bytes]]]:
    """Run a program in a sandbox; give the processes of its namespace once it has said a word."""
    command = ["bwrap", "--unshare-pid", "--ro-bind", "/", "/", "--dev", "/dev", "--proc", "/proc"]
    info, info_end = os.pipe()
    with subprocess.Popen(
        [*command, "--info-fd", str(info_end), "--", sys.executable, "-c", program],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, pass_fds=[info_end],
    ) as running:  # fmt: skip
        os.close(info_end)
        with os.fdopen(info) as stream:
            init = int(json.load(stream)["child-pid"])
        try:
            assert running.stdout is not None
            running.stdout.readline()
            yield Sandboxed(init), running
        finally:
            running.kill()


CHILD = """
import os, sys, threading
if os.fork() == 0:
    open("/proc/self/comm", "w").write("hoard\\x1b[2J")
    files = [open(os.devnull) for _ in range(50)]
    for _ in range(10):
        threading.Thread(target=threading.Event().wait, daemon=True).start()
    os.setsid()
    print(flush=True)
sys.stdin.read()
"""


@needs_sandbox
def test_what_a_child_holds_counts_and_it_is_named() -> None:
    from autograder.processes.outside import process_usage

    with sandboxed(CHILD) as (processes, _):
        held = process_usage.measure_usage(processes)
        assert held.threads >= 12
        assert held.files >= 50
        numbers = [len(process_usage.thread_ids(folder)) for folder in processes.list_folders()]
        assert sum(numbers) == held.threads
        assert process_usage.process_names(processes, 2) == [repr("hoard\x1b[2J")]
        seen = processes.outer_pids()
        assert len(seen) == len(processes.inner_pids()) == 2
        assert sorted(map(number_inside, seen)) == sorted(processes.inner_pids())


@needs_sandbox
def test_a_sandbox_that_has_ended_is_never_taken_for_another() -> None:
    with sandboxed(CHILD) as (processes, running):
        pass
    running.wait()
    assert poll_condition(lambda: not processes.list_folders(), 10.0, Pulse())
    assert processes.outer_pids() == []


@pytest.mark.parametrize(
    ("what", "given"),
    [
        ("open", {"path": "/etc/passwd"}),
        (["rest"], {}),
        ("positions", {"file": "../gradebook.db"}),
        ("positions", {"file": "x" * 1000}),
        ("positions", {}),
        ("naps", {"threads": ["1; drop"]}),
        ("naps", {"threads": list(range(10**4))}),
        ("rest", {"restless": 0.1, "timeout": 1e9}),
        ("rest", {"restless": "long", "timeout": 1}),
        ("rest", {"restless": float("nan"), "timeout": 1}),
        ("kept", {"since": None}),
        ("lose", {"ports": []}),
        ("lose", {"ports": [70000]}),
        ("lose", {"ports": ["1 } accept; #"]}),
        ("lose", {"ports": [True]}),
    ],
)
def test_a_request_that_is_none_is_refused(what: Any, given: dict[str, Any]) -> None:
    scene = Here(os.getpid())._scene
    with pytest.raises(RequestError):
        warden_requests.answer_request(scene, what, given)


def test_a_network_that_others_use_loses_nothing() -> None:
    with pytest.raises(CannotLoseError):
        Here(os.getpid()).ask("lose", ports=[1])


def verdict_of(**changes: Any) -> dict[str, Any]:
    check = {
        "name": "start", "title": "Nodes start", "status": "passed", "points": 1.0,
        "max_points": 1.0, "hints": [],
    }  # fmt: skip
    verdict = {"exam": "qos", "part": "visible", "version": 1, "checks": [check], "notes": [],
               "seed": 0}  # fmt: skip
    check.update({name: value for name, value in changes.items() if name in check})
    verdict.update({name: value for name, value in changes.items() if name in verdict})
    return verdict


@pytest.mark.parametrize(
    "changes",
    [
        {"exam": "safety"},
        {"part": "hidden"},
        {"name": "another"},
        {"max_points": 100.0, "points": 100.0},
        {"points": 0.5},
        {"status": "failed"},
        {"title": "x" * 20_000},
        {"title": ["no", "text"]},
        {"hints": ["one"] * 2000},
        {"notes": ["x" * 20_000]},
        {"checks": []},
        {"checks": [verdict_of()["checks"][0]] * 2},
    ],
)
def test_a_verdict_on_something_else_is_none(changes: dict[str, Any]) -> None:
    with pytest.raises(VerdictError):
        Verdict.from_data(verdict_of(**changes)).require_asked("qos", "visible", {"start": 1.0})


def test_a_verdict_on_what_was_asked_is_one() -> None:
    Verdict.from_data(verdict_of()).require_asked("qos", "visible", {"start": 1.0})
