"""How often a camera driver sends pictures, and that it goes by the robot's clock."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from autograder.examination.exam import Failed
from autograder.exercises.resources.rig import OVER, PERIOD, STEP, CameraRig
from course.runtime.waiting import Deadline

STEPS = 10  # at least, in which a rate is counted
LONGEST_STEP = 0.4  # s: a timer that is too fast would come just once in a longer one
KEEP_UP = 0.1  # s of wall time that a picture which is due is waited for before time moves on
ARRIVES, ARRIVES_ASLEEP = 1.0, 0.6  # s, see `Patience`: a slow camera takes 0.3 s for a picture
UNPUBLISHED = 10  # pictures, read in a row while time stands still: who reads so reads all the time
STANDSTILL = 0.4  # s of wall time without two pictures: they stand still
BACKLOG = 3.0  # s of wall time in which pictures may come that had been ordered before
AT_REST = 1  # picture in a step of time that begins and ends with all at rest
AT_ONCE = 3  # pictures in a step in which one is due, and one of the step before may come
PHASE = 2  # steps, in which pictures of before may come
_SLOWLY = "the pace at which a rate was right"
SLICES = 20  # of a period, in which time moves on where it does so by and by
LATE_ASLEEP = 1.5  # s in all for pictures that are late in a count, while all sleep
PACES = (0.0, 0.6, 2.0)  # s of wall time in which the robot's time passes that is counted


class _Count(NamedTuple):
    """How many pictures came, how many are to come, and the most that came in one step."""

    came: int
    wanted: float
    tolerance: float
    most: int

    @property
    def is_right(self) -> bool:
        return abs(self.came - self.wanted) <= self.tolerance and self.most <= AT_ONCE


def require_rate(
    rig: CameraRig,
    device: str,
    rate: float,
    when: str = "",
    seconds: int = 1,
    after: Callable[[], object] = lambda: None,
) -> None:
    """Fail unless ``rate`` pictures of ``device`` come a second of simulated time, one by one.

    Each time they are counted it is ``after`` something has been done, which must not cost any.

    Where time jumps from one picture to the next, a thread that looks at the clock now and then
    loses what it sees too late. So a count that is not right is made again, as time passes on a
    robot, and once more with twice as much time; and who has once needed that is given it at once.
    """
    for pace in PACES:
        if pace < rig.memory.get(_SLOWLY, 0.0):
            continue
        after()
        count = _count_pictures(rig, device, rate, seconds, pace)
        if count.is_right:
            rig.memory[_SLOWLY] = pace
            return
    time = "one second" if seconds == 1 else f"{seconds} seconds"
    expected = f"In {time} {count.wanted:.0f} pictures come{when}."
    if abs(count.came - count.wanted) > count.tolerance:
        raise Failed(
            expected=expected,
            actual=f"In {time} of the robot's time {count.came} came{rig.error_note()}.",
        )
    raise Failed(
        expected=f"{expected[:-1]}, one after the other.",
        actual=f"There were as many, but up to {count.most} of them came at once.",
    )


def _count_pictures(rig: CameraRig, device: str, rate: float, seconds: int, pace: float) -> _Count:
    """Count pictures of ``device`` while ``seconds`` of simulated time pass.

    Time moves on picture by picture: a thread may publish a moment after the timer, and a design
    may keep one order at a time and drop the next one while it is busy. Each step is a period, or
    an even part of a long one, and a little more: see `OVER`.
    """
    wanted = rate * seconds
    steps = max(STEPS, round(wanted * math.ceil(1 / rate / LONGEST_STEP)))
    before, late, most, last = len(rig.get_pictures(device)), 0, 0, 0
    patience = rig.start_patience(LATE_ASLEEP if pace else KEEP_UP)

    def came() -> int:
        return len(rig.get_pictures(device)) - before

    for step in range(1, steps + 1):
        _move_on(rig, OVER * seconds / steps, 1 / rate / SLICES, pace / steps)
        due = int(wanted * step / steps)
        # By its phase a design may be one picture behind, and stay so: it is not waited for twice.
        moment = KEEP_UP if patience.has_time_left() else 0.0
        if not rig.wait(lambda least=due - late: came() >= least, moment):  # type: ignore[misc]
            patience.wait(rig.session, lambda least=due - 1: came() >= least)  # type: ignore[misc]
        now = came()
        late = max(0, due - now)
        most = max(most, now - last) if step > PHASE else 0
        last = now
    let_arrive(rig, device)
    # Some of those before may have been on their way: not more than come in a tenth of a second.
    return _Count(came(), wanted, max(1.0, rate / STEPS), most)


def _move_on(rig: CameraRig, seconds: float, part: float, pace: float) -> None:
    """Move simulated time on: at once, or part by part within ``pace`` s of wall time."""
    if not pace:
        rig.advance(seconds)
        return
    parts = max(1, round(seconds / part))
    for _ in range(parts):
        clock = Deadline(pace / parts)
        rig.advance(seconds / parts)
        rig.wait(lambda clock=clock: not clock.seconds_left, clock.seconds_left)  # type: ignore[misc]


def let_arrive(rig: CameraRig, device: str) -> None:
    """Wait for pictures of ``device`` that were read and are on their way.

    Not for long: a thread may read all the time, and publish just some of what it reads.
    """

    def count_read() -> int:
        return max(rig.open_cameras(device), default=0)

    def count_unpublished() -> int:
        return count_read() - len(rig.get_pictures(device))

    before = count_unpublished()

    def newest_is_here() -> bool:
        newest = [picture.number for picture in rig.get_pictures(device)[-1:]]
        return newest >= [count_read() - 1] or count_unpublished() - before >= UNPUBLISHED

    rig.start_patience(ARRIVES_ASLEEP, ARRIVES).wait(rig.session, newest_is_here)


def require_own_clock(rig: CameraRig, device: str) -> None:
    """Fail if pictures of ``device`` come while the robot's time stands still, or many at once.

    Only those that are published: a thread may read the camera all the time, and a timer publish
    the newest picture. How many come at once is seen here, where they are waited for until all is
    at rest and no more come; while pictures are counted, time moves on, and they may come in the
    midst of that.
    """
    for _ in PACES:
        came = _at_once(rig, device)
        if came <= AT_REST:
            return
    raise Failed(
        expected="The pictures come one by one, 10 a second.",
        actual=f"In a tenth of a second of the robot's time {came} of them came.",
    )


def _at_once(rig: CameraRig, device: str) -> int:
    """Return how many pictures come in the next step of time in which there are any."""
    rig.wait_for_rest()  # one of before may be on its way
    before = len(rig.get_pictures(device))
    for _ in range(STEPS):
        rig.advance(STEP)
        rig.wait_for_rest()
        if rig.wait(lambda: len(rig.get_pictures(device)) > before, KEEP_UP):
            break
    _require_standstill(rig, device)
    return len(rig.get_pictures(device)) - before


def _require_standstill(rig: CameraRig, device: str) -> None:
    deadline = Deadline(BACKLOG)
    while deadline.seconds_left:
        rig.wait_for_rest()
        before = len(rig.get_pictures(device))
        if not rig.wait(lambda n=before: len(rig.get_pictures(device)) >= n + 2, STANDSTILL):  # type: ignore[misc]
            return
    raise Failed(
        expected="The pictures are timed by a ROS timer, or by the node's clock.",
        actual="Pictures came although the robot's time, which is simulated, stood still.",
    )


def require_tick_zoom(rig: CameraRig, device: str, factor: int, when: str) -> None:
    """Fail unless pictures that nobody asks for have the zoom ``factor``, too."""
    before = len(rig.get_pictures(device))
    for _ in range(2 * STEPS):
        rig.advance(STEP)
        if rig.wait(
            lambda: any(p.zoom == factor for p in rig.get_pictures(device)[before:]),
            PERIOD,
        ):
            return
    raise Failed(
        expected=f"{when} the ten pictures a second have a zoom of {factor} as well.",
        actual=f"They had a zoom of {rig.get_pictures(device)[-1].zoom}{rig.error_note()}.",
    )
