"""The experiment of many lives: does the process grow with every driver that is started and ended?

One life proves little: a thread may still be ending, a library fills its caches, a notebook has
threads of its own. What grows with each of 50 lives, in both halves of them, is a leak.
"""

from __future__ import annotations

import time
from typing import NamedTuple

from autograder.exercises.resources.camera_duties import DRIVER
from autograder.exercises.resources.camera_usage import Usage
from autograder.exercises.resources.rig import ENDED, PERIOD, STEP, CameraRig
from autograder.observe.patience import SETTLE_S
from course.runtime.waiting import Deadline

WARM_UP, FEWEST, LIVES = 1, 6, 50
"""Lives: at first, and then at least (a camera may need a second to get warm), and at most."""
TIME = 2.0
"""Seconds of wall time for all lives after the warm-up, if more than the fewest are to be made."""
MEMORY = 100  # KiB a life
NOISE = 640  # KiB that few lives may differ by: an allocator takes memory by the piece
PICTURES = 5  # a life, of 64 KiB
POOLED = 24
"""Lives after which a participant of DDS that stays, as that of a node which a cell has made, keeps
no more of others that have come and gone: Fast DDS keeps 200 KiB each for the next one, of 15."""


def run_lives(rig: CameraRig, lives: int) -> None:
    """Start and end the driver ``lives`` times, then collect what is garbage."""
    device = rig.new_device()
    for _ in range(lives):
        rig.program.start(DRIVER, device)
        _take_pictures(rig, device)
        rig.program.stop(DRIVER)
        # A thread of the driver may close the camera a moment later.
        rig.wait(lambda: not rig.open_cameras(device), idle=ENDED)
    rig.subject.collect()


def _take_pictures(rig: CameraRig, device: str) -> None:
    """Let the driver take some pictures: who keeps them is known by their number.

    A timer takes all of them as time moves on. A thread that keeps one order at a time may take
    just one meanwhile; then time moves on step by step, and each step waits for a picture.
    """

    def asked() -> int:
        return sum(rig.open_cameras(device))

    rig.advance(PICTURES * STEP)
    for _ in range(PICTURES):
        before = asked()
        if before >= PICTURES:
            return
        rig.advance(STEP)
        rig.wait(lambda before=before: asked() > before, PERIOD)  # type: ignore[misc]


class Growth(NamedTuple):
    """What a process has grown by in so many lives: the least of some times, item by item."""

    usage: Usage
    lives: int
    times: int = 1

    @property
    def lives_made(self) -> int:
        """How many lives there were, the warm-up aside."""
        return self.times * self.lives

    def and_in(self, usage: Usage) -> Growth:
        """Return the same with what it has grown by in as many lives more."""
        return Growth(Usage(*map(min, self.usage, usage)), self.lives, self.times + 1)

    def list_leaks(self) -> list[str]:
        """Return what these lives leaked, a phrase each."""
        return _list_leaks(self.usage, self.lives)


def measure_growth(rig: CameraRig) -> Growth:
    """Return what the process has grown by in 25 lives, or in as many as there is time for."""
    began = time.monotonic()
    run_lives(rig, WARM_UP)
    pace = (time.monotonic() - began) / WARM_UP
    lives = max(FEWEST, min(LIVES, int(TIME / pace))) // 2
    first, late = _measure_lives(rig, lives), Deadline(SETTLE_S)
    grown = Growth(first, lives).and_in(_measure_lives(rig, lives, late))
    while grown.lives_made < POOLED and grown.usage.memory >= _most_memory(lives):
        grown = grown.and_in(_measure_lives(rig, lives))
    return grown


def _measure_lives(rig: CameraRig, lives: int, late: Deadline | None = None) -> Usage:
    """Return what the process has grown by in so many lives.

    A thread that looks every few seconds whether it is to end is too slow, and no leak: those of
    lives before these may wake up until ``late``.
    """
    before, threads = rig.process.read_usage(), rig.process.thread_ids()
    run_lives(rig, lives)

    def over() -> bool:
        return not _list_leaks(rig.process.read_usage().growth_since(before), lives)

    if not rig.wait_for_end(over) and late is not None:
        wakes = rig.process.wake_times(threads)
        rig.wait(over, min(late.seconds_left, max(wakes) + ENDED) if wakes else 0.0)
    return rig.process.read_usage().growth_since(before)


def _list_leaks(grown: Usage, lives: int) -> list[str]:
    found = []
    if grown.threads >= lives / 2:
        found.append(f"{_count_word(grown.threads / lives)} of its threads")
    if grown.files >= lives / 2:
        found.append(f"{_count_word(grown.files / lives)} of its open files")
    if grown.memory >= _most_memory(lives):
        found.append(f"{grown.memory // lives} KiB of memory")
    return found


def _most_memory(lives: int) -> int:
    return max(NOISE, lives * MEMORY)


def _count_word(a_life: float) -> str:
    return {1: "one", 2: "two"}.get(round(a_life), "some")
