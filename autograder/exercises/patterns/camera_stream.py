"""The camera: how many pictures are published, even if some are lost on the way, and what they are.

A picture of more than 200 kB comes in so many packets that a best-effort link on a busy machine
loses some pictures. That is not the student's doing: what counts is what was published. So the
numbers that the writer gives its pictures tell how many there were at least and at most, and where
these bounds prove nothing yet, more is listened to.
"""

from __future__ import annotations

import math
import time
from itertools import pairwise

from rclpy.qos import ReliabilityPolicy

from autograder.examination.exam import Failed
from autograder.exercises.patterns.hardware import Picture
from autograder.exercises.patterns.rig import STEP, RobotRig
from autograder.exercises.patterns.scenarios import NAMES
from course.runtime.waiting import Deadline

RATE = (9.0, 11.0)
"""Pictures a second."""
PATIENCE = 1.0
"""Seconds of wall time that a stream may lag behind its clock in all, while it is counted."""
NUDGE = 0.1
"""Seconds of wall time after which a thread may have missed that time has moved."""
LOST = 0.05
"""Seconds of wall time for one picture, where some have been lost on the way."""
NEXT, NEXT_LOSSY = 2.0, 10.0
"""Seconds of the node's time within which another picture comes: of a best-effort stream of large
pictures a slow machine has been seen to lose more than 20 in a row."""
LONGEST = 12.0
"""Seconds of the node's time after which what is not proved to be wrong is right."""


class Stretch:
    """A stretch of the node's time, beginning now, and the pictures that are published in it."""

    def __init__(self, rig: RobotRig) -> None:
        """Begin."""
        self._rig = rig
        self._pictures = rig.node.pictures
        self._began, self._since = time.time_ns(), rig.elapsed
        self._seen: list[Picture] = []
        self._numbered = False
        self._budget = PATIENCE

    @property
    def elapsed_seconds(self) -> float:
        """How long it is by now, in the node's time."""
        return round(self._rig.elapsed - self._since, 3)

    @property
    def is_numbered(self) -> bool:
        """Whether `measure_rates` knew of each picture, also of those that were lost on the way."""
        return self._numbered

    def run(self, seconds: float, hertz: float) -> None:
        """Let the node's clock go on, step by step; each step waits for the picture that is due.

        So a publisher in a thread of its own gets its turn as well as a timer does.
        """
        pictures, before, first = self._pictures, self._count_published(), self._rig.elapsed
        for _ in range(round(seconds / STEP)):
            self._rig.step()
            spent = self._rig.elapsed - first
            due = before + math.floor(spent * hertz + 1e-6) - 1  # one may be on its way
            lossy = pictures and self._count_published() > len(pictures)
            patience = Deadline(LOST if lossy else self._budget)
            self._await_pictures(due, patience)
            if not lossy:
                self._budget = patience.seconds_left

    def _await_pictures(self, due: int, patience: Deadline) -> None:
        """Wait until so many pictures have been published, the clock standing still.

        A thread that rclpy put to sleep just when its time came sleeps until time moves again.
        """
        while not self._rig.wait(
            lambda: self._count_published() >= due, min(NUDGE, patience.seconds_left)
        ):
            if not patience.seconds_left:
                return
            self._rig.nudge()

    def _count_published(self) -> int:
        """Return how many pictures have been published since the first that was heard."""
        pictures = self._pictures
        if not pictures:
            return 0
        return max(len(pictures), pictures[-1].number - pictures[0].number + 1)

    def measure_rates(self) -> tuple[float, float] | None:
        """Return how many pictures a second there have been, at least and at most.

        The next one, for which the clock goes on, proves that all before it have come or are lost.
        None if none comes any more.
        """
        ended, seconds = time.time_ns(), self.elapsed_seconds
        if not wait_for_picture(self._rig, ended):
            return None
        before = [picture for picture in self._pictures if picture.published < self._began][-1:]
        since = [picture for picture in self._pictures if picture.published >= self._began]
        self._seen = [picture for picture in since if picture.published < ended]
        next_one = since[len(self._seen)]
        fewest = most = len(self._seen)
        self._numbered = self._are_numbered([*before, *self._seen, next_one])
        if self._numbered:
            fewest = self._seen[-1].number - self._seen[0].number + 1 if self._seen else 0
            most = next_one.number - (before[0].number if before else 0) - 1
        return fewest / seconds, most / seconds

    def measure_pace(self) -> tuple[float, float]:
        """Return how many there were a second, at least and at most, from the first seen on.

        Where many are lost this says more than `measure_rates`, which do not know what was lost at
        the ends. It needs these to have been found out.
        """
        if not self._numbered or len(self._seen) < 2:
            return 0.0, math.inf
        first, last = self._seen[0], self._seen[-1]
        earliest, early = self._rig.clock_at(first.published)
        late, latest = self._rig.clock_at(last.published)
        many, shortest = last.number - first.number, late - early
        return many / (latest - earliest), many / shortest if shortest > 0 else math.inf

    def _are_numbered(self, pictures: list[Picture]) -> bool:
        """Return whether the numbers count the pictures: a second writer counts for itself."""
        numbers = [picture.number for picture in pictures]
        growing = all(one < other for one, other in pairwise(numbers))
        return growing and numbers[0] > 0 and self._rig.node.count_publishers(NAMES["camera"]) == 1


def wait_for_picture(rig: RobotRig, moment: int) -> bool:
    """Let the clock go on until a picture comes that was published after a ``moment`` (ns)."""
    pictures = rig.node.pictures
    return rig.wait_stepping(
        lambda: pictures and pictures[-1].published > moment, picture_timeout(rig)
    )


def picture_timeout(rig: RobotRig) -> float:
    """Return within how many seconds of the node's time a picture comes, if any does."""
    offers = rig.node.get_publishers_info_by_topic(NAMES["camera"])
    reliable = all(o.qos_profile.reliability == ReliabilityPolicy.RELIABLE for o in offers)
    return NEXT if reliable else NEXT_LOSSY


def require_rate(rig: RobotRig, seconds: float, allowed: tuple[float, float]) -> None:
    """Fail unless so many pictures a second are published, by the node's clock.

    Args:
        rig: the rig.
        seconds: for which the clock goes on, and again as long as nothing is proved.
        allowed: how many a second there must be, and may be.
    """
    stretch = Stretch(rig)
    while stretch.elapsed_seconds < LONGEST:
        stretch.run(seconds, sum(allowed) / 2)
        rates = stretch.measure_rates()
        least, greatest = allowed
        if rates is None:
            raise Failed(
                expected=f"{least:g} to {greatest:g} pictures a second, for as long as it is on.",
                actual=f"Some came, and then not one more in {picture_timeout(rig):g} s of the "
                f"node's time{rig.error_note()}.",
            )
        fewest, most = rates
        if wrong := rate_fault(rates, allowed):
            raise Failed(
                expected=f"{least:g} to {greatest:g} pictures a second, by the node's clock.",
                actual=f"They came at {wrong} a second.",
            )
        slowest, fastest = stretch.measure_pace()
        if least <= max(fewest, slowest) and min(most, fastest) <= greatest:
            return


def rate_fault(rates: tuple[float, float], allowed: tuple[float, float]) -> str:
    """Return how many there were a second if that is proved to be wrong, or an empty string."""
    fewest, most = rates
    if fewest <= allowed[1] and most >= allowed[0]:
        return ""
    return f"{fewest:.3g}" if fewest == most else f"{fewest:.3g} to {most:.3g}"


def picture_fault(picture: Picture) -> str:
    """Return what is wrong with a picture, or an empty string."""
    if not picture.height or not picture.width or not picture.size:
        return f"It is empty: {picture.width} x {picture.height}, {picture.size} bytes."
    if picture.size != picture.height * picture.step:
        return (
            f"It has {picture.size} bytes, which are not {picture.height} rows of "
            f"{picture.step} bytes (step)."
        )
    return ""
