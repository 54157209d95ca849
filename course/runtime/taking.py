"""What rclpy 7.1 leaves locked when it fails to take what is ready, and how to free it.

Its executor enters the callback group, takes the message, and leaves the group once the callback is
done. If taking raises, nobody leaves: in a mutually exclusive group, which every node has by
default, no callback ever runs again. It takes a timer that a cell cancels just as it fires, or a
message that is none.
"""

# mypy: allow-untyped-calls

from __future__ import annotations

import traceback
from contextlib import suppress

from course.runtime.jobs import Job

_EXECUTORS = "rclpy.executors"


def give_back(job: Job, failure: BaseException) -> bool:
    """Leave the callback group of a job that failed in taking; return whether it was in there."""
    if not _in_taking(failure):
        return False
    entity = job.entity
    entity._executor_event = False  # type: ignore[attr-defined]  # "is to be left out of the wait"
    with suppress(AssertionError):  # it is not in there
        entity.callback_group.ending_execution(entity)  # type: ignore[attr-defined]
    return True


def _in_taking(failure: BaseException) -> bool:
    frames = [frame for frame, _ in traceback.walk_tb(failure.__traceback__)]
    names = [f.f_code.co_name for f in frames if f.f_globals.get("__name__") == _EXECUTORS]
    return len(names) > 1 and names[0] == "handler" and names[1].startswith("_take_")
