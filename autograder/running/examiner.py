"""The examiner process: sits exams on a subject that it can only see over DDS.

Started as ``python -P -m autograder.running.examiner --control FD --domain N``. It reads requests
``{"exam": ..., "parts": [[NAME, KEY], ...], "pid": ..., "seed": ..., "last": ..., "follows": ...}``
from standard input, one JSON object a line, and writes for each part
``{"verdict": ..., "hangs": ...}`` to standard output; ``hangs`` says why the subject cannot be
expected to go on, if so. ``KEY`` is the answer key of the part's hidden cell, ``pid`` the subject's
process, ``seed`` what the exam's numbers are drawn from, ``last`` that nothing of the notebook runs
after it, ``follows`` that the subject is to be told of each check before it is made, with the
results so far.
File descriptor ``FD`` is the control channel to the subject's `SubjectServer`. In a sandbox it also
has ``--outside FD``, its channel to a warden (`autograder.processes.outside`), and is alone with
the subject on their network.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

from autograder import exercises
from autograder.examination import points
from autograder.examination.check_context import (
    MAX_REPLY_BYTES,
    CheckContext,
    StudentError,
    Subject,
    SubjectGone,
)
from autograder.examination.exam import Part
from autograder.examination.plain_programs import Programs
from autograder.examination.subject import hang_report
from autograder.examination.verdict import Progress, Verdict
from autograder.processes.channel import Channel
from autograder.processes.outside.asking import Afar, Here, Outside
from autograder.util import exercise_folders
from course.errors import CourseError
from course.runtime.core_session import CoreSession


def sit(
    request: dict[str, Any],
    session: CoreSession,
    subject: Subject,
    outside: Outside,
    programs: Programs | None = None,
    follow: Callable[[Progress], object] = lambda _: None,
) -> Iterator[Verdict]:
    """Run parts of an exam, yield a verdict a part, and let the subject go on.

    ``follow`` is told of each check before it is made.

    In a sandbox in which nothing goes on, nodes on either side are not taken down one by one, which
    takes as long as some checks: they end with the sandbox.
    """
    ends = bool(request["last"]) and outside.own_network
    subject.delay = outside.delay
    try:
        bench = CheckContext(session, subject, outside, int(request["seed"]), programs, ends)
        exam = exercises.load_exam(request["exam"])
        parts = [Part(name, key) for name, key in request["parts"]]
        for verdict in exam.sit(parts, bench, follow):
            yield replace(verdict, seed=bench.draws.seed)
    finally:
        if not ends:
            subject.release()


def serve_requests(
    requests: TextIO,
    answers: TextIO,
    session: CoreSession,
    subject: Subject,
    outside: Outside | None = None,
) -> None:
    """Answer requests until standard input ends; without ``outside``, look at the subject here."""
    while line := requests.readline():
        request = json.loads(line)
        outside = outside or Here(int(request["pid"]))
        # In a student's own notebook there is only the kernel's process.
        programs = Programs(requests, answers, outside) if outside.own_network else None

        def write(answer: dict[str, Any]) -> None:
            answers.write(json.dumps(answer) + "\n")
            answers.flush()

        def show(progress: Progress) -> None:
            with suppress(SubjectGone, StudentError):  # the checks find out for themselves
                subject.show(progress)

        told = [show] if request["follows"] else []
        for verdict in sit(request, session, subject, outside, programs, *told):
            write({"verdict": verdict.as_data(), "hangs": subject.hangs})


def preload() -> None:
    """Import every exam: `autograder.sandbox.prefork` calls it before it forks examiners."""
    from autograder.processes.outside import warden  # noqa: F401 - forked from the same process
    from autograder.sandbox.prefork import modules

    modules.import_all()
    for name in exercises.exercise_names():
        with suppress(CourseError):  # one that is being written keeps nobody from the others
            exercises.load_exam(name)
    with suppress(CourseError):
        points.table()  # read once, and not in each fork


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the process; returns its exit code."""
    parser = argparse.ArgumentParser(prog="autograder.running.examiner")
    parser.add_argument("--control", type=int, required=True, help="file descriptor of the channel")
    parser.add_argument("--domain", type=int, required=True, help="the subject's domain id")
    parser.add_argument("--outside", type=int, help="file descriptor of the channel to a warden")
    parser.add_argument("--course", type=Path, help="a course root with exams of its own")
    options = parser.parse_args(arguments)
    if options.course is not None:
        exercise_folders.use_course(options.course)
    # Verdicts go out over a private copy of standard output: whatever a library prints must not
    # end up among them.
    verdicts = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    hang_report.tell_when_asked(sys.stderr.fileno())
    subject = Subject(Channel(socket.socket(fileno=options.control), MAX_REPLY_BYTES))
    outside = None
    if options.outside is not None:
        outside = Afar(socket.socket(fileno=options.outside))
    with CoreSession(domain_id=options.domain) as session:
        session.explains = False  # it asks whether something comes, and says itself what it means
        serve_requests(sys.stdin, verdicts, session, subject, outside)
        if outside is not None:
            os._exit(0)  # in its sandbox nobody is left who would have to hear that it goes
    return 0


if __name__ == "__main__":
    sys.exit(main())
