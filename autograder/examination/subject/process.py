"""The subject process: hosts one student's code while an examiner watches it from outside.

Started as ``python -P -m autograder.examination.subject.process --engine FD --control FD --domain
N``. It says that it is ready; the engine sends the program over its channel, the examiner drives
the subject server over the control channel whenever the program comes to an exam. Nothing that this
process says about itself earns a point.
"""

from __future__ import annotations

import argparse
import os
import shutil
import socket
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from autograder.examination.subject import hang_report, plain_program
from autograder.examination.subject.recording import Recording
from autograder.examination.subject.server import SubjectServer
from autograder.examination.subject.shell import make_kernel
from autograder.examination.subject.student_errors import SUBJECT_ENV
from autograder.processes.channel import Channel, ChannelClosed
from autograder.sandbox.resource_limits import Limits
from course.runtime.core_session import CoreSession
from course.runtime.domains.leases import reserve_domain

SHELL = (
    "IPython.core.application", "IPython.core.completer", "IPython.core.completerlib",
    "IPython.core.crashhandler", "IPython.core.logger", "IPython.core.magics.extension",
    "IPython.core.oinspect", "ipykernel.eventloops", "ipywidgets",
    "pygments.formatters.terminal256", "stack_data", "tornado.platform.asyncio",
)  # fmt: skip
"""What a kernel imports for its first cell and for its first traceback."""

PLOTS = ("matplotlib.backends.backend_agg", "matplotlib.pyplot")
"""What cells plot with. Not among it is the inline backend, which looks for a shell at once."""


def run(engine: Channel, control: Channel, domain_id: int) -> None:
    """Run the engine's program cell by cell, and serve the examiner where it says so."""
    kernel, recording = make_kernel(), Recording()
    # Up to here standard error told the grader why a subject does not start.
    kernel.begin_recording(recording)
    hang_report.tell_when_asked(engine.fileno())
    engine.send({"ready": True})

    def open_session(threads: int, sim_time: bool) -> CoreSession:
        return CoreSession(domain_id=domain_id, threads=threads, sim_time=sim_time)

    def serve() -> None:
        SubjectServer(open_session, kernel.cell_shell.user_ns).serve(control)

    process, exams = os.getpid(), set()
    for number, cell in enumerate(engine.receive()["cells"]):
        if cell["exam"]:
            exams.add(number)
            _send_changes(engine, {"exam": number}, recording, exams)
            kernel.run_beside(number, serve)
            _send_changes(engine, {"ran": number}, recording, exams)
        else:
            kernel.run_cell(cell["source"], number)
            if os.getpid() != process:
                os._exit(0)  # a cell has forked, and this is not the process that is graded
            _send_changes(engine, {"ran": number}, recording, exams)


def run_program(engine: Channel, domain_id: int) -> None:
    """Run the engine's cells, and then nodes of theirs as a plain program, with nobody to ask."""
    kernel = make_kernel()
    kernel.begin_recording(Recording())
    engine.send({"ready": True})
    told, process = engine.receive(), os.getpid()
    for number, source in enumerate(told["cells"]):
        kernel.run_cell(source, number)
        if os.getpid() != process:
            os._exit(0)

    def up() -> None:
        engine.send({"up": True})
        engine.close()

    plain_program.run(kernel.cell_shell.user_ns, told["program"], domain_id, up)


def _send_changes(
    engine: Channel, message: dict[str, int], recording: Recording, exams: set[int]
) -> None:
    """Send what cells show that showed something else, or nothing, before; then a message."""
    for number, outputs in recording.take_changes().items():
        if number not in exams:
            engine.send({"shows": number, "outputs": outputs})
    engine.send(message)


def preload() -> None:
    """Import and make what a run needs; `autograder.sandbox.prefork` calls it before it forks.

    Without a folder to write to, each of them makes its kernel, and imports what it plots with.
    """
    from autograder.sandbox.prefork import modules

    modules.import_all((*SHELL, "autograder.running.notebook_check"))
    with suppress(OSError), modules.scratch_folder("MPLCONFIGDIR", "IPYTHONDIR"):
        for name in PLOTS:
            import_module(name)
        make_kernel()
    modules.note_files()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the process; returns its exit code."""
    parser = argparse.ArgumentParser(prog="autograder.examination.subject.process")
    parser.add_argument("--engine", type=int, required=True, help="file descriptor of the engine")
    parser.add_argument(
        "--control", type=int, required=True, help="file descriptor of the examiner"
    )
    parser.add_argument("--domain", type=int, required=True, help="domain id the exam is sat on")
    parser.add_argument("--limits", help="what it may use of the machine, as JSON")
    parser.add_argument("--files", type=Path, help="folder whose files it works with")
    parser.add_argument("--program", action="store_true", help="run nodes as a plain program")
    options = parser.parse_args(arguments)
    if options.files:
        for entry in options.files.iterdir():
            copy = shutil.copytree if entry.is_dir() else shutil.copyfile
            copy(entry, entry.name)
    if options.limits:
        Limits.from_json(options.limits).apply()
    os.environ[SUBJECT_ENV] = "1"
    # A session of the student's own that leases a domain must not come to the one of the exam.
    lease = reserve_domain(options.domain)
    engine = Channel(socket.socket(fileno=options.engine))
    control = Channel(socket.socket(fileno=options.control))
    try:
        if options.program:
            control.close()
            run_program(engine, options.domain)
        run(engine, control, options.domain)
    except ChannelClosed:
        return 1
    finally:
        if lease is not None:  # else the process that runs the exam has leased it
            lease.release()
    return 0


if __name__ == "__main__":
    sys.exit(main())
