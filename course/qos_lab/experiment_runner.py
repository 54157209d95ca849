"""Running experiments from a kernel: in processes of their own, with a deadline."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

from course.errors import CourseError
from course.qos_lab import link
from course.qos_lab.experiment import LOSSY, SCENARIOS, Experiment, ExperimentOutcome
from course.runtime.domains.leases import lease_domain

TIMEOUT_S = 240.0

ENDED = "This QoS lab has ended, and its experiment with it: run its cell again."


class ExperimentError(CourseError):
    """An experiment that cannot be run; the message says why."""


class ExperimentProcesses:
    """The processes of the experiments that run now. Thread-safe."""

    def __init__(self) -> None:
        """Have none yet."""
        self.ended = False
        self._running: set[subprocess.Popen[str]] = set()
        self._lock = threading.Lock()

    def end(self) -> None:
        """Kill those that run, and let no other one start. Idempotent."""
        with self._lock:
            self.ended = True
            for process in self._running:
                _kill_group(process)

    @contextlib.contextmanager
    def start(
        self, command: list[str], environment: dict[str, str]
    ) -> Iterator[subprocess.Popen[str]]:
        """Give a process, in a group of its own with what it starts; none outlives the block."""
        with self._lock:
            if self.ended:
                raise ExperimentError(ENDED)
            process = subprocess.Popen(
                command, env=environment, text=True, start_new_session=True,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            )  # fmt: skip
            self._running.add(process)
        with process:
            try:
                yield process
            finally:
                with self._lock:
                    self._running.discard(process)
                    _kill_group(process)


def _kill_group(process: subprocess.Popen[str]) -> None:
    """Kill a process with its group, unless it has ended of itself."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)


def run_experiment(
    experiment: Experiment, processes: ExperimentProcesses | None = None
) -> ExperimentOutcome:
    """Run ``experiment`` and return what was seen; about two seconds, or longer with a loss.

    Args:
        experiment: what to run.
        processes: where its processes are kept meanwhile, for somebody else to end them.

    Raises:
        ExperimentError: no such scenario, a loss that is not 0 to 90 %, its processes failed, or
            they were ended.
    """
    processes = processes or ExperimentProcesses()
    if experiment.scenario not in SCENARIOS:
        raise ExperimentError(
            f"There is no scenario {experiment.scenario!r}: choose {', '.join(SCENARIOS)}."
        )
    loss: object = experiment.loss
    if not isinstance(loss, int) or not 0 <= loss <= 90:
        raise ExperimentError(
            f"A link loses 0 to 90 % of its packets, a whole number, not {loss!r}."
        )
    remark = _no_loss(experiment)
    lossy = bool(experiment.drop_percent and not remark)
    command = [sys.executable, "-m", "course.qos_lab.experiment_process"]
    lease = lease_domain()
    try:
        environment = _process_environment(lease.domain_id, lossy=lossy)
        command = [*link.ENTER, *command, "--link"] if lossy else command
        with processes.start(command, environment) as process:
            said, complaints = process.communicate(experiment.to_json() + "\n", TIMEOUT_S)
    except subprocess.TimeoutExpired:
        raise ExperimentError(f"The experiment did not end within {TIMEOUT_S:.0f} s.") from None
    finally:
        lease.release()
    if processes.ended:
        raise ExperimentError(ENDED)
    lines = said.strip().splitlines()
    if process.returncode or not lines:
        reason = (complaints.strip().splitlines() or ["no reason was given"])[-1]
        raise ExperimentError(f"The experiment's processes failed: {reason}")
    outcome = ExperimentOutcome.from_json(lines[-1])
    outcome.remark = remark
    return outcome


def _no_loss(experiment: Experiment) -> str:
    """Return why the link loses nothing although it was to, as a sentence; empty if it does."""
    if experiment.loss and not experiment.drop_percent:
        return f"The link lost nothing here: it does so in {' and '.join(LOSSY)} only."
    return link.problem() if experiment.loss else ""


def _process_environment(domain_id: int, *, lossy: bool) -> dict[str, str]:
    environment = {
        **os.environ,
        "ROS_DOMAIN_ID": str(domain_id),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "RCUTILS_LOGGING_MIN_SEVERITY": "FATAL",
    }
    for name in ("ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY"):
        environment.pop(name, None)
    # Two processes on one host find each other at once only if they know where to look.
    environment["ROS_STATIC_PEERS"] = "127.0.0.1"
    return {**environment, **link.ENVIRONMENT} if lossy else environment
