"""The same grades from a Dask cluster: real schedulers and workers, and some that are killed."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest

from autograder.examination.program import Cell
from autograder.running import grading_jobs
from autograder.running.grading_jobs import GradingJob, JobError, JobResult
from autograder.running.runner import Outcome
from tests.autograder.conftest import ASSIGNMENT, Undisturbed
from tests.browser.lab import until
from tests.killing import GONE, Engine, fresh_copy
from tests.machine import needs_sandbox

pytestmark = [needs_sandbox, pytest.mark.xdist_group("class"), pytest.mark.timeout(900)]

PATIENCE = 300.0
"""Seconds until something must have happened that takes a few on a machine that is idle."""

DASK = [sys.executable, "-c", "from dask.__main__ import main; main()"]


@dataclass
class Cluster:
    """A scheduler, and workers with one thread each."""

    address: str
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]]


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    with ExitStack() as stack:

        def start(*arguments: str) -> subprocess.Popen[bytes]:
            log = stack.enter_context((tmp_path / f"{arguments[0]}.log").open("ab"))
            process = subprocess.Popen(
                [*DASK, *arguments, "--no-dashboard"], stdout=log, stderr=log
            )
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        file = tmp_path / "scheduler.json"
        scheduler = start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file)
        )
        wait_for(lambda: file.is_file() and file.read_text().endswith("}"), "the scheduler")
        address = json.loads(file.read_text())["address"]
        workers = [
            start(
                "worker", address, "--nthreads", "1", "--no-nanny", "--name", name,
                "--local-directory", str(tmp_path / name),
            )
            for name in ("ada", "grace")
        ]  # fmt: skip
        yield Cluster(address, scheduler, workers)


def wait_for(condition: Callable[[], object], what: str) -> None:
    until(condition, PATIENCE, lambda: f"waited for {what} in vain")


def children(process: subprocess.Popen[bytes]) -> list[psutil.Process]:
    """Return a worker's examiners and subjects, and what they run in."""
    return [child for child in psutil.Process(process.pid).children(recursive=True) if ours(child)]


def ours(process: psutil.Process) -> bool:
    """Whether it was started for a job: Dask starts programs of its own before it has any."""
    try:
        command = " ".join(process.cmdline())
    except psutil.Error:  # it has just ended
        return False
    return "autograder" in command or "bwrap" in command


Work = tuple[subprocess.Popen[bytes], list[psutil.Process]]


def wait_for_work(engine: subprocess.Popen[str], cluster: Cluster) -> Work:
    """Wait until a worker has begun; return it, and what it has started."""
    found: list[Work] = []

    def begun() -> bool:
        # Kept as seen: what a worker tries before its first job is over a moment later.
        found[:] = [(worker, busy) for worker in cluster.workers if (busy := children(worker))]
        return bool(found) or engine.poll() is not None

    wait_for(begun, "a worker at work")
    assert found, "the engine ended before any worker began"
    return found[0]


def engine_of(class_: Undisturbed, tmp_path: Path, address: str) -> Engine:
    root = fresh_copy(class_.ungraded, tmp_path / "course")
    return Engine(root, ASSIGNMENT, tmp_path / "scratch", ("--scheduler", address))


def test_a_worker_that_is_killed_changes_no_grade(
    class_: Undisturbed, tmp_path: Path, cluster: Cluster
) -> None:
    engine = engine_of(class_, tmp_path, cluster.address)
    with engine.start() as process:
        victim, started = wait_for_work(process, cluster)
        victim.send_signal(signal.SIGKILL)
        said, complaint = process.communicate()
    assert process.returncode == 0, complaint
    assert engine.grades() == class_.grades, said
    _, alive = psutil.wait_procs(started, timeout=GONE)
    assert not alive, "a dead worker leaves nothing running"
    assert "4 submissions have not changed" in engine.finish()


def test_a_scheduler_that_goes_away_is_one_sentence(
    class_: Undisturbed, tmp_path: Path, cluster: Cluster
) -> None:
    engine = engine_of(class_, tmp_path, cluster.address)
    with engine.start() as process:
        wait_for_work(process, cluster)
        cluster.scheduler.send_signal(signal.SIGKILL)
        _, complaint = process.communicate()
    assert process.returncode == 1
    assert "went away" in complaint
    assert len(complaint.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("address", "says"),
    [("tcp://127.0.0.1:{closed}", "There is no scheduler at"), ("10.0.0.1", "no address of a")],
)
def test_a_scheduler_that_is_not_there_is_one_sentence(
    class_: Undisturbed, tmp_path: Path, address: str, says: str
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        closed = server.getsockname()[1]
    engine = engine_of(class_, tmp_path, address.format(closed=closed))
    with engine.start() as process:
        _, complaint = process.communicate()
    assert process.returncode == 1
    assert says in complaint
    assert len(complaint.strip().splitlines()) == 1
    assert engine.grades() == {}


def test_a_job_survives_the_journey() -> None:
    job = GradingJob(
        (Cell("x = 1"), Cell("", "qos-visible", "qos", "visible", {"a": 1})), {"f": b"\0"}
    )
    assert GradingJob.from_json(job.to_json()) == job
    other = job.to_json().replace(job.code_digest, "0" * 64)
    with pytest.raises(JobError, match="another version"):
        GradingJob.from_json(other)


def test_an_outcome_is_bounded() -> None:
    stream = {
        "output_type": "stream",
        "name": "stdout",
        "text": "x" * grading_jobs.MAX_OUTCOME_CHARS,
    }
    outcome = grading_jobs.bounded_outcome(Outcome([[stream], []], notes=["a note"]))
    assert outcome.outputs == [[], []]
    assert outcome.notes[0] == "a note"
    assert "left out" in outcome.notes[1]
    result = JobResult(outcome, "sandboxed")
    assert JobResult.from_json(result.to_json()) == result
