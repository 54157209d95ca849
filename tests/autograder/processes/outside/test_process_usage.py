"""What processes hold and do, as it is seen from outside."""

from __future__ import annotations

import os
import threading
from pathlib import Path

from autograder.processes.outside.process_usage import count_naps, thread_ids
from autograder.processes.process_folders import SingleProcess
from course import Session
from course.runtime.waiting import Pulse, poll_condition


def test_threads_of_dds_are_not_taken_for_those_of_a_program(session: Session) -> None:
    session.participate()
    me, over = SingleProcess(os.getpid()), threading.Event()
    mine = threading.Thread(target=lambda: poll_condition(over.is_set, 60.0, Pulse()))
    mine.start()
    try:
        everybody = thread_ids(f"/proc/{os.getpid()}")
        first = count_naps(me, everybody)
        of_dds = {
            thread
            for thread in everybody
            if Path(f"/proc/self/task/{thread}/comm").read_text().startswith("dds.")
        }
        assert of_dds
        assert not of_dds & first.keys()
        assert mine.native_id in first
        assert poll_condition(
            lambda: count_naps(me, first)[mine.native_id] > first[mine.native_id] + 2,
            20.0, Pulse(),
        )  # fmt: skip
    finally:
        over.set()
        mine.join()
