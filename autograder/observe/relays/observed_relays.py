"""The student's nodes that relay messages: one takes them in, another one hands them on."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from itertools import count
from typing import Any, Generic, TypeVar

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import Failed
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.relays.arrivals import Arrivals
from autograder.observe.relays.marked_messages import MarkedMessages
from autograder.observe.relays.message_stream import LAG_S
from autograder.observe.relays.observed_process import ObservedProcess
from autograder.observe.relays.relay_path import RelayPath

FOUND_S = 2.0
"""Seconds in which publishers are found on the graph, if they come with their node."""
STEP_S, ROUND = 0.01, 10
"""Seconds between two probes, and such steps in a round of them."""

KindT = TypeVar("KindT", bound=MarkedMessages)
Found = TypeVar("Found")


class ObservedRelays(ObservedProcess, Generic[KindT]):
    """The student's nodes, and the ways of messages through them.

    Attributes:
        node: the examiner's.
        paths: the way of each kind of message.
    """

    def __init__(self, bench: CheckContext, kinds: Iterable[KindT], consumer: str) -> None:
        """Bring up the examiner's endpoints.

        Args:
            bench: what the exam works with.
            kinds: the messages that are relayed.
            consumer: the class of the last node on their way.
        """
        super().__init__(bench)
        run = secrets.randbelow(2**24)  # that a float32 still holds exactly
        self.node = QuietNode(f"examiner_{run}", bench.session.context)
        self.paths = {kind: RelayPath(self.node, kind, run) for kind in kinds}
        self.spinner.add_node(self.node)
        self.consumer = consumer
        self._probes = 0  # how often probed
        self._silences: dict[KindT, str] | None = None  # as soon as that is known
        self._experiments: dict[Any, Any] = {}

    @contextmanager
    def keep_busy(self, name: str) -> Iterator[Callable[[], bool]]:
        """Keep a node busy; where all are held with the consumer, stand in for the others."""
        with super().keep_busy(name) as let_go, ExitStack() as standing_in:
            if name == self.consumer:
                standing_in.enter_context(self._standing_in())
            yield let_go

    @contextmanager
    def _standing_in(self) -> Iterator[None]:
        with ExitStack() as standing_in:
            for path in self.paths.values():
                standing_in.enter_context(path.standing_in())
            yield

    def have_stand_ins(self) -> None:
        """Be ready to publish in the stead of nodes that are held with the consumer.

        For that there are publishers of the examiner's from the time on when there are the
        student's: whoever saw them come would know that a consumer is about to be held.
        """
        paths = self.paths.values()
        if self.can_hold:
            self.wait(lambda: all(path.find_ends().publishers for path in paths), FOUND_S)
            for path in paths:
                path.renew_stand_in()

    def find_silences(self) -> dict[KindT, str]:
        """Return why nothing comes out of each kind of which nothing does, in a sentence.

        From then on what comes out is heard, and the stand-ins offer what the nodes do by then.
        """
        if self._silences is None:
            for path in self.paths.values():
                path.listen_to_output()
            heard = {kind: path.handed for kind, path in self.paths.items()}
            silent = self.probe(heard, give_up=lambda kind: self.paths[kind].find_ends().refusals)
            self._silences = {kind: self.paths[kind].describe_silence() for kind in silent}
            self.have_stand_ins()
            if self.can_hold:
                with self._standing_in():
                    self.probe({kind: there for kind, there in heard.items() if kind not in silent})
        return self._silences

    def require_flow(self, kind: KindT, expected: str) -> None:
        """Require that messages of a kind come out.

        Raises:
            Failed: they do not.
        """
        if why := self.find_silences().get(kind):
            actual = f"{why.removesuffix('.')}{self.error_note()}."
            raise Failed(expected=expected, actual=actual)

    def probe(
        self, heard: Mapping[KindT, Arrivals], give_up: Callable[[KindT], Any] = lambda _: False
    ) -> list[KindT]:
        """Send messages until each of these has been heard; return those never heard.

        Endpoints find each other in their own time, and what is sent before is lost: so the first
        messages are probes. ``give_up`` says that waiting for one is pointless. No two probes are
        alike: a consumer may rightly or wrongly leave out what reads alike.
        """
        self._probes += 1
        series, patience = self._probe_series, self.start_patience()

        def silent() -> list[KindT]:
            return [kind for kind, there in heard.items() if not there.numbers(series)]

        for number in count():
            if number and number % ROUND == 0:
                hopeless = all(map(give_up, silent()))
                if hopeless or not patience.has_time_left():
                    break
            for kind in silent():
                if number % ROUND < kind.probes:
                    self.paths[kind].send(series, number)
            if self.wait(lambda: not silent(), STEP_S):
                break
        return silent()

    @property
    def _probe_series(self) -> str:
        return f"probe {self._probes}"

    def describe_probes(self, kind: KindT) -> str:
        """Return what became of the newest probes, as a phrase."""
        path, series = self.paths[kind], self._probe_series
        passed, came = (len(ends.first_times(series)) for ends in (path.published, path.sent))
        return f"while the driver published {passed} of the {came} that came in"

    def send_burst(self, kind: KindT, series: str, count: int) -> bool:
        """Send ``count`` messages; return whether the last was seen on the topic.

        No faster than the first node takes them: its queue need not be longer.
        """
        takes = True
        for number in range(count):
            self.paths[kind].send(series, number)
            takes = takes and self.wait_for_relay(kind, series, number + 1 - kind.ahead, LAG_S)
        return self.wait_for_relay(kind, series, count - 1)

    def wait_for_relay(
        self, kind: KindT, series: str, number: int, timeout_s: float | None = None
    ) -> bool:
        """Wait until a message, or a later one, came on the topic; return whether it did."""
        published = self.paths[kind].published
        return self.wait(lambda: published.newest(series) >= number, timeout_s)

    def send_alone(self, kind: KindT, series: str, number: int) -> bool:
        """Send one message; return whether one more came on the topic within `LAG_S`."""
        path = self.paths[kind]
        before = len(path.published.numbers(series))
        path.send(series, number)
        return self.wait(lambda: len(path.published.numbers(series)) > before, LAG_S)

    def send_until(
        self, done: Callable[[], Any], kind: KindT, series: str, numbers: Iterable[int]
    ) -> bool:
        """Send messages at their rate until ``done``; return whether it came to that."""
        for number in numbers:
            self.paths[kind].send(series, number)
            if self.wait(done, 1 / kind.rate_hz):
                return True
        return self.wait(done)

    def run_once(self, experiment: Callable[[Any], Found]) -> Found:
        """Return what an experiment that several checks read has found; it is run once."""
        if experiment not in self._experiments:
            self._experiments[experiment] = experiment(self)
        found: Found = self._experiments[experiment]
        return found


def relays_of(
    kinds: Iterable[KindT], *, consumer: str
) -> Callable[[CheckContext], AbstractContextManager[ObservedRelays[KindT]]]:
    """Return what an `Exam` of nodes that relay messages takes.

    Args:
        kinds: the messages that are relayed.
        consumer: the class of the last node on their way.
    """

    @contextmanager
    def observe(bench: CheckContext) -> Iterator[ObservedRelays[KindT]]:
        relays = ObservedRelays(bench, kinds, consumer)
        try:
            yield relays
        finally:
            relays.close()

    return observe
