"""Observes nodes whose time passes only while the examiner waits for something, step by step.

Most of what a node does follows at once from what it is told. What does not may wait for the node's
clock, so that moves on, and a bound of so many seconds counts on that clock, not on the wall's.
"""

from __future__ import annotations

import time
from bisect import bisect_left
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol, Self, TypeVar

from rcl_interfaces.srv import GetParameters
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from autograder.examination.check_context import CheckContext, StudentError
from autograder.examination.exam import Failed, NotExaminable
from autograder.observe.graph.discovery import await_discovery, find_answering_service
from autograder.observe.nouns import Topic
from autograder.observe.patience import IDLE_S, SETTLE_S, Patience
from autograder.observe.phrases import callback_raised
from autograder.observe.stillness import Stillness
from course.errors import WaitTimeout
from course.runtime.core_session import CoreSession

T = TypeVar("T")

ANSWERED_S, ANSWERED_AGAIN_S = 1.0, 0.1
"""Seconds of wall time for an answer before the clock moves on, which it may wait for: the first
time, and where one has been found to wait."""
LATEST_S = 10.0
"""Seconds of the nodes' time for which is waited, unless a task gives a time."""
LEAST_IDLE_S = 0.5
"""Seconds for which all threads sleep after the last step, before the wait is given up."""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Serves every subscription, and one that asks for the last value gets it."""
LOOK_S = 0.01
"""Seconds of wall time after a step in which what it has set off comes in, as a rule."""
STEP_S, GRAIN_S, FINE_S = 0.1, 0.01, 2.0
"""Seconds of the nodes' time: in one step; between two clock messages within a step; and into a
wait after which there is only one such message a step."""


class TimeSource(Protocol):
    """What moves the nodes' time: a `Subject`, or the clock of a plain program."""

    def advance(self, seconds: float, step: float) -> Any:
        """Move it on, by ``step`` s at a time; everything that this sets off has then run."""

    def nudge(self) -> Any:
        """Tell the nodes that hardly any time has passed, and wait for nothing."""


def _no_errors() -> list[str]:
    return []


@dataclass(frozen=True)
class Host:
    """Where the nodes run that are observed.

    Attributes:
        session: the examiner's, in their domain.
        source: moves their time.
        errors: returns what their callbacks have raised so far, if anybody can be asked.
        settle_s: seconds of wall time that something expected may take.
        idle_s: seconds of these in which all threads sleep.
        too_slow: why nothing can be told where these were over before the nodes' time was; empty
            where that is a finding, too.
    """

    session: CoreSession
    source: TimeSource
    errors: Callable[[], list[str]] = _no_errors
    settle_s: float = SETTLE_S
    idle_s: float = IDLE_S
    too_slow: str = ""

    @classmethod
    def of_subject(cls, bench: CheckContext) -> Host:
        """Return the host of nodes in the subject's present session, opened with ``sim_time``."""
        return cls(bench.session, bench.subject, bench.subject.errors)


class SteppedObserver:
    """The examiner's view of nodes whose time it moves.

    Attributes:
        node: the examiner's own.
        elapsed_s: seconds of the nodes' time so far.
        still_since_ns: since when their clock stands still, as messages are stamped.
    """

    def __init__(self, host: Host, still: Stillness, node: Node) -> None:
        """Observe from a ``node`` in the host's session; ``still`` watches both processes."""
        self.host, self.node = host, node
        self.elapsed_s, self.still_since_ns = 0.0, 0
        self._still = still
        self._steps = [(0, 0.0)]
        self._beside = ThreadPoolExecutor(thread_name_prefix="asking")
        self._clients: dict[str, Any] = {}
        self._publishers: dict[str, Any] = {}
        self._unheard: set[str] = set()
        self._wait_for_the_clock: set[str] = set()
        self._told: set[str] = set()

    # Time.

    def note_standstill(self) -> None:
        """Note that the nodes' clock stands still from now on."""
        self.still_since_ns = time.time_ns()

    def step(self, seconds: float = STEP_S, grain_s: float = GRAIN_S) -> None:
        """Move the nodes' time on; everything that this sets off has then run.

        Args:
            seconds: of their time.
            grain_s: seconds between two moments that they get to see.

        Raises:
            Failed: a callback held up the node for so long that its clock stood still.
        """
        try:
            self.host.source.advance(seconds, grain_s)
        except StudentError as error:
            told = str(error).partition(": ")[2] or str(error)  # without the exception's name
            raise Failed(
                expected="Your callbacks end, sleep or await, so that the others get their turn.",
                actual=f"{told.rstrip('.')}. Does one go on without a pause, wait for another "
                "one, or spin the node, which spins already? Or do so many wait for the clock at "
                "once that all threads are taken?",
            ) from None
        self.elapsed_s = round(self.elapsed_s + seconds, 6)
        self.note_standstill()
        self._steps.append((self.still_since_ns, self.elapsed_s))

    def pass_time(self, seconds: float, grain_s: float = GRAIN_S) -> None:
        """Let so many seconds of the nodes' time pass, and hear what is said in them."""
        step_s = max(STEP_S, grain_s)
        for _ in range(round(seconds / step_s)):
            self.step(step_s, grain_s)
        self.drain()

    def clock_at(self, moment_ns: int) -> tuple[float, float]:
        """Return between which times of theirs (s) the nodes' clock was at a moment."""
        at = bisect_left(self._steps, (moment_ns, 0.0))
        latest = self._steps[at][1] if at < len(self._steps) else self.elapsed_s
        return self._steps[at - 1][1], latest

    def wait(self, condition: Callable[[], Any], timeout_s: float | None = None) -> bool:
        """Wait until ``condition`` holds, the nodes' clock standing still; return whether it does.

        Without ``timeout_s`` as long as it may come: see `Patience`.
        """
        if timeout_s is None:
            return self.start_patience(self.host.settle_s).wait(self.host.session, condition)
        with suppress(WaitTimeout):
            self.host.session.until(condition, timeout=max(0.0, timeout_s), what="an observation")
            return True
        return False

    def start_patience(self, seconds: float, stepped_s: float = 0.0) -> Patience:
        """Return for how long something is waited for that may never come: so many s at most.

        ``stepped_s`` is how long (s of wall time) the clock has been moving before: DDS has
        repaired lost messages in that time, too, so it counts as idle.
        """
        return Patience(self._still, seconds, max(LEAST_IDLE_S, self.host.idle_s - stepped_s))

    def wait_stepping(
        self,
        condition: Callable[[], Any],
        seconds: float | None = None,
        timeout_s: float | None = None,
    ) -> bool:
        """Let the nodes' time pass until ``condition`` holds; return whether it did.

        Args:
            condition: a function without arguments. Where it moves the clock itself, as a call
                may, that counts.
            seconds: of the nodes' time that there are; None is `LATEST_S`.
            timeout_s: seconds of wall time that it has to become visible; None is the host's.

        Raises:
            NotExaminable: that was over before the ``seconds`` were, and the host says why.
        """
        most = LATEST_S if seconds is None else seconds
        started, began_s = time.monotonic(), self.elapsed_s
        deadline = started + (self.host.settle_s if timeout_s is None else timeout_s)
        while not condition():
            now, spent_s = time.monotonic(), self.elapsed_s - began_s
            if most - spent_s <= STEP_S / 2:
                patience = self.start_patience(max(0.0, deadline - now), now - started)
                return patience.wait(self.host.session, condition)
            if now >= deadline:
                if seconds is not None and self.host.too_slow:
                    raise NotExaminable(self.host.too_slow)
                return False
            # After so long a wait it does not matter when exactly in a step something happens.
            self.step(STEP_S, GRAIN_S if spent_s < FINE_S else STEP_S)
            self.wait(condition, LOOK_S)
        return True

    def wait_for_arrival(self, condition: Callable[[], Any], seconds: float, step_s: float) -> bool:
        """Let the nodes' time pass until what was sent makes ``condition`` hold; return if it did.

        Each step waits until what was sent in it has come in. This is for a moment from which
        another one is reckoned: on a busy machine `wait_stepping` may notice some steps late.

        Args:
            condition: a function without arguments.
            seconds: of the nodes' time that there are.
            step_s: seconds of it between two looks.
        """
        began_s = self.elapsed_s
        self.drain()
        while not condition():
            if seconds - (self.elapsed_s - began_s) <= step_s / 2:
                return self.wait(condition)
            self.step(step_s)
            self.drain()
        return True

    # Telling and asking.

    def advertise(self, *topics: Topic) -> None:
        """Create publishers, before the nodes that are to hear them.

        A best-effort reader loses what comes before it knows of its writer.
        """
        for topic in topics:
            name = str(topic)
            self._publishers[name] = self.node.create_publisher(topic.type, name, LATCHED)

    def is_heard(self, topic: Topic) -> bool:
        """Return whether a node subscribes to a topic that the examiner has advertised.

        One that did not in good time is not waited for again.
        """
        name = str(topic)
        there: Callable[[], int] = self._publishers[name].get_subscription_count
        if name not in self._unheard and not self.wait(there):
            self._unheard.add(name)
        return bool(there())

    def require_heard(self, topic: Topic) -> None:
        """Require that a node subscribes to a topic that the examiner publishes on.

        Raises:
            Failed: none does.
        """
        if not self.is_heard(topic):
            raise Failed(
                expected=f"Your node listens to {topic.name}.", actual="Nobody subscribes to it."
            )

    def send(self, topic: Topic, message: Any) -> None:
        """Publish a message on an advertised topic, and let the nodes that listen take it in."""
        self.is_heard(topic)  # what is sent before DDS has connected them is lost
        self._publishers[str(topic)].publish(message)
        self._publishers[str(topic)].wait_for_all_acked(Duration(seconds=SETTLE_S))
        self.step(GRAIN_S)

    def call(self, service_type: Any, name: str, request: Any) -> Any | None:
        """Call a service; return its answer, or None if there was none in time.

        An answer that does not come at once may wait for the nodes' clock, which then moves on.
        """
        if name not in self._clients:
            self._clients[name] = self.node.create_client(service_type, name)
        client = self._clients[name]
        if not self.wait(client.service_is_ready):
            return None
        future = client.call_async(request)
        if self.wait(future.done, self._answer_patience_s(name)):
            return future.result()
        if self.wait_stepping(future.done):
            self._wait_for_the_clock.add(name)
            return future.result()
        client.remove_pending_request(future)
        return None

    def submit_request(self, name: str, function: Callable[[], T]) -> Future[T]:
        """Run a function that waits for an answer beside the check; return what it will return.

        Most answers are there at once. One that is not may wait for the nodes' clock, so whoever
        needs it moves that on. ``name`` is what it asks for.
        """
        answer = self._beside.submit(function)
        wait_for([answer], self._answer_patience_s(name))
        return answer

    def await_answer(self, answer: Future[T], name: str, seconds: float | None = None) -> None:
        """Let the nodes' time pass until an answer is there, for so many s of it at most."""
        if not answer.done() and self.wait_stepping(answer.done, seconds):
            self._wait_for_the_clock.add(name)

    def _answer_patience_s(self, name: str) -> float:
        return ANSWERED_AGAIN_S if name in self._wait_for_the_clock else ANSWERED_S

    def await_discovery(self) -> None:
        """Return when the nodes know every endpoint that the examiner has made so far."""
        await_discovery(self.node, self.wait)

    def drain(self) -> None:
        """Return when what the nodes have sent so far has come in: one has answered since."""
        if name := find_answering_service(self.node):
            self.call(GetParameters, name, GetParameters.Request())

    def error_note(self) -> str:
        """Return what a callback raised, as the end of a sentence; empty if none did.

        Once each: what one check has told is not the next one's cause.
        """
        try:
            raised = [error for error in self.host.errors() if error not in self._told]
        except StudentError:
            return ""
        self._told.update(raised)
        return f" ({callback_raised(raised[-1])})" if raised else ""

    def __enter__(self) -> Self:
        """Return the observer, whose node the end of the block takes down."""
        return self

    def __exit__(self, *_: object) -> None:
        """Take the examiner's node down."""
        self._beside.shutdown(wait=False)
        self.host.session.stop(self.node)
