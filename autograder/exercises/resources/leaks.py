"""What is left of many rounds of one thing: threads, open files and memory of the process.

A round may leave something for a moment, and a first one may cost what no later one does. So rounds
are counted, and what is left is measured by their number.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from autograder.examination.check_context import StudentError
from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_duties import DRIVER, require_picture
from autograder.exercises.resources.camera_requests import require_snapshot
from autograder.exercises.resources.camera_usage import Usage
from autograder.exercises.resources.rig import ENDED, CameraRig

START_MEMORY = 1024  # KiB a failed start or a round: one of ten costs more than one of fifty
FEWEST_FOR_MEMORY = 3  # starts or rounds: the memory of fewer is not told from noise
WORDS = {"threads": "threads", "files": "open files"}
NO_START, STARTS = "A driver that cannot start leaves nothing behind,", "such starts"
MOMENT = 0.01  # s of simulated time, in which what has come is taken up
WORK = 20  # snapshots in one life, or refused zooms


def require_flat(rig: CameraRig, before: Usage, times: int, expected: str, rounds: str) -> None:
    """Fail if since ``before`` the process has kept threads or files of so many ``rounds``."""
    rig.subject.collect()
    # Half of them, and not one alone: a notebook has threads of its own, which come and go.
    most = max(2, times / 2)
    for what in ("threads", "files"):

        def grown(what: str = what) -> int:
            return int(getattr(rig.process.read_usage().growth_since(before), what))

        if not rig.wait_for_end(lambda grown=grown: grown() < most):  # type: ignore[misc]
            raise Failed(
                expected=f"{expected} no thread and no file.",
                actual=f"After {times} {rounds} the process had {grown()} more {WORDS[what]} "
                f"than before.{rig.process_note()}",
            )


def require_flat_memory(
    rig: CameraRig,
    before: Usage,
    again: Callable[[], None],
    times: int,
    expected: str,
    rounds: str,
) -> None:
    """Fail if the process has kept memory of so many ``rounds``, and of as many ``again``.

    What a first time costs is no leak.
    """
    for last in (False, True):
        rig.subject.collect()
        memory = rig.process.read_usage().growth_since(before).memory
        if memory < max(FEWEST_FOR_MEMORY, times) * START_MEMORY:
            return
        if not last:
            before = rig.process.read_usage()
            again()
    raise Failed(
        expected=f"{expected} and less than 1 MiB of memory each.",
        actual=f"After {times} {rounds} the process had {memory // 1024} MiB more memory than "
        "before. They came after as many others: what a first time costs does not count."
        f"{rig.process_note()}",
    )


def require_flat_snapshots(rig: CameraRig) -> None:
    """Fail if a life with many snapshots leaves threads or files behind.

    A life of its own: an answer of a service costs more than all the rest of a short one.
    """
    device, before = rig.new_device(), rig.process.read_usage()
    rig.program.start(DRIVER, device)
    require_picture(rig, device)
    for _ in range(WORK):
        require_snapshot(rig, device, "While the driver runs")
    rig.program.stop(DRIVER)
    rig.wait(lambda: not rig.open_cameras(device), idle=ENDED)
    expected = "What a snapshot takes is given back by the end of a life:"
    require_flat(rig, before, WORK, expected, "snapshots and the end of the driver")


def refuse_zooms(rig: CameraRig) -> None:
    """Send many zooms that the camera refuses; each is taken up before the next one."""
    for _ in range(WORK):
        rig.refused_zoom(99)
        rig.advance(MOMENT)


def require_flat_refusals(rig: CameraRig, before: Usage) -> None:
    """Fail if a life with many refused zooms, now over, has left threads or files behind."""
    expected = "What a refused zoom takes is given back by the end of a life:"
    require_flat(rig, before, WORK, expected, "refused zooms and the end of the driver")


def failing_starts(rig: CameraRig, kind: str, times: int) -> Usage:
    """Fail unless the constructor raises, and the process keeps none of its threads and files.

    Return what the process held before.
    """
    before = rig.process.read_usage()
    _attempt_starts(rig, kind, times)
    require_flat(rig, before, times, NO_START, STARTS)
    return before


def failing_starts_memory(rig: CameraRig, kind: str, times: int, before: Usage) -> None:
    """Fail if since ``before`` the process has kept memory of so many starts that failed."""
    again = partial(_attempt_starts, rig, kind, times)
    require_flat_memory(rig, before, again, times, NO_START, STARTS)


def _attempt_starts(rig: CameraRig, kind: str, times: int) -> None:
    for _ in range(times):
        attempt_start(rig, rig.new_device(kind))


def attempt_start(rig: CameraRig, device: str) -> None:
    """Start the driver on a ``device`` that has something wrong with it."""
    try:
        rig.subject.start(DRIVER, device)
    except StudentError:
        return
    rig.program.stop(DRIVER)
    raise Failed(
        expected=f"{DRIVER}({device!r}) raises: who starts a driver must learn that it has no "
        "picture to give.",
        actual="It made a node as if all were well.",
    )
