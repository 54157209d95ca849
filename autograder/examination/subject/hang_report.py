"""Find the line in which a process is stuck: the process writes it when it gets a signal.

What a subject says is written where a stranger's code runs. So it is no evidence: it only helps to
find the mistake.
"""

from __future__ import annotations

import faulthandler
import os
import re
import signal
from contextlib import suppress
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from autograder.examination.subject.student_errors import is_students
from autograder.processes.channel import Channel

if TYPE_CHECKING:  # a student's kernel has no use for nbgrader's notebooks
    from autograder.examination.program import Program

ASK = signal.SIGUSR1
PATIENCE, SILENCE = 3.0, 0.5
"""Seconds that an answer may take, and without anything more after which it is over."""

_FRAME = re.compile(r'  File "([^"\n]{1,500})", line (\d{1,9}) in (.{1,100})')
_CELL = re.compile(r".*/ipykernel_\d{1,9}/(\d{1,9})-\d{1,20}\.py")
"""The name that `autograder.examination.subject.shell` gives to a cell's code."""
SUBJECT, EXAMINER = (
    ("autograder/examination/subject/process.py", "run"),
    ("autograder/running/examiner.py", "main"),
)
"""The file and the function that the first thread of a process runs."""


class Frame(NamedTuple):
    """A place in a program that runs: the file, the line in it, and the function's name."""

    file: str
    line: int
    function: str


def tell_when_asked(fd: int) -> None:
    """Write where every thread of this process is to ``fd``, whenever the process is asked.

    Also while a thread never gives up the interpreter.
    """
    faulthandler.register(ASK, file=fd, all_threads=True)


def ask_frames(pid: int, channel: Channel) -> list[Frame]:
    """Return where the first thread of the subject ``pid`` is, the innermost frame first.

    Empty if it does not say. Its ``channel`` is of no use afterwards.
    """
    if pid <= 0:
        return []
    with suppress(ProcessLookupError, PermissionError):
        os.kill(pid, ASK)
    said = channel.read_leftovers(PATIENCE, SILENCE).decode(errors="replace")
    dump = "".join(c if c.isprintable() or c == "\n" else "?" for c in said)
    return of_first_thread(dump, SUBJECT)


def of_first_thread(dump: str, runs: tuple[str, str]) -> list[Frame]:
    """Return where a process's first thread is, the innermost frame first; empty if it is not said.

    Args:
        dump: what the process wrote.
        runs: what its first thread runs.
    """
    for thread in re.split(r"^(?:Current thread|Thread) 0x.*$", dump, flags=re.MULTILINE):
        frames = [Frame(file, int(line), name) for file, line, name in _FRAME.findall(thread)]
        if any(f.file.endswith(runs[0]) and f.function == runs[1] for f in frames):
            return frames
    return []


def describe_frames(frames: list[Frame]) -> str:
    """Return the innermost of some frames in a line, to help find our own mistake."""
    return " < ".join(f"{Path(f.file).name}:{f.line} {f.function}" for f in frames[:6])


def student_frame(frames: list[Frame]) -> Frame | None:
    """Return the innermost frame that is of the student's code."""
    return next((frame for frame in frames if is_students(frame.file)), None)


def line_of(frame: Frame, program: Program) -> str:
    """Return where a frame is, and what stands there, if it is in a cell of the program."""
    cell = _CELL.fullmatch(frame.file)
    if cell is None:
        return f"line {frame.line} of {Path(frame.file).name[:100]}"
    number, line = int(cell[1]), frame.line
    lines = program[number - 1].source.splitlines() if 0 < number <= len(program) else []
    line += len(list(takewhile(lambda text: not text.strip(), lines)))  # IPython leaves them out
    code = lines[line - 1].strip() if 0 < line <= len(lines) else ""
    return f"line {line} of code cell {number}" + (f": {code[:200]}" if code else "")
