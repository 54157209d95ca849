"""The same jobs on a Dask cluster: several machines, Slurm, Kubernetes.

What travels is JSON both ways, and the course root never does: a worker gets a program and its
files, runs them in a sandbox of its own machine, and sends the outcome back. Dask itself speaks
pickle between its processes, which no submission can reach.
"""

from __future__ import annotations

import itertools
import json
import logging
import socket
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, Self
from urllib.parse import urlsplit

from autograder.running import grading_jobs
from autograder.running.grading_jobs import GradingJob, JobResult
from autograder.running.resource_errors import is_temporary
from autograder.running.workers.local_workers import Done, Keep, Queue
from autograder.sandbox import Abilities
from autograder.util import exercise_folders
from course.errors import CourseError

REACH_TIMEOUT_S = 10.0
"""Seconds in which a scheduler's machine must take a connection."""

CONNECT_TIMEOUT_S = 60.0
"""Seconds in which the scheduler must then answer; a busy one takes a while."""

RETRIES = 3
"""How often a job whose worker is closed begins anew."""

CLOSE_TIMEOUT_S = 10.0
"""Seconds that saying good-bye may take."""

MAX_RESULT = 2 * grading_jobs.MAX_OUTCOME_CHARS + 1024
"""Largest result in characters that is read: a result quotes the outcome's JSON as a string."""

EXTRA = "pip install 'ros2-course[cluster]'"


class ClusterError(CourseError):
    """The cluster cannot be used; the message says why and what to do."""


def perform_job(text: str, hidden: list[str]) -> str:
    """Run a job on a worker; returns its result as JSON, or says why there is none.

    Args:
        text: the job (see `GradingJob.to_json`).
        hidden: folders that a submission must not see, should they be here, too.

    Returns:
        ``{"result": ...}`` or ``{"problem": a phrase, "where": host name}``, as JSON.

    Raises:
        SandboxStartError, ZygoteError: there is none just now; a moment later there may be.
    """
    from distributed import Status, get_worker

    try:
        result = grading_jobs.run(GradingJob.from_json(text), [Path(folder) for folder in hidden])
    except CourseError as error:
        if is_temporary(error):
            raise
        return json.dumps({"problem": str(error), "where": socket.gethostname()})
    if get_worker().status not in (Status.running, Status.paused):
        # A queue that takes its machine back ends a submission's processes, too: what is then
        # seen is not the submission's doing, and another worker starts it again.
        raise RuntimeError("the worker is being closed")
    return json.dumps({"result": result.to_json()})


class Cluster:
    """The workers of a Dask scheduler."""

    def __init__(
        self,
        address: str,
        keep: Keep,
        *,
        trust: bool,
        hidden: Iterable[Path],
        say: Callable[[str], None],
    ) -> None:
        """Connect to the scheduler at ``address``, as in ``tcp://host:8786``.

        Args:
            address: the scheduler's.
            keep: is told each result.
            trust: run submissions outside of a sandbox.
            hidden: folders that they must not see, should a worker's machine have them.
            say: is told when there is no worker.

        Raises:
            ClusterError: it does not answer, or Dask is not installed.
        """
        self._address = address
        self._keep = keep
        self._hidden = [str(folder) for folder in hidden]
        self._say = say
        self._queue = Queue()
        self._futures: dict[str, Any] = {}
        self._jobs: dict[str, GradingJob] = {}
        self._lonely = False
        self._numbers = itertools.count()
        self._client = _connect_client(address)
        self.wake = self._queue.wake
        possible = [Abilities(loss=True).mode_name(trust=trust), Abilities().mode_name(trust=trust)]
        self.modes = tuple(dict.fromkeys(possible))

    def job_capacity(self) -> int:
        """Return how many jobs may be with the scheduler: some wait, so that no worker does."""
        return 2 * self._count_threads() + 4

    def submit(self, key: str, job: GradingJob) -> None:
        """Send a job.

        Raises:
            ClusterError: the scheduler is gone, or the job has an exam that only this machine has.
        """
        if own := exercise_folders.current_exercises().own.intersection(job.exam_names):
            raise ClusterError(
                f"The exercise '{min(own)}' is the course's own, and workers have only those of "
                "ros2-course: grade without --scheduler."
            )
        try:
            # Again if a worker is closed in the middle; Dask sees to those that die.
            future = self._client.submit(
                perform_job,
                job.to_json(),
                self._hidden,
                pure=False,
                retries=RETRIES,
                # Dask takes a job of a name that it has met for that one, done as it may be.
                key=f"{'-'.join(job.exam_names)}-{key}-{next(self._numbers)}",
            )
        except Exception as error:
            raise self._scheduler_lost() from error
        self._futures[key], self._jobs[key] = future, job
        future.add_done_callback(lambda _: self._queue.put(Done(key)))

    def wait(self) -> list[Done]:
        """Return what is done, as `Workers.wait` says.

        Raises:
            ClusterError: the scheduler is gone, or a worker cannot do the work.
        """
        done = [self._take_result(item.key) for item in self._queue.wait()]
        if not done:
            if self._client.status != "running":
                raise self._scheduler_lost()
            self._note_workers()
        return done

    def _take_result(self, key: str) -> Done:
        future, job = self._futures.pop(key), self._jobs.pop(key)
        if future.cancelled():
            raise self._scheduler_lost()
        if (error := future.exception()) is not None:
            return Done(key, error=error)
        result = self._read_result(future.result())
        self._keep(job, result)
        return Done(key, result)

    def _read_result(self, text: Any) -> JobResult:
        if not isinstance(text, str) or len(text) > MAX_RESULT:
            raise ClusterError(f"A worker of {self._address} sent no result of bounded size.")
        data = json.loads(text)
        if "problem" in data:
            raise ClusterError(
                f"The worker on {data['where']} cannot grade: {data['problem']}. What was graded "
                "so far is kept."
            )
        return JobResult.from_json(data["result"])

    def _count_threads(self) -> int:
        with suppress(Exception):
            return sum(self._client.nthreads().values())
        raise self._scheduler_lost()

    def _note_workers(self) -> None:
        lonely = self._count_threads() == 0
        if lonely and not self._lonely:
            self._say(
                f"The scheduler at {self._address} has no worker yet: start some with "
                f"`dask worker {self._address}`; the jobs wait for them."
            )
        self._lonely = lonely

    def _scheduler_lost(self) -> ClusterError:
        return ClusterError(
            f"The scheduler at {self._address} went away: start it again and run the same command "
            "again; what was graded so far is kept."
        )

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Take back what is not done, and disconnect."""
        with suppress(Exception):
            self._client.cancel(list(self._futures.values()), force=True)
        with suppress(Exception):
            self._client.close(timeout=CLOSE_TIMEOUT_S)


def _connect_client(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError:
        raise ClusterError(
            f"--scheduler needs Dask, which is not installed here: install it with `{EXTRA}`."
        ) from None
    _silence_logs()
    try:
        _reach_scheduler(address)
        return Client(  # type: ignore[no-untyped-call]
            address,
            timeout=CONNECT_TIMEOUT_S,
            set_as_default=False,
            name="autograder",
            direct_to_workers=False,
        )
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterError(
            f"There is no scheduler at {address} ({_first_line(error)}): start one with "
            "`dask scheduler`, or mend the address; nothing was graded."
        ) from None


def _silence_logs() -> None:
    """Keep Dask's own log off the screen: what matters of it is said in a sentence."""
    for name in ["distributed", *logging.root.manager.loggerDict]:
        if name.split(".")[0] == "distributed":  # several have a level of their own
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def _reach_scheduler(address: str) -> None:
    """Connect once by ourselves: Dask goes on trying for long where nobody listens.

    Raises:
        ClusterError: it is no address.
        OSError: nobody takes the connection.
    """
    url = urlsplit(address)
    if url.scheme not in ("tcp", "tls") or not url.hostname or not url.port:
        raise ClusterError(
            f"'{address}' is no address of a scheduler: write it as it prints it, for example "
            "tcp://192.168.1.10:8786."
        )
    socket.create_connection((url.hostname, url.port), REACH_TIMEOUT_S).close()


def _first_line(error: BaseException) -> str:
    text = str(error).strip() or type(error).__name__
    return text.splitlines()[0][:160]
