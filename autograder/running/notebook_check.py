"""What a student calls: ``check("qos")`` in a notebook cell."""

from __future__ import annotations

import inspect
import os
import signal
import socket
import threading
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from autograder import exercises
from autograder.examination.subject.server import SubjectServer
from autograder.examination.subject.student_errors import SUBJECT_ENV
from autograder.examination.verdict import Verdict
from autograder.processes.channel import Channel
from autograder.running.live_report import LiveReport
from autograder.running.start import ExaminerProcess
from autograder.sandbox.confinement.environment_variables import PROFILE
from autograder.util import exercise_folders
from course.errors import CourseError
from course.runtime.core_session import CoreSession
from course.runtime.domains.leases import lease_domain
from course.workspace.journal.journal_file import JournalError, journal_here

STUCK_AFTER_S = 3.0
"""Seconds after a verdict in which the student's node must have been stopped."""


def check(
    exam: str, part: str = "visible", *, hint: int = 1, key: Mapping[str, Any] | None = None
) -> float:
    """Examine this notebook's nodes by what they do, show a report, and return the points.

    The exams of a course's own lie in the folder ``exercises`` beside the notebook.

    An examiner process joins a DDS domain of its own with this kernel, asks for nodes of the
    classes that the notebook defines, and watches them. A check that cannot be made in a kernel (a
    lossy network takes a namespace) is shown as not examined, and its points are in the number that
    is returned: a notebook that is right must not look wrong. Grades do not come from here.

    Args:
        exam: the name of the exam, such as ``"qos"``.
        part: which of its parts; ``"visible"`` is the one for students.
        hint: how many of a failed check's hints to show, from a nudge to nearly the answer.
        key: the answer key of a part that has one; it stands in a hidden cell of the source.

    Raises:
        ExamError: no such exam or part; the message names the ones there are.
    """
    namespace = _caller_globals()
    if SUBJECT_ENV in os.environ:
        return 0.0  # the real examiner is at work outside this process
    if exam not in exercise_folders.packaged_names():
        exercise_folders.use_course(
            Path.cwd()
        )  # it may have changed, or be another folder's by now
    exercises.load_exam(exam).part(part)
    live = LiveReport(exam, part, hint)
    try:
        verdict = examine_part(exam, part, namespace, key, live)
    except BaseException:
        live.stop()
        raise
    live.finish(_note_checks(verdict))
    return float(verdict.score + verdict.unexamined_points)


def examine_part(
    exam: str, part: str, namespace: Mapping[str, Any], key: Mapping[str, Any] | None,
    live: LiveReport,
) -> Verdict:  # fmt: skip
    """Sit one part of an exam on the classes of ``namespace``, in sessions made for it.

    ``live`` shows each result as soon as it is known.

    Call it from the main thread: what hangs in the student's code is interrupted there.

    Raises:
        ExaminerError: the examiner failed.
    """
    lease = lease_domain()

    def open_session(threads: int, sim_time: bool) -> CoreSession:
        return CoreSession(domain_id=lease.domain_id, threads=threads, sim_time=sim_time)

    try:
        ours, theirs = socket.socketpair()
        course = exercise_folders.current_exercises().root
        environment = {**PROFILE, **os.environ}  # else each new session is found after 0 to 3 s
        with (
            ours,
            ExaminerProcess(theirs, lease.domain_id, env=environment, course=course) as examiner,
        ):
            channel = Channel(ours)
            examiner.request(exam, [(part, key or {})], pid=os.getpid(), follows=True)
            sitting = _Sitting(examiner)
            try:
                sitting.serve(SubjectServer(open_session, namespace, live.show_progress), channel)
            finally:
                channel.close()
            return sitting.await_verdict()
    finally:
        lease.release()


class _Sitting:
    """Serves the examiner in the main thread while another thread waits for the verdict.

    So a constructor that never returns can be interrupted when the examiner has given up on it,
    what constructors print lands in the cell, and a learner's own interrupt works as always.
    """

    def __init__(self, examiner: ExaminerProcess) -> None:
        self._examiner = examiner
        self._verdict: Verdict | None = None
        self._error: CourseError | None = None
        self._served = threading.Event()
        self._lock = threading.Lock()
        self._waiter = threading.Thread(target=self._watch_examiner, daemon=True)

    def serve(self, server: SubjectServer, channel: Channel) -> None:
        self._waiter.start()
        try:
            server.serve(channel)
            with self._lock:
                self._served.set()
        except KeyboardInterrupt:
            if self._verdict is None and self._error is None:
                raise

    def await_verdict(self) -> Verdict:
        self._waiter.join()
        if self._verdict is None:
            assert self._error is not None
            raise self._error
        return self._verdict

    def _watch_examiner(self) -> None:
        try:
            self._verdict = self._examiner.verdict()
        except CourseError as error:
            self._error = error
        if not self._served.wait(STUCK_AFTER_S):
            with self._lock:
                if not self._served.is_set():
                    self._interrupt_main()

    def _interrupt_main(self) -> None:
        """Interrupt the main thread, which is still busy with the student's code."""
        main = threading.main_thread().ident
        assert main is not None
        signal.pthread_kill(main, signal.SIGINT)


def _note_checks(verdict: Verdict) -> Verdict:
    """Note a student's visible checks in the journal of the working copy, if this is in one."""
    journal = journal_here()
    if journal is None or verdict.part != "visible":
        return verdict
    passed = [check.title for check in verdict.checks if check.passed]
    left = [c.title for c in verdict.checks if not c.passed and c.status != "not_examined"]
    try:
        journal.record_checks(verdict.exam, verdict.score, verdict.max_score, passed, left)
    except JournalError as error:
        return replace(verdict, notes=(*verdict.notes, str(error)))
    return verdict


def _caller_globals() -> Mapping[str, Any]:
    """Return the globals of the code that called `check`: in a notebook, its namespace."""
    frame = inspect.currentframe()
    assert frame is not None
    assert frame.f_back is not None
    assert frame.f_back.f_back is not None
    return frame.f_back.f_back.f_globals
