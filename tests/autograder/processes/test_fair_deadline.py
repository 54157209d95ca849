"""A deadline counts the time that a process had, not the time that others took from it."""

from __future__ import annotations

import os
from pathlib import Path

from autograder.corpus.trials import busy_loops
from autograder.processes.fair_deadline import FairDeadline, SeenDelay, of_process, run_times
from autograder.processes.process_folders import SingleProcess


def kept() -> float:
    return run_times(f"/proc/{os.getpid()}")[1]


def test_a_deadline_is_put_off_while_others_keep_the_process_from_running_not_for_ever() -> None:
    with busy_loops(4 * (os.cpu_count() or 1)):
        before, deadline = kept(), FairDeadline(1.0, of_process(os.getpid()))
        while kept() - before < 1.2:
            pass
        assert deadline.seconds_left > 0
        while deadline.seconds_left:  # it is put off by no more than two seconds
            pass


class Several:
    """Some processes that are one program's."""

    def list_folders(self) -> list[str]:
        return [f"/proc/{pid}" for pid in (os.getpid(), *children())]

    def folder_of(self, pid: int) -> str:
        return f"/proc/{pid}"


def children() -> list[str]:
    return Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()


def test_who_is_kept_from_running_by_its_own_processes_gets_no_more_time() -> None:
    with busy_loops(4 * (os.cpu_count() or 1)):
        delay = SeenDelay(Several(), os.getpid())
        before, mark = kept(), delay.mark()
        while kept() - before < 1.2:
            pass
        assert delay.delay_since(mark) < 0.6


def test_who_is_kept_from_running_by_processes_that_have_gone_gets_no_more_time() -> None:
    with busy_loops(4 * (os.cpu_count() or 1)):
        before = kept()

        def spent() -> float:  # by itself and its children, and by those for whom it waited
            times = os.times()
            own = times.user + times.system + times.children_user + times.children_system
            return own + kept() - before

        delay = SeenDelay(SingleProcess(os.getpid()), os.getpid(), spent)
        mark = delay.mark()
        while kept() - before < 0.6:
            pass
        assert delay.delay_since(mark) < 0.3


def test_a_process_that_is_not_there_was_never_kept_waiting() -> None:
    delay = of_process(0)
    assert delay.delay_since(delay.mark()) == 0.0
