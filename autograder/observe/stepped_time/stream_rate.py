"""How many messages a second a node publishes, even if some of them are lost on the way.

A message of more than 200 kB comes in so many packets that a best-effort link on a busy machine
loses some. That is not the node's doing: what counts is what was published. So the numbers that the
writer gives its messages (DDSI-RTPS 2.3, 8.3.5.4) tell how many there were at least and at most,
and where these bounds prove nothing yet, more is listened to.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from rclpy.qos import ReliabilityPolicy

from autograder.examination.exam import Failed
from autograder.examination.pictures.picture import Timeline
from autograder.observe.examiner.merged_subscriptions import MergedSubscription, Publication
from autograder.observe.findings import rate_picture, with_picture
from autograder.observe.nouns import Topic
from autograder.observe.stepped_time.stepped_observer import STEP_S, SteppedObserver
from course.runtime.waiting import Deadline

LAG_S = 1.0
"""Seconds of wall time that a stream may lag behind its clock in all, while it is counted."""
NUDGE_S = 0.1
"""Seconds of wall time after which a thread may have missed that time has moved."""
LOST_S = 0.05
"""Seconds of wall time for one message, where some have been lost on the way."""
NEXT_S, NEXT_LOSSY_S = 2.0, 10.0
"""Seconds of the node's time within which another message comes: of a best-effort stream of large
ones a slow machine has been seen to lose more than 20 in a row."""
FROZEN_S = 0.6
"""Seconds of wall time in which the node's clock stands still for those who go by the wall's."""
LONGEST_S = 12.0
"""Seconds of the node's time after which what is not proved to be wrong is right."""

Allowed = tuple[float, float]
"""How many messages a second there must be, and may be."""


class StreamRate(NamedTuple):
    """Bounds of a rate, in messages a second.

    The first two are of the whole stretch, of which it is not known what was lost at its ends. The
    others are of the time from the first message seen to the last: where many are lost they prove
    more, but a message that came late is not spread over a whole stretch.

    Example:
        >>> rate = StreamRate(fewest_hz=4.5, most_hz=5.0)
        >>> rate.fault((9.0, 11.0)), rate.fault((5.0, 6.0))
        ('4.5 to 5', '')
        >>> rate.is_proved((5.0, 6.0)), rate.is_proved((4.0, 6.0))
        (False, True)
    """

    fewest_hz: float
    most_hz: float
    slowest_hz: float = 0.0
    fastest_hz: float = math.inf
    is_numbered: bool = False
    """Whether each message was known of, also those that were lost on the way."""

    def fault(self, allowed: Allowed) -> str:
        """Return the rate if it is proved to be wrong, or an empty string."""
        if self.fewest_hz <= allowed[1] and self.most_hz >= allowed[0]:
            return ""
        if self.fewest_hz == self.most_hz:
            return f"{self.fewest_hz:.3g}"
        return f"{self.fewest_hz:.3g} to {self.most_hz:.3g}"

    def require(self, topic: Topic, allowed: Allowed) -> None:
        """Require that it is not proved to be wrong.

        Raises:
            Failed: it is.
        """
        if wrong := self.fault(allowed):
            raise Failed(
                expected=f"{allowed[0]:g} to {allowed[1]:g} messages a second come on {topic}, by "
                "the node's clock.",
                actual=f"They came at {wrong} a second.",
            )

    def is_proved(self, allowed: Allowed) -> bool:
        """Return whether it is proved to be right."""
        least, most = max(self.fewest_hz, self.slowest_hz), min(self.most_hz, self.fastest_hz)
        return allowed[0] <= least and most <= allowed[1]


def are_numbered(publications: Sequence[Publication]) -> bool:
    """Return whether the writer's numbers count these: a second writer counts for itself."""
    numbers = [publication.number for publication in publications]
    return numbers[0] > 0 and all(one < other for one, other in pairwise(numbers))


def count_published(publications: Sequence[Publication]) -> int:
    """Return how many have been published since the first that was heard, with those lost."""
    if not publications:
        return 0
    return max(len(publications), publications[-1].number - publications[0].number + 1)


class StreamStretch:
    """A stretch of the node's time, beginning now, and what is published on a topic in it.

    Attributes:
        observer: whose time passes.
        stream: listens to the topic.
    """

    def __init__(self, observer: SteppedObserver, stream: MergedSubscription) -> None:
        """Begin; ``stream`` listens to the topic."""
        self.observer, self.stream = observer, stream
        self._began_ns, self._began_s = time.time_ns(), observer.elapsed_s
        self._lag_s = LAG_S

    @property
    def seconds(self) -> float:
        """How long it is by now, in the node's time."""
        return round(self.observer.elapsed_s - self._began_s, 3)

    def run(self, seconds: float, hz: float) -> None:
        """Let the node's time pass, step by step; each step waits for the message that is due.

        So a publisher in a thread of its own gets its turn as well as a timer does.

        Args:
            seconds: of the node's time.
            hz: about how many messages a second are expected.
        """
        before = count_published(self.stream.publications)
        for number in range(1, round(seconds / STEP_S) + 1):
            self.observer.step()
            due = before + math.floor(number * STEP_S * hz + 1e-6) - 1  # one may be on its way
            heard = self.stream.publications
            is_lossy = count_published(heard) > len(heard)
            deadline = Deadline(LOST_S if is_lossy else self._lag_s)
            self._await_publications(due, deadline)
            if not is_lossy:
                self._lag_s = deadline.seconds_left

    def _await_publications(self, due: int, deadline: Deadline) -> None:
        # A thread that rclpy put to sleep just when its time came sleeps until time moves again.
        while not self.observer.wait(
            lambda: count_published(self.stream.publications) >= due,
            min(NUDGE_S, deadline.seconds_left),
        ):
            if not deadline.seconds_left:
                return
            self.observer.host.source.nudge()

    def measure(self) -> StreamRate | None:
        """Return at which rate there have been messages, or None if none comes any more.

        The next one, for which the node's time goes on, proves that all before it have come or are
        lost.
        """
        ended_ns, seconds = time.time_ns(), self.seconds
        if not await_publication(self.observer, self.stream, ended_ns):
            return None
        heard = self.stream.publications
        before = [one for one in heard if one.published_ns < self._began_ns][-1:]
        seen = [one for one in heard if self._began_ns <= one.published_ns < ended_ns]
        following = next(one for one in heard if one.published_ns >= max(ended_ns, self._began_ns))
        writers = self.observer.node.count_publishers(str(self.stream.topic))
        if writers != 1 or not are_numbered([*before, *seen, following]):
            return StreamRate(len(seen) / seconds, len(seen) / seconds)
        fewest = seen[-1].number - seen[0].number + 1 if seen else 0
        most = following.number - (before[0].number if before else 0) - 1
        return StreamRate(fewest / seconds, most / seconds, *self._measure_pace(seen), True)

    def draw(self, hz: float) -> Timeline:
        """Return a picture of what came, beside what was due at a rate."""
        heard = [one for one in self.stream.publications if one.published_ns >= self._began_ns]
        times_s = [self.observer.clock_at(one.published_ns)[1] - self._began_s for one in heard]
        title = f"Messages on {self.stream.topic}, by the node's clock"
        return rate_picture(title, times_s, hz, self.seconds)

    def _measure_pace(self, seen: Sequence[Publication]) -> tuple[float, float]:
        if len(seen) < 2:
            return 0.0, math.inf
        earliest_s, early_s = self.observer.clock_at(seen[0].published_ns)
        late_s, latest_s = self.observer.clock_at(seen[-1].published_ns)
        many = seen[-1].number - seen[0].number
        shortest_s = late_s - early_s
        return many / (latest_s - earliest_s), many / shortest_s if shortest_s > 0 else math.inf


def await_publication(
    observer: SteppedObserver, stream: MergedSubscription, moment_ns: int
) -> bool:
    """Let the node's time pass until something comes that was published after a moment.

    Returns:
        Whether it did, within `longest_gap_s`.
    """
    return observer.wait_stepping(
        lambda: stream.newest_ns > moment_ns, longest_gap_s(observer, stream)
    )


def longest_gap_s(observer: SteppedObserver, stream: MergedSubscription) -> float:
    """Return within how many seconds of the node's time a message comes, if any does."""
    offers = observer.node.get_publishers_info_by_topic(str(stream.topic))
    reliable = all(o.qos_profile.reliability == ReliabilityPolicy.RELIABLE for o in offers)
    return NEXT_S if reliable else NEXT_LOSSY_S


def require_stream(
    observer: SteppedObserver, stream: MergedSubscription, allowed: Allowed, seconds: float
) -> None:
    """Require that so many messages a second are published, by the node's clock and no other.

    Args:
        observer: whose time passes meanwhile.
        stream: listens to the topic.
        allowed: how many a second there must be, and may be.
        seconds: for which the node's time passes, and again as long as nothing is proved.

    Raises:
        Failed: there are more or fewer, or none comes at all, or any more.
    """
    topic, since_ns = stream.topic, observer.still_since_ns
    needed = f"{allowed[0]:g} to {allowed[1]:g} messages a second come on {topic}, by themselves."
    left_s = FROZEN_S - (time.time_ns() - since_ns) / 1e9
    # One may have been under way. A publisher that goes by the wall's clock sends more.
    if observer.wait(lambda: stream.count_since(since_ns) > 1, left_s):
        raise Failed(
            expected=f"{needed} The node's clock sets the pace, as a timer of the node does.",
            actual="Messages were published while the node's clock stood still.",
        )
    if not await_publication(observer, stream, since_ns):
        raise Failed(
            expected=needed,
            actual=f"Not one came in {longest_gap_s(observer, stream):g} s of the node's time"
            f"{observer.error_note()}.",
        )
    stretch = StreamStretch(observer, stream)
    with with_picture(lambda: stretch.draw(sum(allowed) / 2)):
        _require_proof(stretch, allowed, seconds, needed)


def _require_proof(stretch: StreamStretch, allowed: Allowed, seconds: float, needed: str) -> None:
    """Have a stretch go on until it proves a rate that is allowed; fail if it proves another."""
    observer, stream = stretch.observer, stretch.stream
    while stretch.seconds < LONGEST_S:
        stretch.run(seconds, sum(allowed) / 2)
        rate = stretch.measure()
        if rate is None:
            raise Failed(
                expected=needed,
                actual=f"Some came, and then not one more in {longest_gap_s(observer, stream):g} s "
                f"of the node's time{observer.error_note()}.",
            )
        rate.require(stream.topic, allowed)
        if rate.is_proved(allowed):
            return
