"""The rate of messages whose node may need threads of its own for each: time waits for them.

`Span.require_rate` counts what has come when both sides rest. Here time moves on from one message
to the next, and each is waited for: a thread may publish a moment after its timer, and a design may
keep one order at a time and drop the next one while it is busy.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

from autograder.examination.exam import Failed
from autograder.observe.findings import rate_picture, with_picture
from autograder.observe.lifecycle.node_lives import NodeLives
from course.runtime.waiting import Deadline

STEPS = 10
"""Steps of time, at least, in which a rate is counted."""
LONGEST_STEP_S = 0.4
"""Seconds of a step: a timer that is too fast would come just once in a longer one."""
OVER = 1.01
"""Of a period, that time moves on by for a message: to a thread that looks at the clock in float
seconds, exactly one period may not be over yet."""
KEEP_UP_S = 0.1
"""Seconds of wall time that a message which is due is waited for before time moves on."""
LATE_ASLEEP_S = 1.5
"""Seconds in all for messages that are late in a count, while all sleep."""
PHASE = 2
"""Steps, in which messages of before may come."""
AT_ONCE = 3
"""Messages in a step in which one is due, and one of the step before may come."""
PACES_S = (0.0, 0.6, 1.5)
"""Seconds of wall time in which the time passes that is counted."""
SLICES = 20
"""Of a period, in which time moves on where it does so by and by."""
BACKLOG_S, STANDSTILL_S = 3.0, 0.4
"""Seconds of wall time in which messages may come that had been ordered before; and without two of
them, after which they stand still."""
_SLOWLY = "the pace at which a rate was right"


@dataclass(frozen=True)
class StepCount:
    """How many messages came in steps of time, how many were wanted, and the most in one step.

    Example:
        >>> StepCount(came=9, wanted=10, most=2).is_right
        True
        >>> StepCount(came=10, wanted=10, most=5).is_right
        False
    """

    came: int
    wanted: float
    most: int
    hz: float = 10.0
    times_s: tuple[float, ...] = ()
    """When they came, each known to a step; a picture shows it."""

    @property
    def is_number_right(self) -> bool:
        """Whether about as many came: as many may be under way as come in a tenth of a second."""
        return abs(self.came - self.wanted) <= max(1.0, self.hz / STEPS)

    @property
    def is_right(self) -> bool:
        """Whether about as many came, one by one."""
        return self.is_number_right and self.most <= AT_ONCE


@dataclass(frozen=True)
class MessageCounter:
    """Counts messages of one topic while the time of the node that publishes them is moved.

    Attributes:
        lives: of the node.
        count: returns how many have come so far.
        let_arrive: waits for messages that are on their way.
        what: what they are called: "pictures".

    Example::

        counter = MessageCounter(lives, lambda: len(pictures), wait_for_the_last, "pictures")
        counter.require_rate(10.0, " after a snapshot", after=take_snapshot)
    """

    lives: NodeLives
    count: Callable[[], int]
    let_arrive: Callable[[], object]
    what: str = "messages"

    def require_rate(
        self,
        hz: float,
        when: str = "",
        *,
        seconds: int = 1,
        after: Callable[[], object] | None = None,
    ) -> None:
        """Require a rate by the node's clock, one message after the other.

        Where time jumps from one message to the next, a thread that looks at the clock now and then
        loses what it sees too late. So a count that is not right is made again, as time passes on a
        robot, and once more with twice as much time; and who has once needed that is given it at
        once.

        Args:
            hz: messages a second.
            when: what is special about it, to end a sentence with: " after a snapshot".
            seconds: of the node's time, in which they are counted.
            after: is done before each count, and must not cost any.

        Raises:
            Failed: it is another rate, or they come many at once.
        """
        for pace in PACES_S:
            if pace < self.lives.memory.get(_SLOWLY, 0.0):
                continue
            if after is not None:
                after()
            count = self._count_steps(hz, seconds, pace)
            if count.is_right:
                self.lives.memory[_SLOWLY] = pace
                return
        title = f"{self.what.capitalize()}, by the robot's clock"
        with with_picture(lambda: rate_picture(title, count.times_s, hz, seconds)):
            self._refuse(count, seconds, when)

    def _refuse(self, count: StepCount, seconds: int, when: str) -> NoReturn:
        time = "one second" if seconds == 1 else f"{seconds} seconds"
        expected = f"In {time} {count.wanted:.0f} {self.what} come{when}"
        if not count.is_number_right:
            raise Failed(
                expected=f"{expected}.",
                actual=f"In {time} of the robot's time {count.came} came{self.lives.error_note()}.",
            )
        raise Failed(
            expected=f"{expected}, one after the other.",
            actual=f"There were as many, but up to {count.most} of them came at once.",
        )

    def _count_steps(self, hz: float, seconds: int, pace: float) -> StepCount:
        """Count messages while so many seconds of simulated time pass.

        Each step is a period, or an even part of a long one, and a little more: see `OVER`.
        """
        lives, wanted = self.lives, hz * seconds
        steps = max(STEPS, round(wanted * math.ceil(1 / hz / LONGEST_STEP_S)))
        before, late, most, last = self.count(), 0, 0, 0
        times_s: list[float] = []
        patience = lives.start_patience(LATE_ASLEEP_S if pace else KEEP_UP_S)
        for step in range(1, steps + 1):
            self._move_on(OVER * seconds / steps, 1 / hz / SLICES, pace / steps)
            due = before + int(wanted * step / steps)

            def have_come(least: int) -> bool:
                return self.count() >= least

            # By its phase a design may be one behind, and stay so: it is not waited for twice.
            moment = KEEP_UP_S if patience.has_time_left() else 0.0
            if not lives.wait(lambda least=due - late: have_come(least), moment):  # type: ignore[misc]
                patience.wait(lives.session, lambda least=due - 1: have_come(least))  # type: ignore[misc]
            now = self.count()
            late = max(0, due - now)
            most = max(most, now - last) if step > PHASE else 0
            times_s += [seconds * step / steps] * (now - max(last, before))
            last = now
        self.let_arrive()
        return StepCount(self.count() - before, wanted, most, hz, tuple(times_s))

    def _move_on(self, seconds: float, part: float, pace: float) -> None:
        """Move simulated time on: at once, or part by part within ``pace`` s of wall time."""
        parts = max(1, round(seconds / part)) if pace else 1
        for _ in range(parts):
            clock = Deadline(pace / parts)
            self.lives.advance(seconds / parts)
            while left := clock.seconds_left:
                self.lives.wait(lambda: False, left)

    def require_one_by_one(self, hz: float) -> None:
        """Require that messages stand still with the node's time, and one comes in a period of it.

        Only those that are published count: a thread may work all the time, and a timer publish the
        newest it has. All that come in a period are seen, as they are waited for until all is at
        rest; while a rate is counted, time moves on, and they may come in the midst of that.

        Args:
            hz: messages a second.

        Raises:
            Failed: they come while time stands still, or many at once.
        """
        for _ in PACES_S:
            if (came := self._count_of_a_period(1 / hz)) <= 1:
                return
        raise Failed(
            expected=f"The {self.what} come one by one, {hz:g} a second.",
            actual=f"In {1 / hz:g} s of the robot's time {came} of them came.",
        )

    def _count_of_a_period(self, period: float) -> int:
        """Return how many messages come in the next period in which there are any."""
        self.lives.wait_for_rest()  # one of before may be on its way
        before = self.count()
        for _ in range(STEPS):
            self.lives.advance(OVER * period)
            self.lives.wait_for_rest()
            if self.lives.wait(lambda: self.count() > before, KEEP_UP_S):
                break
        deadline = Deadline(BACKLOG_S)
        while deadline.seconds_left:
            self.lives.wait_for_rest()
            more = self.count() + 2
            if not self.lives.wait(lambda least=more: self.count() >= least, STANDSTILL_S):  # type: ignore[misc]
                return self.count() - before
        raise Failed(
            expected=f"The {self.what} are timed by a ROS timer, or by the node's clock.",
            actual=f"{self.what.capitalize()} came although the robot's time, which is simulated, "
            "stood still.",
        )
