"""Grade one program: a subject runs it, an examiner watches, an outcome comes back."""

from __future__ import annotations

import json
import re
import socket
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from itertools import takewhile
from pathlib import Path
from typing import Any

from autograder import sandbox
from autograder.examination.draws import fresh_seed
from autograder.examination.program import Program
from autograder.examination.subject import hang_report, outputs, own_interfaces
from autograder.examination.verdict import Status, Verdict
from autograder.processes.channel import Channel, ChannelBroken, ChannelClosed, ChannelTimeout
from autograder.running.program_host import ProgramHost, Start
from autograder.running.start import ExaminerError, ExaminerFloodedError, ExaminerProcess
from autograder.sandbox import Isolation, RunningSubject
from autograder.util import exercise_folders

CELL_TIMEOUT_S = 30.0
"""Seconds one cell of a submission may run, as in nbgrader."""

START_TIMEOUT_S = 60.0
"""Seconds until a subject must have started: it takes half a second on a machine that is idle."""

EXCESS_TIMEOUT_S = 1.0
"""Seconds in which a watch must have seen what is used: it counts sockets twice a second."""

NOT_RUN = {
    "output_type": "error", "ename": "NotRun", "evalue": "this cell was not run to its end",
    "traceback": ["NotRun: this cell was not run to its end"],
}  # fmt: skip
"""The output of a cell with a grade id that was not reached: nbgrader takes none for right."""

TOO_MUCH = "The notebook printed more than is kept, so some of its outputs were left out."

_CELL_NAME = re.compile(r"\d+-\d+\.py, (?=line \d+\)$)")
"""What Python calls a cell's code where it is no Python: it is a file of no student's."""

MOST_NOTES = 20
"""Remarks on cells that raised; a notebook may have a thousand."""

NO_FILES: Mapping[str, bytes] = {}


@dataclass
class Outcome:
    """What came of running one submission.

    ``outputs`` has one list of notebook outputs a code cell, in the program's order; ``verdicts``
    maps the grade id of an exam's cell to its verdict; ``notes`` are remarks for the student.
    ``seconds`` is wall time. ``unreadable`` says that there was nothing to run at all, ``begun``
    that some of the program has run: what comes of another run may then be the program's doing.
    """

    outputs: list[list[dict[str, Any]]] = field(default_factory=list)
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    seconds: float = 0.0
    unreadable: bool = False
    begun: bool = False

    @property
    def has_grader_error(self) -> bool:
        """Whether the grader itself failed somewhere."""
        return any(verdict.has_grader_error for verdict in self.verdicts.values())

    @property
    def may_be_tried_again(self) -> bool:
        """Whether the grader failed before anything of the program could have had it fail."""
        return self.has_grader_error and not self.begun

    def to_json(self) -> str:
        """Return the outcome as JSON."""
        verdicts = {name: verdict.as_data() for name, verdict in self.verdicts.items()}
        return json.dumps({**vars(self), "verdicts": verdicts}, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str) -> Outcome:
        """Read an outcome written by `to_json`; raises ValueError or VerdictError if it is none."""
        data = json.loads(text)
        verdicts = {name: Verdict.from_data(item) for name, item in data["verdicts"].items()}
        return cls(
            data["outputs"], verdicts, data["notes"], data["seconds"], data["unreadable"],
            data["begun"],
        )  # fmt: skip


def run(
    program: Program,
    files: Mapping[str, bytes] = NO_FILES,
    *,
    cell_timeout: float = CELL_TIMEOUT_S,
    trust: bool = False,
    hidden: Iterable[Path] = (),
    seed: int | None = None,
) -> Outcome:
    """Run a program in a subject of its own and have its exams sat; never raises for its sake.

    Args:
        program: the cells.
        files: what is put into the folder that it runs in, by relative path.
        cell_timeout: seconds that one cell may run.
        trust: run it outside of a sandbox, with the rights of this process.
        hidden: folders that a sandboxed program must never see (the course root).
        seed: what the numbers of its exams are drawn from; one that nobody knows if left out.

    Raises:
        SandboxError: the program is not trusted, and there is no working sandbox here.
    """
    own_interfaces.build_interfaces()
    started = time.monotonic()
    outcome = Outcome(outputs=[[] for _ in program])
    with ExitStack() as stack:
        exams = exercise_folders.own_exam_files(cell.exam for cell in program)
        isolation = stack.enter_context(
            sandbox.choose_isolation(trust=trust, hidden=hidden, exams=exams)
        )
        # The lower number is the engine's: what writes to every descriptor in turn must find this
        # one, which is being read, before the examiner's, which is not until an exam begins.
        pairs = sorted((socket.socketpair() for _ in range(2)), key=lambda pair: pair[1].fileno())
        (engine, subject_engine), (control, subject_control) = pairs
        for end in (engine, subject_engine, control, subject_control):
            stack.enter_context(end)
        channel = Channel(engine)
        examiner = stack.enter_context(
            ExaminerProcess(
                control, isolation.domain_id, spawn=isolation.spawn, course=isolation.course
            )
        )
        subject = stack.enter_context(
            _start_subject(isolation, subject_engine, subject_control, files)
        )

        def start(command: Sequence[str], fds: Sequence[int]) -> RunningSubject:
            return isolation.start_subject(command, files, fds)

        seed = fresh_seed() if seed is None else seed
        _follow_program(program, channel, examiner, subject, outcome, cell_timeout, seed, start)
        if (excess := subject.describe_excess()) and _describe_end(excess) not in outcome.notes:
            outcome.notes.append(
                _describe_end(excess)
            )  # an examiner sees no more than that it is gone
    outcome.seconds = round(time.monotonic() - started, 2)
    return outcome


def _start_subject(
    isolation: Isolation, engine: socket.socket, control: socket.socket, files: Mapping[str, bytes]
) -> RunningSubject:
    fds = [engine.fileno(), control.fileno()]
    command = sandbox.subject_command(engine, control, isolation.domain_id)
    with engine, control:
        return isolation.start_subject(command, files, fds)


def _follow_program(
    program: Program,
    channel: Channel,
    examiner: ExaminerProcess,
    subject: RunningSubject,
    outcome: Outcome,
    cell_timeout: float,
    seed: int,
    start: Start,
) -> None:
    """Walk through the program with the subject; on its end, account for what was not reached."""
    status: Status
    number, shown = 0, outputs.OutputNotebook(outcome.outputs)
    try:
        _await_start(channel, subject)
        outcome.begun = True
        channel.send({"cells": [_cell_message(program, number) for number in range(len(program))]})
        for number, cell in enumerate(program):
            was_cut = shown.cut
            _await_cell(channel, subject, program, number, shown, cell_timeout)
            if shown.cut and not was_cut:
                outcome.notes.append(TOO_MUCH)
            if not cell.exam:
                _note_error(outcome, number)
            elif parts := _parts_from(program, number):
                last = number + len(parts) == len(program)
                examiner.request(
                    cell.exam, [(part.part, part.key) for part in parts],
                    pid=subject.pid, seed=seed, last=last,
                )  # fmt: skip
                done = [c.source for c in program[:number] if not c.exam]
                with ProgramHost(start, subject, done) as host:
                    for part in parts:
                        outcome.verdicts[part.grade_id] = examiner.verdict(
                            answer_with=host.answer_request
                        )
                        if examiner.hangs:
                            # It has waited long enough: it would find the same in every part.
                            _give_up(program, outcome, examiner.hangs, reached=number)
                            return
                if last:
                    return
                _await_cell(channel, subject, program, number, shown, cell_timeout, over=True)
    except ChannelTimeout:
        frames = hang_report.ask_frames(subject.pid, channel)
        reason = _describe_hang(program, number, cell_timeout, frames)
        _give_up(program, outcome, reason, reached=number)
    except ChannelBroken as error:
        _give_up(
            program,
            outcome,
            f"Something in the notebook wrote to the grader's own channel: {error}.",
            reached=number,
        )
    except ChannelClosed:
        fate = subject.describe_end()
        status = "grader_error" if subject.unwatched else "not_checked"
        _give_up(program, outcome, _describe_end(fate), status, reached=number)
    except ExaminerFloodedError as error:
        _give_up(program, outcome, str(error), reached=number)
    except ExaminerError as error:
        # What there is too much of in a network fails an examiner, too, and is the subject's.
        excess = subject.describe_excess(EXCESS_TIMEOUT_S)
        reason = _describe_end(excess) if excess else str(error)
        status = "not_checked" if excess else "grader_error"
        _give_up(program, outcome, reason, status, reached=number)


def _describe_end(fate: str) -> str:
    return f"The notebook's process ended: {fate}."


def _describe_hang(
    program: Program, number: int, seconds: float, frames: list[hang_report.Frame]
) -> str:
    """Return what a program is stuck in that has not answered for ``number``.

    ``frames`` are where it says that it is, if it does: an explanation, never evidence.
    """
    theirs = hang_report.student_frame(frames)
    where = f" ({hang_report.line_of(theirs, program)})" if theirs else ""
    if not program[number].exam:
        return (
            f"Code cell {number + 1} was still running after {seconds:.0f} s{where}, so nothing "
            "after it was examined: a cell that never ends (rclpy.spin, an endless loop) blocks a "
            "notebook."
        )
    # No cell of the student's: what it waits for is the end of the last examination.
    if frames and not theirs:
        where = f" (in {hang_report.describe_frames(frames)})"
    return (
        f"Your nodes were still being taken down {seconds:.0f} s after an examination{where}, so "
        "nothing after it was examined: does a destroy_node() of yours wait for ever?"
    )


def _await_start(channel: Channel, subject: RunningSubject) -> None:
    """Wait until the subject has started: nothing of the student's has run by then."""
    try:
        channel.receive(START_TIMEOUT_S)
    except (ChannelTimeout, ChannelClosed):
        raise ExaminerError(
            f"The notebook's process did not start: {subject.explain_failure()}."
        ) from None
    subject.ready()


def _parts_from(program: Program, number: int) -> Program:
    """Return the parts of an exam that are examined together at a cell: those from there on.

    Empty if it has been one of them before, or is no part of an exam.
    """
    exam = program[number].exam
    if number and program[number - 1].exam == exam:
        return ()
    return tuple(takewhile(lambda cell: cell.exam == exam, program[number:] if exam else ()))


def _cell_message(program: Program, number: int) -> dict[str, str]:
    """Return what a subject is told of a cell: never an answer key, nor which parts come."""
    if parts := _parts_from(program, number):
        return {"source": "", "exam": parts[0].exam}
    return {"source": "" if program[number].exam else program[number].source, "exam": ""}


def _await_cell(
    channel: Channel,
    subject: RunningSubject,
    program: Program,
    number: int,
    shown: outputs.OutputNotebook,
    timeout: float,
    *,
    over: bool = False,
) -> None:
    """Wait until the subject has come to an exam, or has run a cell; keep what is shown by then.

    With ``over``, wait until it has taken down what was examined.

    What a cell shows can change later: a display is updated, a task goes on. But what nbgrader
    takes for a score is what a test showed when it ran.
    """
    reached = {"exam" if _parts_from(program, number) and not over else "ran": number}
    seen: set[int] = set()
    while (message := channel.receive_fairly(timeout, subject.delay)) != reached:
        match message:
            case {"shows": int() as place, "outputs": list() as given} if (
                0 <= place <= number and place not in seen
            ):
                if not all(map(outputs.is_output, given)):
                    raise ChannelBroken("what it says of a cell's outputs is none")
                seen.add(place)
                if place == number or not program[place].grade_id:
                    shown.put_outputs(place, given)
            case _:
                raise ChannelBroken("it is no answer to what was asked")


def _note_error(outcome: Outcome, number: int) -> None:
    for output in outcome.outputs[number]:
        if output["output_type"] == "error" and len(outcome.notes) < MOST_NOTES:
            what = f"{output['ename']}: {_CELL_NAME.sub('', output['evalue'])}"
            outcome.notes.append(f"Code cell {number + 1} of the notebook raised {what[:300]}")


def _give_up(
    program: Program,
    outcome: Outcome,
    reason: str,
    status: Status = "not_checked",
    *,
    reached: int = 0,
) -> None:
    # They bring rclpy, for which no other notebook need wait that is run from this process.
    from autograder import exercises
    from autograder.examination.exam import unexamined_verdict

    outcome.notes.append(reason)
    for number, cell in enumerate(program):
        if number >= reached and cell.grade_id and not cell.exam:
            outcome.outputs[number] = [dict(NOT_RUN)]
        if cell.exam and cell.grade_id not in outcome.verdicts:
            exam = exercises.load_exam(cell.exam)
            outcome.verdicts[cell.grade_id] = unexamined_verdict(exam, cell.part, reason, status)


def refused_outcome(program: Program, reason: str, status: Status = "not_checked") -> Outcome:
    """Return the outcome of a program that is not run at all, for ``reason``."""
    outcome = Outcome(outputs=[[] for _ in program], unreadable=True)
    _give_up(program, outcome, reason, status)
    return outcome


def with_notes(outcome: Outcome, notes: list[str]) -> Outcome:
    """Return an outcome whose verdicts carry ``notes`` for the student, too."""
    said = (*notes, *outcome.notes)
    verdicts = {name: replace(v, notes=(*v.notes, *said)) for name, v in outcome.verdicts.items()}
    return replace(outcome, verdicts=verdicts)
