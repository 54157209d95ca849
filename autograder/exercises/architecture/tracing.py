"""Pouring dye into a design: marked goals and messages go in, and it is seen where they come out.

The examiner behaves as a robot's surroundings do: scans go on and on, sensors wake the nodes, a
goal is under way while the robot looks out for obstacles, and whoever wants another goal cancels
the one before.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy

from autograder.exercises.architecture.goal_sender import (
    NEARER,
    SETTLE,
    WAYPOINT,
    Errands,
    marked_message,
)
from autograder.exercises.architecture.robot_graph import Topic
from autograder.exercises.architecture.robot_roles import EYES
from autograder.observe.marked_types import load_type
from course.design import message_tags
from course.design.lifelike import FAR_M, lifelike_message
from course.errors import WaitTimeout
from course.runtime.core_session import CoreSession

POURS = 8
"""How often dye is poured in before it counts as lost, each time with another tag."""
ARRIVALS = 2
"""How many of the tags must arrive: one could be a lucky guess of somebody who makes tags up."""
FEW = 100
"""So many numbers that look like tags may have other reasons: a guess would hit one in 10^5."""
REPEAT = 0.02
"""Seconds until a marked message is sent again: a node may work on the newest now and then."""
AT_ONCE = 0.005
"""Seconds until it may be sent again because somebody else's message was newer than it."""
WAKE = 0.6
"""Seconds until the other sensors send again: a node looks at the newest twice a second, or more
often, and until then what was poured in must be the newest on its way."""
PLANNING, SLOW = 4.0, 3
"""Seconds for each of the last goals, and how many that are, if nothing has come of those before: a
planner may think for a while, and a navigator drop what is cancelled before it has a plan."""
BLIND = 3
"""Goals before scans and images go on, too: a robot with something in its way may stand still."""


class GoalRejectedError(Exception):
    """The action server took none of the goals."""


@dataclass(frozen=True)
class Poured:
    """What became of the dye: whether enough of it arrived, and what is told if it did not."""

    enough: bool
    marks: int
    arrived: int
    lost_on: list[str]
    """Topics on which marks were seen that did not arrive."""
    tags: frozenset[int] = frozenset()
    """The marks that arrived."""
    aside: str = ""
    """What became of goals that were not taken."""
    turned_away: int = 0
    """Goals that were rejected although one had been taken before, and was over."""

    def combine_with(self, later: Poured) -> Poured:
        """Return what became of both this and ``later``, of which enough must have arrived, too."""
        marks, arrived = self.marks + later.marks, self.arrived + later.arrived
        return replace(later, marks=marks, arrived=arrived, tags=self.tags | later.tags)


class Pours:
    """Pours dye into one design."""

    def __init__(self, session: CoreSession, node: Node, seen: Mapping[str, set[int]]) -> None:
        """Pour with endpoints of ``node``; ``seen`` has the tags that were seen on each topic."""
        self._session = session
        self._node = node
        self._seen = seen
        self._inlets: dict[str, Any] = {}
        self._tags: set[int] = set()
        self._errands: Errands | None = None
        self._stream: _Stream | None = None

    def answer_overheard(self, topic: str, tags: Collection[int]) -> None:
        """Answer a message that took the place of a marked one as the newest on its topic.

        A driver of the student's own goes on publishing, and a node that looks at the newest now
        and then, by a timer of the same clock, would find the driver's each time.
        """
        stream = self._stream
        if stream is not None and topic in stream.topics and stream.tag not in tags:
            stream.answer()

    def under_way(self, name: str, action_type: Any) -> None:
        """From now on have a goal of this action under way while topics are coloured."""
        self._errands = self._errands or Errands(self._session, name, action_type)

    def pour_goals(
        self, name: str, action_type: Any, sensors: Iterable[Topic], arrived_on: Collection[str]
    ) -> Poured:
        """Send marked goals until marks are seen on one of ``arrived_on``, while sensors go on.

        A node may have to be woken by a reading before it asks for what a goal has changed, or
        before it takes one: a robot that does not know where it is may reject a goal. Scans and
        images come late: they show something in the way, which may stop a robot. Where a goal goes
        on though it was cancelled (a queue, say), the mark of the first is enough, unless it soon
        ends by itself: then that of the next is needed, too. Where goals end, one more than needed
        is sent: whoever has been at one waypoint has to take the next.

        Raises:
            WaitTimeout: the action server did not answer; says why.
            GoalRejectedError: it took no goal.
        """
        self.under_way(name, action_type)
        errands = self._errands
        assert errands is not None
        every = list(sensors)
        blind = self._make_waker(topic for topic in every if topic.name not in EYES)
        seeing = self._make_waker(every)
        sent, ahead = 0, WAYPOINT
        wake = _Every(WAKE, lambda: blind() if sent <= BLIND else seeing())

        def send(tag: int) -> bool:
            nonlocal sent
            sent += 1
            errands.end_goal()
            taken = errands.send(tag, ahead)
            # A controller may look at the newest ten times a second: readings wait until it has.
            wake.put_off()
            return taken

        poured = self._pour_tags(send, wake, arrived_on, lambda: errands.outlasts, PLANNING)
        if poured.enough:
            errands.end_goal()
            if errands.outlasts and not errands.cancelled:
                errands.wait_for_end()
            if poured.arrived < ARRIVALS and errands.answers and not errands.outlasts:
                sent, ahead = 0, NEARER
                with suppress(GoalRejectedError):  # it is told how many were turned away
                    poured = poured.combine_with(self._pour_tags(send, wake, arrived_on, needed=1))
            elif not errands.outlasts:
                errands.send(self._fresh_tag())
        aside = errands.rejection_remark
        if not poured.arrived:
            aside = aside or errands.aborted_goals
        if errands.cancelled and not poured.arrived:
            aside = aside or (
                f"nothing came of the first goals within {SETTLE / POURS:g} s, nor of the last "
                f"within {PLANNING:g} s, and then each was cancelled"
            )
        return replace(poured, aside=aside, turned_away=errands.turned_away)

    def pour_topics(
        self, topics: Iterable[Topic], others: Iterable[Topic], arrived_on: Collection[str]
    ) -> Poured:
        """Publish marked messages on topics until marks are seen on one of ``arrived_on``.

        ``others`` are sensors that go on meanwhile, with marks of their own.

        Raises:
            TypeNotInstalledError: a topic's type is not installed here.
        """
        inlets = [(self._get_inlet(topic), topic) for topic in topics]
        # The examiner's own tap is a subscription, too. Who is late all the same gets a later pour.
        with suppress(WaitTimeout):
            self._session.until(
                lambda: all(i.get_subscription_count() > len(t.readers) for i, t in inlets),
                SETTLE / 4,
                "the readers of a topic",
            )
        stream = _Stream({topic.name: inlet for inlet, topic in inlets})
        again, wake = _Every(REPEAT, stream.publish), _Every(WAKE, self._make_waker(others))

        def pour(tag: int) -> bool:
            if self._errands is not None:
                self._errands.keep_one(self._fresh_tag())
            stream.tag = tag
            stream.publish()
            wake.put_off()  # as for goals
            self._stream = stream
            return True

        def meanwhile() -> None:
            again()
            wake()

        try:
            return self._pour_tags(pour, meanwhile, arrived_on)
        finally:
            self._stream = None

    def roll_until(self, sensors: Iterable[Topic], heard: Callable[[], bool]) -> bool:
        """Have the wheels report, and the LIDAR see free room, until something is ``heard``.

        Only the wheels' readings bear marks: what the library's nodes make of a mark may be an
        obstacle, and a robot that has seen one may stand still from then on.
        """
        inlets = [(self._get_inlet(topic), topic.name in EYES) for topic in sensors]

        def report() -> None:
            for inlet, sees in inlets:
                kind = inlet.msg_type
                inlet.publish(
                    lifelike_message(kind, FAR_M)
                    if sees
                    else marked_message(kind, self._fresh_tag())
                )

        on = _Every(0.1, report)

        def look() -> bool:
            on()
            return heard()

        report()
        with suppress(WaitTimeout):
            self._session.until(look, SETTLE, "a message")
        return heard()

    def _pour_tags(
        self,
        pour: Callable[[int], bool],
        meanwhile: Callable[[], object],
        arrived_on: Collection[str],
        goes_on: Callable[[], bool] = lambda: False,
        patience: float = SETTLE / POURS,
        needed: int = ARRIVALS,
    ) -> Poured:
        # A link may still be about to connect: what it loses does not come back, so pour again.
        tags: set[int] = set()
        slow = 0
        for left in reversed(range(POURS)):
            if pour(tag := self._fresh_tag()):
                tags.add(tag)
            known = len(self._tags_seen(arrived_on, tags))
            if tag in tags or not (known and goes_on()):
                slow += tag in tags and left < SLOW and (not known or slow > 0)
                self._wait_for_mark(
                    lambda n=known: len(self._tags_seen(arrived_on, tags)) > n,  # type: ignore[misc]
                    meanwhile,
                    patience if slow else SETTLE / POURS,
                )
            arrived = self._tags_seen(arrived_on, tags)
            if len(arrived) >= needed or (slow >= ARRIVALS and not arrived):
                break
            if arrived and goes_on() and not self._made_up(arrived_on):
                return Poured(True, len(tags), len(arrived), [], frozenset(arrived))
        if not tags:
            raise GoalRejectedError
        lost = tags - arrived
        seen = list(self._seen.items())  # at once: another thread adds to it
        lost_on = sorted(name for name, those in seen if those & lost)
        enough = len(arrived) >= needed
        return Poured(enough, len(tags), len(arrived), lost_on, frozenset(arrived))

    def _wait_for_mark(
        self, arrived: Callable[[], bool], meanwhile: Callable[[], object], seconds: float
    ) -> None:
        def look() -> bool:
            meanwhile()
            return arrived()

        with suppress(WaitTimeout):
            self._session.until(look, seconds, "a mark")

    def _tags_seen(self, topics: Collection[str], tags: set[int]) -> set[int]:
        return {tag for name in topics for tag in tags & self._seen.get(name, set())}

    def _made_up(self, topics: Collection[str]) -> bool:
        """Whether more marks were seen there than anybody can have got from here."""
        return any(len(self._seen.get(name, set()) - self._tags) > FEW for name in topics)

    def _fresh_tag(self) -> int:
        tag = message_tags.fresh_tag()
        self._tags.add(tag)
        return tag

    def _make_waker(self, sensors: Iterable[Topic]) -> Callable[[], None]:
        inlets = [self._get_inlet(topic) for topic in sensors]

        def wake() -> None:
            for inlet in inlets:
                inlet.publish(marked_message(inlet.msg_type, self._fresh_tag()))

        return wake

    def _get_inlet(self, topic: Topic) -> Any:
        if topic.name not in self._inlets:
            self._inlets[topic.name] = self._node.create_publisher(
                load_type(topic.types[0]),
                topic.name,
                _matching_profile(topic),
            )
        return self._inlets[topic.name]


class _Stream:
    """Messages with one mark, on each of some topics."""

    def __init__(self, inlets: Mapping[str, Any]) -> None:
        self.topics = inlets.keys()
        self.tag = 0
        self.answer = _Every(AT_ONCE, self.publish)
        self._inlets = inlets

    def publish(self) -> None:
        for inlet in self._inlets.values():
            inlet.publish(marked_message(inlet.msg_type, self.tag))


class _Every:
    """Acts when it is called and the last time was so long ago."""

    def __init__(self, seconds: float, act: Callable[[], None]) -> None:
        self._seconds = seconds
        self._act = act
        self.put_off()

    def __call__(self) -> None:
        if time.monotonic() - self._last >= self._seconds:
            self._act()
            self.put_off()

    def put_off(self) -> None:
        """Act no earlier than so many seconds from now."""
        self._last = time.monotonic()


def _matching_profile(topic: Topic) -> QoSProfile:
    """Return a profile that every reader of a topic connects to."""
    asked = [end.qos for end in topic.readers]
    manual = any(qos.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC for qos in asked)
    return QoSProfile(
        depth=10,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
        deadline=_shortest_duration([qos.deadline for qos in asked]),
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC if manual else LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=_shortest_duration(
            [qos.liveliness_lease_duration for qos in asked]
        ),
    )


def _shortest_duration(durations: list[Duration]) -> Duration:
    return min((d for d in durations if d.nanoseconds > 0), key=lambda d: d.nanoseconds,
               default=Duration())  # fmt: skip
