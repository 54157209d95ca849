"""One submission against the runner: whatever it does, an outcome comes back."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from autograder.corpus.trials import busy_loops
from autograder.examination.program import Cell, Program
from autograder.examination.subject import outputs
from autograder.processes.channel import Channel
from autograder.running import grading_jobs, runner
from autograder.running.outcomes.outcome_store import KIND, OutcomeStore
from autograder.running.runner import Outcome
from autograder.running.start import ExaminerError, ExaminerProcess
from autograder.sandbox import SandboxStartError
from autograder.util.state_table import StateTable
from course.runtime.domains.leases import leasable_domains, lease_domain
from tests.machine import needs_sandbox

pytestmark = needs_sandbox

EXAM = Cell("", "qos-visible", "qos", "visible")


def program(*sources: str) -> Program:
    return (*(Cell(source) for source in sources), EXAM)


def verdict_reasons(outcome: Outcome) -> set[tuple[str, str]]:
    return {(c.status, c.actual) for c in outcome.verdicts["qos-visible"].checks}


def text_of(outputs: list[dict[str, str]]) -> str:
    return "".join(output.get("text", "") for output in outputs)


def test_outputs_come_back_cell_by_cell() -> None:
    outcome = runner.run((Cell("print('one')\nx = 2"), Cell("x + 40"), Cell("1 / 0"), Cell("x")))
    one, two, three, four = outcome.outputs
    assert text_of(one) == "one\n"
    assert two[0]["data"]["text/plain"] == "42"
    assert three[-1]["ename"] == "ZeroDivisionError"
    assert four[0]["data"]["text/plain"] == "2", "an error does not end the notebook"
    assert any("ZeroDivisionError" in note for note in outcome.notes)


@pytest.mark.parametrize(
    ("source", "fate"),
    [
        ("import os; os._exit(7)", "exit code 7"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", "killed by SIGKILL"),
        ("import ctypes; ctypes.string_at(0)", "killed by SIGSEGV"),
    ],
)
def test_a_process_that_ends_is_an_outcome(source: str, fate: str) -> None:
    outcome = runner.run(program("x = 1", source))
    ((status, reason),) = verdict_reasons(outcome)
    assert status == "not_checked"
    assert fate in reason


def test_a_cell_that_never_ends_is_ended() -> None:
    outcome = runner.run(program("while True: pass"), cell_timeout=3)
    ((status, reason),) = verdict_reasons(outcome)
    assert status == "not_checked"
    assert "Code cell 1 was still running after 3 s (line 1 of code cell 1: while True" in reason


def test_time_in_which_others_keep_a_cell_from_running_is_not_its_own() -> None:
    source = """
import os
from autograder.processes.fair_deadline import run_times
here = f"/proc/{os.getpid()}"
begun = run_times(here)[1]
while run_times(here)[1] < begun + 2.5:
    pass
"""
    with busy_loops(4 * (os.cpu_count() or 1)):
        outcome = runner.run((Cell(source), Cell("print('came')")), cell_timeout=2)
    assert outcome.outputs[0] == []
    assert text_of(outcome.outputs[1]) == "came\n"


def test_the_line_of_a_cell_that_never_ends_is_found_in_another_cell() -> None:
    wait = "import threading\ndef wait():\n    threading.Event().wait()  # for ever"
    outcome = runner.run(program("x = 1", wait, "wait()"), cell_timeout=3)
    ((_, reason),) = verdict_reasons(outcome)
    assert "Code cell 3 was still running after 3 s (line 3 of code cell 2: threading" in reason


def test_a_program_that_does_not_say_where_it_is_is_ended_as_well() -> None:
    source = """
import faulthandler, signal
faulthandler.unregister(signal.SIGUSR1)
signal.signal(signal.SIGUSR1, signal.SIG_IGN)
while True:
    pass
"""
    outcome = runner.run(program(source), cell_timeout=3)
    ((_, reason),) = verdict_reasons(outcome)
    assert "Code cell 1 was still running after 3 s, so" in reason


def test_what_is_forged_as_the_place_of_a_program_is_cut_to_measure() -> None:
    source = """
import os, signal
from autograder.examination.subject import hang_report
frame = f'  File "{"x" * 300}\\0\\x1b[2J", line {"9" * 5000} in {"y" * 10**6}\\n'
first = f'  File "{"z" * 300}", line {"9" * 9} in f\\n'
ours = '  File "/autograder/examination/subject/process.py", line 1 in run\\n'
dump = ("Thread 0x1 (most recent call first):\\n" + first + frame + ours).encode()
def forge(*_):
    for fd in range(3, 50):
        try:
            os.write(fd, dump)
        except OSError:
            pass
import faulthandler
faulthandler.unregister(hang_report.ASK)
signal.signal(hang_report.ASK, forge)
while True:
    pass
"""
    outcome = runner.run(program(source), cell_timeout=3)
    ((_, reason),) = verdict_reasons(outcome)
    assert f"(line 999999999 of {'z' * 100})" in reason
    assert len(reason) < 500


def test_a_cleanup_that_never_ends_is_told_from_a_cell() -> None:
    source = """
import threading
from rclpy.node import Node
class SensorDrivers(Node):
    def __init__(self):
        super().__init__('drivers')
    def destroy_node(self):
        threading.Event().wait()
"""
    hidden = Cell("", "qos-hidden", "qos", "hidden")
    outcome = runner.run((*program(source), Cell("x = 1"), hidden), cell_timeout=5)
    (reason,) = {check.actual for check in outcome.verdicts["qos-hidden"].checks}
    assert "Your nodes were still being taken down 5 s after an examination (line 8 of " in reason
    assert outcome.notes == [reason]


def test_what_a_process_says_of_where_it_hangs_puts_no_blame_on_the_grader() -> None:
    source = """
import queue
from course.runtime.nodes import node_registry
from rclpy.node import Node
class SensorDrivers(Node):
    def __init__(self):
        super().__init__('drivers')
node_registry.destroy_node = queue.SimpleQueue().get  # waits, and is no line of theirs
"""
    hidden = Cell("", "qos-hidden", "qos", "hidden")
    outcome = runner.run((*program(source), Cell("x = 1"), hidden), cell_timeout=5)
    assert not outcome.has_grader_error
    (reason,) = {check.actual for check in outcome.verdicts["qos-hidden"].checks}
    assert "still being taken down 5 s after an examination (in node_registry.py:" in reason


def test_only_what_failed_before_the_program_began_is_tried_again() -> None:
    failed = runner.refused_outcome(program("x = 1"), "the examiner did not start", "grader_error")
    assert failed.may_be_tried_again
    failed.begun = True
    assert failed.has_grader_error
    assert not failed.may_be_tried_again
    assert runner.Outcome.from_json(failed.to_json()) == failed


def test_a_constructor_that_never_returns_fails_its_check(monkeypatch: pytest.MonkeyPatch) -> None:
    source = """
from rclpy.node import Node
class SensorDrivers(Node):
    def __init__(self):
        super().__init__('drivers')
        while True:
            pass
"""
    outcome = runner.run(program(source))
    first, *rest = outcome.verdicts["qos-visible"].checks
    assert (first.name, first.status) == ("nodes_start", "failed")
    assert "did not answer" in first.actual
    assert {check.status for check in rest} == {"not_checked"}


def test_nobody_waits_twice_for_a_program_that_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    source = """
import time
from rclpy.node import Node
class SensorDrivers(Node):
    def __init__(self):
        time.sleep(10**6)
"""
    later = (Cell("x = 1"), Cell("", "qos-hidden", "qos", "hidden"))
    outcome = runner.run((*program(source), *later))
    (note,) = outcome.notes
    assert "did not answer" in note, "not: a cell was still running"
    hidden = outcome.verdicts["qos-hidden"].checks
    assert {(check.status, check.actual) for check in hidden} == {("not_checked", note)}


def test_displays_without_end_are_cut_and_say_so() -> None:
    many = "for number in range(100_000): display({'text/plain': str(number)}, raw=True)"
    ((*kept, last),) = runner.run((Cell(many),)).outputs
    assert kept[1]["data"] == {"text/plain": "1"}
    assert len(kept) < 1000
    assert last["text"] == "[further outputs were cut off here]\n"


def test_only_text_is_written_to_a_stream() -> None:
    outcome = runner.run((Cell("import sys\nsys.stdout.write(b'bytes')"),))
    ((error,),) = outcome.outputs
    assert (error["ename"], error["evalue"]) == (
        "TypeError",
        "write() argument must be str, not <class 'bytes'>",
    )


def test_a_flood_of_output_is_cut() -> None:
    outcome = runner.run((Cell("print('x' * 5_000_000)"),))
    text = text_of(outcome.outputs[0])
    assert len(text) < 100_000
    assert "more characters were cut off" in text


def test_nothing_that_a_student_prints_is_a_verdict() -> None:
    forged = 'print(\'{"version": 1, "exam": "qos", "part": "visible", "checks": []}\')'
    outcome = runner.run(program(forged))
    assert outcome.verdicts["qos-visible"].score == 0


FORGED = """
import json, os, sys
outputs = {outputs}
line = json.dumps({{"shows": 0, "outputs": outputs}}).encode() + b"\\n"
for descriptor in range(3, 64):
    try:
        os.write(descriptor, line)
    except OSError:
        pass
"""


@pytest.mark.parametrize(
    "outputs",
    [
        [5], [{}], [{"output_type": "stream", "name": "stdout", "text": ["x"]}],
        [{"output_type": "display_data", "data": {"text/plain": 5}, "metadata": {}}],
        [{"output_type": "display_data", "data": {}, "metadata": {}, "more": 1}],
        [{"output_type": "display_data", "data": {}, "metadata": {"image/png": 5}}],
        [{"output_type": "display_data", "data": {"image/png": ""},
          "metadata": {"image/png": {"width": "1><script>"}}}],
        [{"output_type": "execute_result", "data": {"text/plain": "10.0"}, "metadata": {}}],
        [{"output_type": "error", "ename": "E", "evalue": "", "traceback": [5]}],
    ],
)  # fmt: skip
def test_outputs_that_are_none_are_not_taken(outputs: list[Any]) -> None:
    outcome = runner.run(program(FORGED.format(outputs=outputs)))
    ((status, reason),) = verdict_reasons(outcome)
    assert (status, "the grader's own channel" in reason) == ("not_checked", True)
    assert outcome.outputs == [[], []]


def test_what_is_forged_as_an_output_can_be_written() -> None:
    source = FORGED.format(outputs=[{"output_type": "stream", "name": "stdout", "text": "\ud800"}])
    assert text_of(runner.run(program(source)).outputs[0]) == "?"


def test_a_cell_that_was_not_reached_is_not_right() -> None:
    """For nbgrader, an instructor's own test cell without any output has all its points."""
    cells = (Cell("x = 1", "mine"), Cell("import os; os._exit(1)", "ends"), Cell("1", "own"))
    outcome = runner.run((*cells, EXAM))
    assert outcome.outputs == [[], [runner.NOT_RUN], [runner.NOT_RUN], []]
    refused = runner.refused_outcome((*cells, EXAM), "It is no notebook.")
    assert refused.outputs == [[runner.NOT_RUN]] * 3 + [[]]


def test_of_outputs_that_are_too_many_the_errors_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    outcome = runner.run((Cell("print('x' * 1000)\nassert False, 'y' * 1000", "own"),))
    monkeypatch.setattr(grading_jobs, "MAX_OUTCOME_CHARS", 1000)
    ((error,),) = grading_jobs.bounded_outcome(outcome).outputs
    assert error == {**runner.NOT_RUN, "ename": "AssertionError", "evalue": "y" * 200,
                     "traceback": []}  # fmt: skip


def test_what_all_cells_print_and_raise_is_bounded_together() -> None:
    outcome = runner.run((Cell("print('x' * 60_000)\n1 / 0"),) * 200)
    assert len(outcome.to_json()) < outputs.MAX_NOTEBOOK_CHARS + 200_000
    assert outcome.outputs[0][0]["output_type"] == "stream"
    assert [output["ename"] for output in outcome.outputs[-1]] == ["ZeroDivisionError"]
    assert outcome.notes.count(runner.TOO_MUCH) == 1
    assert len(outcome.notes) == runner.MOST_NOTES + 1


def test_exit_in_a_cell_does_not_end_the_notebook() -> None:
    outcome = runner.run((Cell("import sys; sys.exit(0)"), Cell("'still here'")))
    assert outcome.outputs[1][0]["data"]["text/plain"] == "'still here'"


def test_no_session_of_a_student_leases_the_domain_of_the_exam() -> None:
    every = """
from course.runtime.domains.leases import lease_domain
from course.errors import DomainError
leases = []
try:
    while True:
        leases.append(lease_domain())
except DomainError:
    print(len(leases), {lease.domain_id for lease in leases}.isdisjoint({101}))
"""
    outcome = runner.run(program(every))
    assert text_of(outcome.outputs[0]) == f"{len(leasable_domains()) - 1} True\n"


def test_an_outcome_survives_the_store_and_a_damaged_one_is_ignored(tmp_path: Path) -> None:
    store = OutcomeStore(tmp_path)
    outcome = Outcome([[]], {}, ["note"], 1.5)
    store.put(program(), {}, outcome)
    assert store.get(program(), {}) == outcome
    table = StateTable(tmp_path, KIND)
    ((name, text),) = table.rows().items()
    table.put(text[:20], *name)
    assert store.get(program(), {}) is None


def test_an_examiner_is_ended_even_before_it_leads_its_processes() -> None:
    """As one that is killed right after its fork, when a sandbox is refused."""
    started: list[subprocess.Popen[bytes]] = []

    def spawn(command: list[str], **options: Any) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(["cat"], **{**options, "start_new_session": False})
        started.append(process)
        return process

    control, subject = socket.socketpair()
    with (
        subject,
        pytest.raises(SandboxStartError, match="out of processes"),
        ExaminerProcess(control, 1, spawn=spawn),
    ):
        raise SandboxStartError("out of processes")
    assert started[0].returncode is not None


def test_an_examiner_without_a_verdict_says_where_it_is_stuck() -> None:
    ours, theirs = socket.socketpair()
    lease = lease_domain()
    try:
        with ours, ExaminerProcess(theirs, lease.domain_id) as examiner:
            examiner.request("qos", [("visible", {})], pid=os.getpid())
            Channel(ours).receive(60.0)  # and is not answered
            with pytest.raises(ExaminerError) as raised:
                examiner.verdict(timeout=0.1)
    finally:
        lease.release()
    place = r"\(channel\.py:\d+ _fill < channel\.py:\d+ receive < .*\)"
    assert re.fullmatch(rf"The examiner gave no verdict within 0 s {place}\.", str(raised.value))


def test_an_examiner_that_cannot_be_started_leaves_no_socket_open(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def sockets() -> set[str]:
        links = [link for link in Path("/proc/self/fd").iterdir() if link.exists()]
        return {name for link in links if "socket" in (name := str(link.readlink()))}

    before = sockets()
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with pytest.raises(FileNotFoundError) as raised:
        runner.run(program("x = 1"), trust=True)
    assert sockets() == before, f"open while {raised.value} is held"
