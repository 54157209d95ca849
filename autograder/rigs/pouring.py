"""Pouring dye into a design: marked goals and messages go in, and it is seen where they come out.

The examiner behaves as a robot's surroundings do: scans go on and on, sensors wake the nodes, a
goal is under way while the robot looks out for obstacles, and whoever wants another goal cancels
the one before.
"""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy

from autograder.rigs.robot_graph import Topic
from autograder.rigs.robot_jobs import EYES
from autograder.rigs.robot_types import load_type
from course import Session, WaitTimeout
from course.design import dye
from course.design.lifelike import AHEAD, lifelike
from course.runtime.actions import GoalRun

SETTLE = 8.0
"""Seconds that something expected may take: discovery takes 0.3 s, on a busy machine a few."""
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
WAKE = 0.25
"""Seconds until the other sensors send again."""
BLIND = 3
"""Goals before scans and images go on, too: a robot with something in its way may stand still."""
WAYPOINT = 5.0
"""Metres to the waypoint of a goal: a robot that is there already would not start."""
GRACE = 0.1
"""Seconds that a goal may take to be over before it is asked to end."""
PATIENCE = 2.0
"""Seconds that a goal may take to end when it is cancelled."""


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
    aside: str = ""
    """What became of goals that were not taken."""


class Errands:
    """The goals that the examiner sends to one action, one after the other."""

    def __init__(self, session: Session, name: str, action_type: Any) -> None:
        """Send none yet."""
        self._session = session
        self._name = name
        self._type = action_type
        self._run: GoalRun | None = None
        self._answers = True
        self._rejected = 0
        self.outlasts = False
        """Whether a goal went on although it was asked to end."""

    def send(self, tag: int) -> bool:
        """Send a marked goal; return whether the server took it.

        Raises:
            WaitTimeout: the server did not answer to the first goal; says why.
        """
        first = self._run is None
        if not self._answers:
            return False
        goal = marked(self._type.Goal, tag, WAYPOINT)
        try:
            run = self._session.send_goal(
                self._type, self._name, goal, timeout=SETTLE if first else PATIENCE
            )
        except WaitTimeout:
            self._answers = False
            if first:
                raise
            return False
        if run.accepted:
            self._run = run
        elif not first:
            self._rejected += 1
        return run.accepted

    @property
    def aside(self) -> str:
        """What became of goals that were not taken; empty if there were none."""
        if not self._answers:
            return f"while that goal went on, {self._name} did not answer to another"
        times = "once" if self._rejected == 1 else f"{self._rejected} times"
        return f"another goal was rejected, {times}" if self._rejected else ""

    def end(self) -> None:
        """Cancel the goal before, and wait until it is over; it may go on all the same."""
        run = self._run
        if self._answers and run is not None and not run.done_within(GRACE):
            with suppress(WaitTimeout):
                if run.cancel(PATIENCE):
                    run.done_within(PATIENCE)
        self.outlasts = run is not None and not run.done

    def keep_one(self, tag: int) -> None:
        """See to it that a goal is under way, as far as the server takes one."""
        if self._run is None or self._run.done:
            with suppress(WaitTimeout):
                self.send(tag)


class Pours:
    """Pours dye into one design."""

    def __init__(self, session: Session, node: Node, seen: Mapping[str, set[int]]) -> None:
        """Pour with endpoints of ``node``; ``seen`` has the tags that were seen on each topic."""
        self._session = session
        self._node = node
        self._seen = seen
        self._inlets: dict[str, Any] = {}
        self._tags: set[int] = set()
        self._errands: Errands | None = None
        self._stream: _Stream | None = None

    def overheard(self, topic: str, tags: Collection[int]) -> None:
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

    def goals(
        self, name: str, action_type: Any, sensors: Iterable[Topic], arrived_on: Collection[str]
    ) -> Poured:
        """Send marked goals until marks are seen on one of ``arrived_on``, while sensors go on.

        A node may have to be woken by a reading before it asks for what a goal has changed, or
        before it takes one: a robot that does not know where it is may reject a goal. Scans and
        images come late: they show something in the way, which may stop a robot. Where a goal goes
        on though it was cancelled (a queue, say), the mark of the first is enough.

        Raises:
            WaitTimeout: the action server did not answer; says why.
            GoalRejectedError: it took no goal.
        """
        self.under_way(name, action_type)
        errands = self._errands
        assert errands is not None
        every = list(sensors)
        blind = self._waking(topic for topic in every if topic.name not in EYES)
        seeing = self._waking(every)
        sent = 0
        wake = _Every(WAKE, lambda: blind() if sent <= BLIND else seeing())

        def send(tag: int) -> bool:
            nonlocal sent
            sent += 1
            errands.end()
            taken = errands.send(tag)
            # A controller may look at the newest ten times a second: readings wait until it has.
            wake.put_off()
            return taken

        poured = self._pour(send, wake, arrived_on, lambda: errands.outlasts)
        return replace(poured, aside=errands.aside)

    def topics(
        self, topics: Iterable[Topic], others: Iterable[Topic], arrived_on: Collection[str]
    ) -> Poured:
        """Publish marked messages on topics until marks are seen on one of ``arrived_on``.

        ``others`` are sensors that go on meanwhile, with marks of their own.

        Raises:
            UnknownTypeError: a topic's type is not installed here.
        """
        inlets = [(self._inlet(topic), topic) for topic in topics]
        wake = self._waking(others)
        # The examiner's own tap is a subscription, too. Who is late all the same gets a later pour.
        with suppress(WaitTimeout):
            self._session.until(
                lambda: all(i.get_subscription_count() > len(t.readers) for i, t in inlets),
                SETTLE / 4,
                "the readers of a topic",
            )
        stream = _Stream({topic.name: inlet for inlet, topic in inlets})

        def pour(tag: int) -> bool:
            if self._errands is not None:
                self._errands.keep_one(self._fresh())
            stream.tag = tag
            stream.publish()
            wake()
            self._stream = stream
            return True

        again, on = _Every(REPEAT, stream.publish), _Every(WAKE, wake)

        def meanwhile() -> None:
            again()
            on()

        try:
            return self._pour(pour, meanwhile, arrived_on)
        finally:
            self._stream = None

    def _pour(
        self,
        pour: Callable[[int], bool],
        meanwhile: Callable[[], object],
        arrived_on: Collection[str],
        goes_on: Callable[[], bool] = lambda: False,
    ) -> Poured:
        # A link may still be about to connect: what it loses does not come back, so pour again.
        tags: set[int] = set()
        for _ in range(POURS):
            if pour(tag := self._fresh()):
                tags.add(tag)
            known = len(self._at(arrived_on, tags))
            if tag in tags or not (known and goes_on()):
                self._wait(lambda n=known: len(self._at(arrived_on, tags)) > n, meanwhile)  # type: ignore[misc]
            arrived = self._at(arrived_on, tags)
            if len(arrived) >= ARRIVALS:
                break
            if arrived and goes_on() and not self._made_up(arrived_on):
                return Poured(True, len(tags), len(arrived), [])
        if not tags:
            raise GoalRejectedError
        lost = tags - arrived
        seen = list(self._seen.items())  # at once: another thread adds to it
        lost_on = sorted(name for name, those in seen if those & lost)
        return Poured(len(arrived) >= ARRIVALS, len(tags), len(arrived), lost_on)

    def _wait(self, arrived: Callable[[], bool], meanwhile: Callable[[], object]) -> None:
        def look() -> bool:
            meanwhile()
            return arrived()

        with suppress(WaitTimeout):
            self._session.until(look, SETTLE / POURS, "a mark")

    def _at(self, topics: Collection[str], tags: set[int]) -> set[int]:
        return {tag for name in topics for tag in tags & self._seen.get(name, set())}

    def _made_up(self, topics: Collection[str]) -> bool:
        """Whether more marks were seen there than anybody can have got from here."""
        return any(len(self._seen.get(name, set()) - self._tags) > FEW for name in topics)

    def _fresh(self) -> int:
        tag = dye.fresh_tag()
        self._tags.add(tag)
        return tag

    def _waking(self, sensors: Iterable[Topic]) -> Callable[[], None]:
        inlets = [self._inlet(topic) for topic in sensors]

        def wake() -> None:
            for inlet in inlets:
                inlet.publish(marked(inlet.msg_type, self._fresh()))

        return wake

    def _inlet(self, topic: Topic) -> Any:
        if topic.name not in self._inlets:
            self._inlets[topic.name] = self._node.create_publisher(
                load_type(topic.types[0]),
                topic.name,
                _serving(topic),
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
            inlet.publish(marked(inlet.msg_type, self.tag))


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


def marked(msg_type: Any, tag: int, ahead: float = AHEAD) -> Any:
    """Return a message as a robot would send it, with a mark in it."""
    message = lifelike(msg_type, ahead)
    dye.mark(message, tag)
    return message


def _serving(topic: Topic) -> QoSProfile:
    """Return a profile that every reader of a topic connects to."""
    asked = [end.qos for end in topic.readers]
    manual = any(qos.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC for qos in asked)
    return QoSProfile(
        depth=10,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
        deadline=_shortest([qos.deadline for qos in asked]),
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC if manual else LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=_shortest([qos.liveliness_lease_duration for qos in asked]),
    )


def _shortest(durations: list[Duration]) -> Duration:
    return min((d for d in durations if d.nanoseconds > 0), key=lambda d: d.nanoseconds,
               default=Duration())  # fmt: skip
