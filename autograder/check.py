"""The student's door: ``check("qos")`` in a notebook cell."""

from __future__ import annotations

import inspect
import os
import socket
import threading
from collections.abc import Mapping
from typing import Any

from autograder import exams
from autograder.harness import SUBJECT_ENV, Harness
from autograder.processes import ExaminerProcess
from autograder.report import Report
from autograder.verdict import Verdict
from autograder.wire import Channel
from course import Session


def check(exam: str, part: str = "visible", *, hint: int = 1) -> float:
    """Examine this notebook's nodes by what they do, show a report, and return the points.

    An examiner process joins a DDS domain of its own with this kernel, asks for nodes of the
    classes that the notebook defines, and watches them.

    Args:
        exam: the name of the exam, such as ``"qos"``.
        part: which of its parts; ``"visible"`` is the one for students.
        hint: how many of a failed check's hints to show, from a nudge to nearly the answer.

    Raises:
        ExamError: no such exam or part; the message names the ones there are.
    """
    namespace = _caller_globals()
    exams.load(exam).part(part)
    if SUBJECT_ENV in os.environ:
        return 0.0  # the real examiner is at work outside this process
    verdict = examine(exam, part, namespace)
    _show(Report(verdict, hints=hint))
    return float(verdict.score)


def examine(exam: str, part: str, namespace: Mapping[str, Any]) -> Verdict:
    """Sit one part of an exam on the classes of ``namespace``, in a session made for it."""
    ours, theirs = socket.socketpair()
    channel = Channel(ours)
    with Session() as session, ExaminerProcess(theirs, session.domain_id) as examiner:
        # A constructor that never returns must not hold the cell: the examiner gives up on it
        # and the verdict still arrives here.
        harness = Harness(session, namespace)
        thread = threading.Thread(target=harness.serve, args=(channel,), daemon=True)
        thread.start()
        examiner.request(exam, part)
        try:
            return examiner.verdict()
        finally:
            thread.join(timeout=5)
            channel.close()


def _caller_globals() -> Mapping[str, Any]:
    """Return the globals of whoever called `check`: in a notebook, its namespace."""
    frame = inspect.currentframe()
    assert frame is not None
    assert frame.f_back is not None
    assert frame.f_back.f_back is not None
    return frame.f_back.f_back.f_globals


def _show(report: Report) -> None:
    try:
        from IPython.core.getipython import get_ipython
    except ImportError:
        shell = None
    else:
        shell = get_ipython()
    if shell is None:
        print(report)  # noqa: T201 - outside a notebook, the terminal is where a report goes
    else:
        from IPython.display import display

        display(report)  # type: ignore[no-untyped-call]
