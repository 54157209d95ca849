"""The way of one kind of message through the student's nodes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.time import Time

from autograder.observe.examiner.publication_times import published_at, received_at
from autograder.observe.relays.arrivals import Arrivals
from autograder.observe.relays.endpoint_qos import TopicEnds, lossless_profile, undemanding_profile
from autograder.observe.relays.marked_messages import Mark, MarkedMessages
from autograder.observe.relays.message_stream import UNLIMITED, MessageStream

CLAIMED_NS = 100_000_000
"""By how much longer what a consumer hands on may be on its way than what it got, as it says."""


class RelayPath:
    """Sends messages in at the source, and knows them again on the topic and at the output.

    Attributes:
        source: the examiner's publisher there.
        sent: what was sent; ``published``: what came on the topic; ``handed``: what was handed on
            at the output, from `listen_to_output` on.
        altered: topics with messages that were not sent so; ``blank``: with messages of which only
            the header is left; ``foreign``: with messages that were not sent at all.
    """

    def __init__(self, node: Node, messages: MarkedMessages, run: int) -> None:
        """Bring up the source, and a witness on the topic; ``run`` is a number of this run."""
        self._node, self._messages, self._run = node, messages, run
        self.source = node.create_publisher(messages.type, messages.source, lossless_profile())
        self.sent, self.published, self.handed = Arrivals(), Arrivals(), Arrivals()
        self.altered: set[str] = set()
        self.blank: set[str] = set()
        self.foreign: set[str] = set()
        self._entry = self.source
        self._stand_in: Any = None
        self._offer: QoSProfile | None = None  # of the stand-in
        self._marks: dict[tuple[str, int], Mark] = {}  # by series and number
        self._numbers: dict[Mark, tuple[str, int]] = {}
        self._stamps: dict[int, Mark] = {}
        # As they went out, serialized. One that comes back like that is told by it, and need not be
        # taken apart: most are, and each is heard at least twice.
        self._marks_sent: dict[bytes, Mark] = {}
        self._bytes_sent: dict[Mark, bytes] = {}
        self.listen(messages.topic, undemanding_profile(), self.published)

    def find_ends(self) -> TopicEnds:
        """Return the student's endpoints on the topic."""
        return TopicEnds(self._node, self._messages.topic)

    def listen_to_output(self) -> None:
        """Listen to the output with what is offered there."""
        request = TopicEnds(self._node, self._messages.output).matching_request
        self.listen(self._messages.output, request, self.handed)

    def send(self, series: str, number: int) -> None:
        """Send a message that was made now.

        It reads like the one that had this series and number before, if there was one.
        """
        mark, now_ns = self._mark_of(series, number), time.time_ns()
        message = serialize_message(self._messages.make_message(mark, now_ns, number))
        self._stamps[now_ns] = mark
        self._marks_sent[message] = mark
        self._bytes_sent[mark] = message
        self.sent.note(series, number, now_ns, now_ns)
        self._entry.publish(message)

    def describe_silence(self) -> str:
        """Return in a sentence why nothing comes out at the output."""
        topic, output = self._messages.topic, self._messages.output
        if refusals := self.find_ends().refusals:
            why = refusals[0].as_sentence("your publisher", "your subscription", topic)
            return f"Nothing of {self._messages} arrives: {why}"
        changed = "{} carries messages, but not what {}: their content was changed."
        if not len(self.published):
            if topic in self.foreign:
                return changed.format(topic, f"{self._messages.source} delivered")
            return f"Nothing of {self._messages} is published on {topic}."
        if output in self.foreign:
            return changed.format(output, f"{topic} carried")
        return f"{topic} carries {self._messages.noun}s, but none comes out on {output}."

    def _mark_of(self, series: str, number: int) -> Mark:
        if (series, number) not in self._marks:
            mark = Mark.draw(self._run)
            while mark in self._numbers:
                mark = Mark.draw(self._run)
            self._marks[series, number] = mark
            self._numbers[mark] = series, number
        return self._marks[series, number]

    def stream(self, series: str, *, limit: int = UNLIMITED) -> MessageStream:
        """Begin to send messages at their rate."""
        return MessageStream(
            self._node, self._messages.rate_hz, lambda number: self.send(series, number),
            lambda: self.published.newest(series), ahead=self._messages.ahead, limit=limit,
        )  # fmt: skip

    def listen(
        self, topic: str, qos: QoSProfile, arrivals: Arrivals, on: Node | None = None
    ) -> None:
        """Subscribe to ``topic``, and note the messages that were sent; ``on`` another node."""

        def note(serialized: bytes, info: Any) -> None:
            mark = self._recognise(topic, serialized)
            if mark is not None:
                series, number = self._numbers[mark]
                published_ns, received_ns = published_at(info), received_at(info)
                if arrivals is self.handed:
                    earliest_ns = self._earliest_handing(series, number, received_ns)
                    published_ns = max(published_ns, earliest_ns)
                arrivals.note(series, number, published_ns, received_ns)

        called: Callable[..., None] = note  # rclpy's stubs know nothing of the second argument
        node = on or self._node
        node.create_subscription(self._messages.type, topic, called, qos, raw=True)

    def _earliest_handing(self, series: str, number: int, received_ns: int) -> int:
        """Return when a message can have been handed on, whatever the consumer says.

        It came by the same way as what was published: whoever is late here is so with both.
        """
        for arrival in self.published.of(series):
            if arrival.number == number:
                transit_ns = arrival.received_ns - arrival.published_ns
                return received_ns - transit_ns - CLAIMED_NS
        return 0

    def _recognise(self, topic: str, serialized: bytes) -> Mark | None:
        if (mark := self._marks_sent.get(serialized)) is not None:
            return mark
        message = deserialize_message(serialized, self._messages.type)
        if (mark := self.find_mark(message)) is None:
            if not self._is_of_an_earlier_run(message):
                self.foreign.add(topic)
            return None
        sent = deserialize_message(self._bytes_sent[mark], self._messages.type)
        if not self._messages.is_same(message, sent):
            self.altered.add(topic)
            if self._messages.is_same(message, self._messages.type()):
                self.blank.add(topic)
        return mark

    def find_mark(self, message: Any) -> Mark | None:
        """Return the mark of a message that was sent, by its stamp if nothing else is left of it.

        None if it was not sent.
        """
        for mark in self._messages.find_marks(message):
            if mark in self._numbers:
                return mark
        if not hasattr(message, "header"):
            return None
        return self._stamps.get(Time.from_msg(message.header.stamp).nanoseconds)

    def _is_of_an_earlier_run(self, message: Any) -> bool:
        found = self._messages.find_marks(message)
        return not hasattr(message, "header") and any(m and m.run != self._run for m in found)

    def renew_stand_in(self) -> None:
        """Have a publisher that offers what is offered on the topic by now: see `standing_in`."""
        ends = self.find_ends()
        if not ends.publishers:
            return
        offer, before = ends.strongest_offer, self._offer
        if offer != before:
            if before is not None:
                self._node.destroy_publisher(self._stand_in)
            self._stand_in = self._node.create_publisher(
                self._messages.type, self._messages.topic, offer
            )
            self._offer = offer

    @contextmanager
    def standing_in(self) -> Iterator[None]:
        """Send on the topic itself, in the stead of a node that is held, for the block's length."""
        self._entry = self._stand_in or self.source
        try:
            yield
        finally:
            self._entry = self.source
