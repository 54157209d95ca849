"""In which line a program is stuck that does not answer any more: a subject tells it on a signal.

What a subject says is written where a stranger's code runs. So it is no evidence: it only helps
whoever looks for the mistake.
"""

from __future__ import annotations

import faulthandler
import os
import re
import signal
from contextlib import suppress
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

from autograder.raised import is_students
from autograder.submission import Program
from autograder.wire import Channel

ASK = signal.SIGUSR1
PATIENCE, SILENCE = 3.0, 0.5
"""Seconds that an answer may take, and without anything more after which it is over."""

_FRAME = re.compile(r'  File "([^"\n]{1,500})", line (\d{1,9}) in (.{1,100})')
_CELL = re.compile(r"<ipython-input-(\d{1,9})-")
_OURS = ("autograder/subject.py", "run")  # what a subject's first thread runs


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


def ask(pid: int, channel: Channel) -> list[Frame]:
    """Return where the first thread of the subject ``pid`` is, the innermost frame first.

    Empty if it does not say. Its ``channel`` is of no use afterwards.
    """
    if pid <= 0:
        return []
    with suppress(ProcessLookupError, PermissionError):
        os.kill(pid, ASK)
    said = channel.leftovers(PATIENCE, SILENCE).decode(errors="replace")
    return _of_first_thread("".join(c if c.isprintable() or c == "\n" else "?" for c in said))


def _of_first_thread(dump: str) -> list[Frame]:
    for thread in re.split(r"^(?:Current thread|Thread) 0x.*$", dump, flags=re.MULTILINE):
        frames = [Frame(file, int(line), name) for file, line, name in _FRAME.findall(thread)]
        if any(f.file.endswith(_OURS[0]) and f.function == _OURS[1] for f in frames):
            return frames
    return []


def students(frames: list[Frame]) -> Frame | None:
    """Return the innermost frame that is of the student's code."""
    return next((frame for frame in frames if is_students(frame.file)), None)


def line_of(frame: Frame, program: Program) -> str:
    """Return where a frame is, and what stands there, if it is in a cell of the program."""
    cell = _CELL.match(frame.file)
    if cell is None:
        return f"line {frame.line} of {Path(frame.file).name[:100]}"
    number, line = int(cell[1]), frame.line
    lines = program[number - 1].source.splitlines() if 0 < number <= len(program) else []
    line += len(list(takewhile(lambda text: not text.strip(), lines)))  # IPython leaves them out
    code = lines[line - 1].strip() if 0 < line <= len(lines) else ""
    return f"line {line} of code cell {number}" + (f": {code[:200]}" if code else "")
