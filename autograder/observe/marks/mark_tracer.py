"""Marks that travel: what goes in at one end of a design, and on which topics it comes out.

Water pipes are tested by pouring dye in at one end. Here each message or goal bears a number that
nobody can know beforehand (`course.design.message_tags`), and nodes pass it on with what they send.
The examiner behaves as a robot's surroundings do: readings go on and on, sensors wake the nodes,
and whoever wants another goal cancels the one before.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

from rclpy.node import Node

from autograder.examination.check_context import CheckContext, StudentError
from autograder.observe.examiner.examiner_end import UNDEMANDING
from autograder.observe.graph.ros_graph import GraphService, GraphTopic, RosGraph
from autograder.observe.marks.mark_trace import Trace
from autograder.observe.marks.marked_goals import WAYPOINT_M, MarkedGoals
from autograder.observe.marks.marked_publishers import (
    REPEAT_S,
    MarkedPublishers,
    MarkedStream,
    Periodic,
)
from autograder.observe.marks.marked_types import TypeNotInstalledError, load_type, marked_message
from autograder.observe.patience import SETTLE_S, Patience
from autograder.observe.phrases import as_phrase, callback_raised
from autograder.observe.stillness import Stillness
from course.design.message_tags import fresh_tag, read_all
from course.errors import WaitTimeout

QUICK_S, SLOW_S = 1.0, 4.0
"""Seconds for a mark to arrive: for most of them, and for the last goals. A planner may think for a
while, and a navigator drop what is cancelled before it has a plan."""
MESSAGES_S = (QUICK_S,) * 8
GOALS_S = (QUICK_S,) * 5 + (SLOW_S,) * 3
"""Seconds for each try, with another mark: a link that is only just connecting may lose one."""
ARRIVALS = 2
"""How many marks must arrive: one could be a lucky guess of somebody who makes marks up."""
WAKE_S = 0.6
"""Seconds until other sensors send again: a node looks at the newest twice a second, or more often,
and until then what bears the mark must be the newest on its way."""
REPORT_S = 0.1
"""Seconds from one reading to the next where none bears the mark that is traced."""
BLIND_GOALS = 3
"""Goals before sensors that see what is in the way go on: it may stop a robot."""
NEXT_WAYPOINT_M = 3.0
"""Metres to a later goal's place: a robot that reckons how far it has got may be at the first."""


class MarkTracer:
    """Sends marked messages and goals into a graph, and notes which marks go over which topic.

    Attributes:
        seen: the marks that were seen on each topic, by its name.
        heard: the topics on which any message was seen.
    """

    def __init__(self, bench: CheckContext, node: Node, graph: RosGraph) -> None:
        """Listen to every topic of ``graph`` of a type that is installed, with an examiner's node.

        Args:
            bench: what the checks work with.
            node: whose publishers and subscriptions are used.
            graph: of the student's nodes.
        """
        self.seen: dict[str, set[int]] = defaultdict(set)
        self.heard: set[str] = set()
        self._subject, self._session, self._outside = bench.subject, bench.session, bench.outside
        self._publishers, self._note_step = MarkedPublishers(node), bench.note_step
        self._readers: dict[str, int] = {}  # how many each topic has, with the examiner's own
        self._stream: MarkedStream | None = None
        for topic in graph.topics.values():
            with suppress(TypeNotInstalledError):
                for name in topic.types if topic.writers else ():
                    note = partial(self._note, topic.name)
                    node.create_subscription(load_type(name), topic.name, note, UNDEMANDING)
                    self._readers[topic.name] = len(topic.readers) + 1

    def _note(self, topic: str, message: Any) -> None:
        tags = read_all(message)
        self.heard.add(topic)
        self.seen[topic].update(tags)
        stream = self._stream
        # A node that looks at the newest now and then, by a timer that goes off with that of a
        # driver of the student's own, would find the driver's each time.
        if stream is not None and topic in stream.topics and stream.tag not in tags:
            stream.publish_at_once()

    def await_listening(self, name: str) -> None:
        """Wait until a node knows who listens: what is sent before that is not seen here.

        Args:
            name: by which the subject knows it, such as its class.
        """

        def all_known() -> bool:
            counts = self._subject.sees(name, {"subscribers": list(self._readers)})["subscribers"]
            return all(counts[topic] >= number for topic, number in self._readers.items())

        with suppress(StudentError, WaitTimeout):  # a node of the student's may be gone by now
            self._session.until(all_known, SETTLE_S / 4, "the discovery of who listens")

    def seen_on(self, topics: Iterable[str], marks: Collection[int]) -> set[int]:
        """Return those of some marks that were seen on one of these topics."""
        return {mark for name in topics for mark in self.seen.get(name, set()).intersection(marks)}

    def await_mark(self, topics: Collection[str], marks: Collection[int]) -> bool:
        """Return whether one of some marks is seen on one of these topics, once all are at rest."""
        patience = Patience(Stillness(self._outside))
        return patience.wait(self._session, lambda: bool(self.seen_on(topics, marks)))

    def is_answered(self, service: GraphService) -> bool:
        """Return whether a service answers a request as of a robot; True if its type is unknown."""
        with suppress(TypeNotInstalledError):
            kind = load_type(service.type)
            request = marked_message(kind.Request, fresh_tag(), WAYPOINT_M)
            try:
                self._session.call(kind, service.name, request, SETTLE_S)
            except WaitTimeout:
                return False
        return True

    def error_note(self, nodes: Collection[str] = ()) -> str:
        """Return what a callback raised, of any node or of some, as the end of a sentence."""
        errors = self._subject.errors()
        if nodes:
            errors = [error for error in errors if any(f" of {n}: " in error for n in nodes)]
        return f"; {callback_raised(errors[-1])}" if errors else ""

    def gets_message(
        self, topics: Collection[str], sensors: Iterable[GraphTopic], free: Collection[str]
    ) -> bool:
        """Return whether anything comes on one of some topics while sensors report, or has before.

        Args:
            topics: by their names.
            sensors: topics on which readings come ten times a second.
            free: names of those that see free room around the robot, and bear no marks: a robot
                that has seen something in its way may stand still from then on.
        """
        reporting = list(sensors)

        def report() -> None:
            for topic in reporting:
                self._publishers.publish(topic, 0 if topic.name in free else fresh_tag())

        report()
        return self._wait(
            lambda: not self.heard.isdisjoint(topics), SETTLE_S, Periodic(REPORT_S, report)
        )

    def trace_messages(
        self,
        topics: Iterable[GraphTopic],
        wanted: Collection[str],
        *,
        beside: Iterable[GraphTopic] = (),
        goals: MarkedGoals | None = None,
    ) -> Trace:
        """Publish marked messages on topics until enough marks are seen where they are wanted.

        Args:
            topics: on each of which the mark goes in.
            wanted: names of topics: a mark has arrived that is seen on one of them.
            beside: sensors that go on meanwhile, with marks of their own.
            goals: of these one is under way meanwhile: a robot without one may stand still.

        Raises:
            TypeNotInstalledError: a topic's type is not installed here.
        """
        poured = {topic.name: topic for topic in topics}

        def all_connected() -> bool:
            return all(
                self._publishers.on(topic).get_subscription_count()
                >= self._readers.get(name, len(topic.readers))
                for name, topic in poured.items()
            )

        self._wait(all_connected, SETTLE_S / 4)  # who is late all the same gets a later mark
        stream = MarkedStream(self._publishers, poured)
        repeat = Periodic(REPEAT_S, stream.publish)
        wake = Periodic(WAKE_S, partial(self._publish_marked, list(beside)))

        def send(mark: int) -> bool:
            if goals is not None:
                goals.keep_one(fresh_tag())
            stream.tag = mark
            stream.publish()
            wake.put_off()
            self._stream = stream
            return True

        def go_on() -> None:
            repeat()
            wake()

        try:
            return self._trace(MESSAGES_S, send, go_on, wanted)
        finally:
            self._stream = None

    def trace_goals(
        self,
        goals: MarkedGoals,
        wanted: Collection[str],
        *,
        beside: Iterable[GraphTopic] = (),
        seeing: Iterable[GraphTopic] = (),
    ) -> Trace:
        """Send marked goals until enough marks are seen where they are wanted.

        Where a goal goes on though it was cancelled (a queue, say), the mark of the first is
        enough, unless it soon ends by itself. Where goals end, one more is sent than needed: who
        has been at one waypoint has to take the next (`MarkedGoals.turned_away`).

        Args:
            goals: of one action.
            wanted: names of topics: a mark has arrived that is seen on one of them.
            beside: sensors that go on meanwhile: a node may have to be woken by a reading before it
                asks for what a goal has changed, or before it takes one.
            seeing: sensors that see what is in the way; they go on only from a later goal on.
        """
        blind, every = list(beside), [*beside, *seeing]

        def wake_up() -> None:
            self._publish_marked(blind if goals.sent <= BLIND_GOALS else every)

        wake = Periodic(WAKE_S, wake_up)

        def send(mark: int, ahead_m: float = WAYPOINT_M) -> bool:
            goals.cancel_last()
            taken = goals.send(mark, ahead_m)
            wake.put_off()  # a controller may look at the newest now and then: it comes first
            return taken

        trace = self._trace(GOALS_S, send, wake, wanted, goes_on=lambda: goals.outlasts)
        if not trace.is_enough:
            return replace(trace, remark=f"{goals.remark}{trace.remark}")
        goals.cancel_last()
        if goals.outlasts:
            goals.wait_for_end()
        if goals.outlasts or goals.silence:
            return trace
        if len(trace.arrived) >= ARRIVALS:
            goals.send(fresh_tag())
            return trace
        send_on = partial(send, ahead_m=NEXT_WAYPOINT_M)
        return trace.joined_with(self._trace(MESSAGES_S, send_on, wake, wanted, needed=1))

    def _trace(
        self,
        tries_s: Sequence[float],
        send: Callable[[int], bool],
        meanwhile: Callable[[], None],
        wanted: Collection[str],
        goes_on: Callable[[], bool] = lambda: False,
        needed: int = ARRIVALS,
    ) -> Trace:
        """Send one mark after the other, each so long, until enough of them have arrived.

        While something goes on that was set off by an earlier mark, that one is enough.
        """
        sent: set[int] = set()
        for seconds in tries_s:
            mark = fresh_tag()
            if taken := send(mark):
                sent.add(mark)
            if taken or not (goes_on() and self.seen_on(wanted, sent)):
                self._await_another(sent, wanted, seconds if taken else QUICK_S, meanwhile)
            arrived = self.seen_on(wanted, sent)
            self._note_step(
                f"a mark was {'sent' if taken else 'not taken'}; of {len(sent)} now {len(arrived)} "
                f"seen on {as_phrase(wanted, 'or')}"
            )
            if len(arrived) >= needed or (arrived and goes_on()):
                return Trace(wanted, sent, arrived, True)
        seen = [*self.seen.items()]  # at once: another thread adds to it
        lost_on = sorted(name for name, marks in seen if marks & (sent - arrived))
        return Trace(wanted, sent, arrived, False, lost_on, self.error_note())

    def _await_another(
        self,
        sent: Collection[int],
        wanted: Collection[str],
        seconds: float,
        meanwhile: Callable[[], None],
    ) -> None:
        known = len(self.seen_on(wanted, sent))
        self._wait(lambda: len(self.seen_on(wanted, sent)) > known, seconds, meanwhile)

    def _wait(
        self,
        condition: Callable[[], bool],
        seconds: float,
        meanwhile: Callable[[], None] = lambda: None,
    ) -> bool:
        def look() -> bool:
            meanwhile()
            return condition()

        with suppress(WaitTimeout):
            self._session.until(look, seconds, "a mark")
        return condition()

    def _publish_marked(self, topics: Iterable[GraphTopic]) -> None:
        for topic in topics:
            self._publishers.publish(topic, fresh_tag())
