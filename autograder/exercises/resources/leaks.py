"""What many rounds of one thing leave in the process: lives, snapshots, zooms, starts that fail."""

from __future__ import annotations

from autograder.exercises.resources.driver import Driver, attempt_start, start_driver
from autograder.exercises.resources.rig import DRIVER, PERIOD_S, STEP_S, CameraRig, new_device
from autograder.observe.lifecycle.flat_rounds import require_flat
from autograder.observe.lifecycle.observer import ENDED_S
from autograder.observe.lifecycle.process_holdings import Usage

PICTURES = 5
"""A life, of 64 KiB: who keeps them is known by their number."""
WORK = 20
"""Snapshots in one life, or refused zooms."""
STARTS, START_KIB = 3, 1024
"""Starts that fail: the memory of fewer is not told from noise. And KiB that each may keep."""
MOMENT_S = 0.01
"""Seconds of simulated time, in which what has come is taken up."""


def live_shortly(rig: CameraRig) -> None:
    """Start a driver, have it take some pictures, and end it.

    A timer takes all of them as time moves on. A thread that keeps one order at a time may take
    just one meanwhile; then time moves on step by step, and each step waits for a picture.
    """
    driver = start_driver(rig)
    rig.advance(PICTURES * STEP_S)
    for _ in range(PICTURES):
        if (before := driver.count_asked()) >= PICTURES:
            break
        rig.advance(STEP_S)
        rig.wait(lambda least=before: driver.count_asked() > least, PERIOD_S)  # type: ignore[misc]
    end_driver(driver)


def end_driver(driver: Driver) -> None:
    """End a driver; a thread of it may close the camera a moment later."""
    driver.rig.stop(DRIVER)
    driver.rig.wait(lambda: not driver.asked(), idle=ENDED_S)


def require_flat_snapshots(rig: CameraRig) -> None:
    """Fail if a life with many snapshots leaves threads or files behind.

    A life of its own: an answer of a service costs more than all the rest of a short one.
    """
    before, driver = rig.process.read_usage(), start_driver(rig)
    driver.require_picture()
    for _ in range(WORK):
        driver.require_snapshot()
    end_driver(driver)
    require_flat_work(rig, before, "snapshots")


def refuse_zooms(driver: Driver) -> None:
    """Send many zooms that the camera refuses; each is taken up before the next one."""
    for _ in range(WORK):
        driver.refuse_zoom()
        driver.rig.advance(MOMENT_S)


def require_flat_work(rig: CameraRig, before: Usage, work: str) -> None:
    """Fail if a life with much ``work``, now over, has left threads or files behind."""
    expected = f"What {work} take is given back by the end of a life: no thread and no file stays."
    what = f"{work} and the end of the driver"
    require_flat(rig, before, WORK, what=what, expected=expected)


def require_flat_starts(rig: CameraRig, kind: str, *, memory: bool = False) -> None:
    """Fail if starts that fail leave threads or files behind, or ``memory``, with a ``kind``."""

    def attempt_starts() -> None:
        for _ in range(STARTS):
            attempt_start(rig, new_device(kind))
            along.append(rig.process.read_usage())

    before = rig.process.read_usage()
    along = [before]
    attempt_starts()
    expected = "A driver that cannot start leaves nothing behind: no thread, no file, and less than"
    require_flat(
        rig, before, STARTS, what="such starts", expected=f"{expected} 1 MiB of memory each.",
        kib_each=START_KIB if memory else 0, again=attempt_starts if memory else None,
        along=along,
    )  # fmt: skip
