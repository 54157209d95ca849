"""An examiner that a submission has taken over: what its process can reach, and what it can say.

It parses what a stranger's program sends over DDS. So here a program of the stranger's runs in its
place: started as an examiner is, cold and warm, in the examiner's sandbox, with its descriptors. At
worst it lies about the submission that took it.
"""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from autograder.examination import points
from autograder.examination.program import Cell
from autograder.running import runner, start
from autograder.running.runner import Outcome
from autograder.running.start import ExaminerError, ExaminerProcess
from autograder.sandbox import resource_limits, warm_starts
from autograder.sandbox.confinement import visible_files
from autograder.sandbox.prefork.fork_request import ForkRequest
from autograder.sandbox.resource_limits import MIB, Limits
from tests.machine import needs_isolation, needs_warm_starts

EXAMINED = (Cell("x = 1"), Cell("", "qos-visible", "qos", "visible"))
WORTH = points.of_part("qos", "visible")
STARTS = [False, pytest.param(True, marks=needs_warm_starts)]
GRADES = "gradebook-of-a-hostile-course.db"

VERDICT = """
import json, os, sys

def verdict(*notes, **changes):
    checks = [
        {"name": name, "title": "Taken", "status": "passed", "points": worth, "max_points": worth,
         "hints": []}
        for name, worth in WORTH.items()
    ]
    found = {"exam": "qos", "part": "visible", "version": 1, "checks": checks, "notes": notes,
             "seed": 1, **changes}
    return json.dumps({"verdict": found, "hangs": ""})

def write(text):
    rest = text.encode() if isinstance(text, str) else text
    while rest:
        rest = rest[os.write(1, rest):]
""".replace("WORTH", repr(WORTH))

LOOKS = """
import mmap, resource, socket, threading

def tries(what):
    try:
        return repr(what())
    except Exception as error:
        return type(error).__name__

def threads():
    started, never = 0, threading.Event()
    threading.stack_size(65536)
    try:
        while started < 2000:
            threading.Thread(target=never.wait, daemon=True).start()
            started += 1
    except RuntimeError:
        return started

def scratch(place):
    written = 0
    try:
        with open(f"{place}/filled", "wb") as file:
            while True:
                written += os.write(file.fileno(), bytes(2**20))
    except OSError:
        return written

def seen():
    for folder, folders, names in os.walk("/"):
        folders[:] = [n for n in folders if os.path.join(folder, n) not in LARGE]
        if GRADES in names:
            yield folder

def local():
    with socket.socket(socket.AF_UNIX) as caller:
        caller.connect(f"\\0ros2-course-taken-{PORT}")

def asks(*requests):
    warden = socket.socket(fileno=int(sys.argv[sys.argv.index("--outside") + 1]))
    warden.settimeout(30)
    replies = warden.makefile("rb")
    answers = []
    for request in requests:
        warden.sendall(request.encode() + b"\\n")
        answers.append(list(json.loads(replies.readline())))
    try:
        warden.sendall(b"x" * 200_000)
        return answers, replies.readline() == b""
    except OSError:
        return answers, True

request = json.loads(sys.stdin.readline())
mounts = [line.split() for line in open("/proc/self/mountinfo")]
found = {
    "writable": [mount[4] for mount in mounts if "rw" in mount[5].split(",")],
    "written": [tries(lambda: open(place, "ab")) for place in PLACES],
    "made": [tries(lambda: open(os.path.dirname(place) + "/mine", "wb")) for place in PLACES],
    "root": tries(lambda: os.listdir(ROOT)),
    "seen": [*seen()],
    "kept": sorted(os.environ),
    "networks": [name for _, name in socket.if_nameindex()],
    "calls": [
        tries(lambda: socket.create_connection(("127.0.0.1", PORT), 5)), tries(local),
        tries(lambda: socket.create_connection(("192.0.2.1", 80), 5)),
        tries(lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW)),
        tries(lambda: socket.socket(40, socket.SOCK_STREAM)),
    ],
    "processes": len([name for name in os.listdir("/proc") if name.isdecimal()]),
    "of the first": tries(lambda: os.listdir(f"/proc/1/root{ROOT}")),
    "user": os.getuid(),
    "limits": {name: resource.getrlimit(getattr(resource, name))[1] for name in LIMITS},
    "raised": tries(lambda: resource.setrlimit(resource.RLIMIT_DATA, (-1, -1))),
    "memory": tries(lambda: bytearray(4 << 30)),
    "shared": tries(lambda: mmap.mmap(-1, 2**20)),
    "file": tries(lambda: os.memfd_create("x")),
    "namespace": tries(lambda: os.unshare(0x10000000)) if hasattr(os, "unshare") else "OSError",
    "scratch": sum(map(scratch, SCRATCH)),
    "asked": asks(*REQUESTS),
    "threads": threads(),
}
write(verdict(json.dumps(found)) + "\\n")
os._exit(0)
"""

REQUESTS = [
    json.dumps(request) for request in [
        {"what": "usage"},
        {"what": "open", "path": "/etc/passwd"},
        {"what": ["usage"]},
        {"what": "positions", "file": "../gradebook.db"},
        {"what": "naps", "threads": [-1]},
        {"what": "rest", "restless": 10**400, "timeout": 1},
        {"what": "kept", "since": 10**400},
        {"what": "kept", "since": "1"},
        {"what": "lose", "ports": ["1 } accept; #"]},
        {"what": "hold", "pid": 1},
        {"what": "release"},
    ]
]  # fmt: skip
"""What a warden is asked for; the first and the last two are asked for by examiners, too."""

pytestmark = needs_isolation


def take(monkeypatch: pytest.MonkeyPatch, program: str, *, warm: bool) -> None:
    """Have a program run in the place of each examiner that is started from now on."""
    if not warm:
        command = [sys.executable, "-P", "-c", program]
        monkeypatch.setattr(start, "python_module", SimpleNamespace(command=lambda _: command))
        return

    def task(module: str, arguments: list[str], *rest: Any, **options: Any) -> ForkRequest:
        if module == warm_starts.EXAMINER:
            # A module of Python's own whose main() runs what it is given.
            line = f"import sys; sys.argv[1:] = {arguments!r}; exec({program!r}, {{}})"
            module, arguments = "timeit", ["-n1", "-r1", "--", line]
        return ForkRequest(module, arguments, *rest, **options)

    monkeypatch.setattr(warm_starts, "ForkRequest", task)


def examine(hidden: Sequence[Path] = ()) -> Outcome:
    return runner.run(EXAMINED, hidden=hidden)


@pytest.mark.parametrize("warm", STARTS)
def test_a_taken_examiner_reaches_nothing_and_lies_about_its_own_submission(
    warm: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / GRADES).write_text("grades")
    monkeypatch.setenv("SECRET_TOKEN", "secret")
    places = [__file__, runner.__file__, json.__file__, sys.executable, str(tmp_path / GRADES)]
    with socket.create_server(("127.0.0.1", 0)) as internet, socket.socket(socket.AF_UNIX) as local:
        port = internet.getsockname()[1]
        local.bind(f"\0ros2-course-taken-{port}")
        local.listen()
        names = {
            "PORT": port, "PLACES": places, "ROOT": str(tmp_path), "GRADES": GRADES,
            "REQUESTS": REQUESTS, "SCRATCH": list(map(str, visible_files.SCRATCH)),
            "LARGE": ["/usr", "/proc", sys.prefix, sys.base_prefix],
            "LIMITS": ["RLIMIT_DATA", "RLIMIT_NPROC", "RLIMIT_NOFILE", "RLIMIT_AS", "RLIMIT_CPU"],
        }  # fmt: skip
        given = "\n".join(f"{name} = {value!r}" for name, value in names.items())
        take(monkeypatch, f"{VERDICT}\n{given}\n{LOOKS}", warm=warm)
        outcome = examine([tmp_path])
        for listener in (internet, local):
            listener.setblocking(False)
            with pytest.raises(BlockingIOError):
                listener.accept()
    verdict = outcome.verdicts["qos-visible"]
    assert verdict.score == verdict.max_score, (
        verdict
    )  # of its own submission it says what it likes
    found = json.loads(verdict.notes[0])
    refused = {"OSError", "PermissionError", "FileNotFoundError"}

    scratch = {str(path) for path in visible_files.SCRATCH}
    assert all(p in scratch or p.startswith("/dev/") for p in found["writable"]), found["writable"]
    assert refused.issuperset([*found["written"], *found["made"]]), found
    assert (found["root"], found["seen"]) == ("FileNotFoundError", [])
    assert "SECRET_TOKEN" not in found["kept"]
    assert found["networks"] == ["lo"]
    assert {"OSError", "PermissionError", "ConnectionRefusedError"}.issuperset(found["calls"])
    assert found["processes"] < 10
    assert found["of the first"] in refused
    assert found["user"] != 0
    of_examiner = Limits.of_examiner().of_processes()
    for name, most in found["limits"].items():
        assert 0 < most <= of_examiner[name.removeprefix("RLIMIT_").lower()], name
    assert found["raised"] in ("ValueError", "PermissionError")
    assert found["memory"] == "MemoryError"
    assert refused.issuperset([found["shared"], found["file"], found["namespace"]])
    assert found["scratch"] <= 3 * Limits.of_examiner().scratch
    assert found["threads"] < Limits.of_examiner().tasks
    answers, closed = found["asked"]
    assert answers == [["answer"], *[["error"]] * 8, *[["answer"]] * 2], answers
    assert closed


FORK_BOMB = "import os\nwhile True:\n    os.fork()"
HOARD = """
import os, signal
for _ in range(5):
    if os.fork() == 0:
        held = bytearray(250 * 2**20)
        for place in range(0, len(held), 4096):
            held[place] = 1
        break
signal.pause()
"""


@pytest.mark.parametrize("warm", STARTS)
@pytest.mark.parametrize("program", [FORK_BOMB, HOARD], ids=["processes", "memory"])
def test_a_taken_examiner_that_uses_too_much_is_ended(
    program: str, warm: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        resource_limits, "EXAMINER_MEMORY", 1000 * MIB
    )  # more than one of them takes
    take(monkeypatch, program, warm=warm)
    began = time.monotonic()
    outcome = examine()
    assert outcome.has_grader_error
    assert time.monotonic() - began < 30  # of itself it would never have ended


def answers(program: str) -> ExaminerProcess:
    """Run a program that answers for an examiner which has been asked for a part."""

    def spawn(command: Sequence[str], **options: Any) -> subprocess.Popen[bytes]:
        return subprocess.Popen([sys.executable, "-c", f"{VERDICT}\n{program}"], **options)

    subject, control = socket.socketpair()
    with subject:
        examiner = ExaminerProcess(control, 1, spawn=spawn)
    examiner.request("qos", [("visible", {})], pid=1)
    return examiner


FORGED = {
    "nothing": "''",
    "a number": "'1'",
    "a word": "'\"wants\"'",
    "a list": "'[\"wants\"]'",
    "nothing in JSON": "'null'",
    "no text": "b'\\xff'",
    "nested deep": "'[' * 100_000",
    "an object nested deep": "'{\"a\":' * 100_000",
    "a huge number": "'9' * 100_000",
    "an endless line": "'x' * 2**22",
    "no hangs": "'{\"verdict\": {}}'",
    "another exam": "verdict(exam='safety')",
    "another part": "verdict(part='hidden')",
    "another version": "verdict(version=10**9)",
    "no checks": "verdict(checks=[])",
    "checks that are none": "verdict(checks=[1])",
    "no list of checks": "verdict(checks={'a': 1})",
    "an endless seed": "verdict(seed=float('inf'))",
    "a seed that is none": "verdict(seed=float('nan'))",
    "endless notes": "verdict(*['x'] * 5000)",
    "a long note": "verdict('x' * 20_000)",
    "all the points there are": "verdict().replace('\"points\": ', '\"points\": 1')",
    "points without end": 'verdict().replace(\'"points": \', \'"points": 1e999, "x": \')',
}


@pytest.mark.parametrize("forged", FORGED.values(), ids=FORGED.keys())
@pytest.mark.parametrize("asking", [True, False])
def test_what_is_no_verdict_is_one_sentence(forged: str, asking: bool) -> None:
    asked: Callable[[dict[str, Any]], dict[str, Any]] | None = (lambda _: {}) if asking else None
    text = f"told = {forged}\nwrite((told if isinstance(told, bytes) else told.encode()) + b'\\n')"
    with pytest.raises(ExaminerError) as raised, answers(text) as examiner:
        examiner.verdict(30, asked)
    assert len(str(raised.value)) < 2 * start.LAST_LINE


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ('while True:\n    write(\'{"wants": "interrupt"}\\n\')', "and gave no verdict"),
        (
            'while True:\n    write(\'{"wants": "end"}\\n\')\n    sys.stdin.readline()',
            "and gave no verdict",
        ),
        ("import signal\nsignal.pause()", "no verdict within 2 s"),
        ("write('x' * 1000)\nimport signal\nsignal.pause()", "no verdict within 2 s"),
        (
            "import time\nwhile True:\n    write('x')\n    time.sleep(0.02)",
            "no verdict within 2 s",
        ),
        ("sys.exit('x' * 10**5)", "without a verdict"),
    ],
)
def test_whoever_asks_or_waits_without_end_is_not_waited_for(program: str, said: str) -> None:
    def answer(request: dict[str, Any]) -> dict[str, Any]:
        return {"error": "there is no such request"}

    began = time.monotonic()
    with pytest.raises(ExaminerError, match=said) as raised, answers(program) as examiner:
        examiner.verdict(2.0, answer)
    assert len(str(raised.value)) < 2 * start.LAST_LINE
    assert time.monotonic() - began < 30
