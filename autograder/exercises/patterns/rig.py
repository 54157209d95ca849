"""The rig of the pattern exam: plays the robot's hardware, and the rest of the robot's system.

The robot's wheels are patient: it moves only while the student's node commands a speed, and only
when a check has it roll on. So a drive takes as long as the student's code needs, on simulated time
or on the wall's, and what comes before what is known for certain.
"""

from __future__ import annotations

import time
from bisect import bisect_left
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from rclpy.duration import Duration
from std_msgs.msg import Float64

from autograder.examination.check_context import CheckContext, StudentError
from autograder.examination.exam import Failed
from autograder.exercises.patterns.hardware import ExaminerNode
from autograder.observe.patience import IDLE_S, Patience
from autograder.observe.phrases import callback_raised
from autograder.observe.stillness import Stillness
from course.errors import WaitTimeout
from course.runtime.core_session import CoreSession

T = TypeVar("T")

Asker = Callable[["RobotRig"], tuple[str, list[float]]]
"""Finds out the position: what came, as a clause, and the numbers in it."""

NODE = "RobotInterface"
THREADS = 4
SETTLE = 8.0
"""Seconds that something expected may take: discovery takes 0.3 s, on a busy machine a few."""
ANSWERED, AGAIN = 1.0, 0.1
"""Seconds of wall time for an answer before the clock moves on, which it may wait for: the first
time, and where one has been found to wait."""
LATEST = 10.0
"""Seconds of simulated time for which an examiner waits, unless a task gives a time."""
LEAST_IDLE = 0.5
"""Seconds for which all threads sleep after the last step, before the wait is given up."""
LEVEL_MARGIN = 1e-3
STEP, GRAIN, FINE = 0.1, 0.01, 2.0
"""Seconds of simulated time: in one step; between two clock messages within a step; and into a wait
after which there is only one such message a step."""


class RobotRig:
    """The examiner's view of one subject during the pattern exam.

    Attributes:
        still: since when (ns, as messages are stamped) the student's clock stands still.
        elapsed: seconds of simulated time so far.
        position: where the hardware said last that the robot is (m).
        untouched: whether the speed limit is still what it was at the start.
        first_top: the highest speed of the first drive, if the limit was untouched until then.
        films: whether the camera has been found to stream.
        asker: how the position has been found out, once it has been.
        broadcasts: whether a new battery level has been found to come.
        limit: the speed limit that was set last, once setting it has been found to work.
        obeyed: the one that the robot has last been found to drive at.
        settle: seconds that something expected may take.
    """

    def __init__(self, bench: CheckContext, session: CoreSession | None = None) -> None:
        """Bring up the examiner's endpoints on the subject's domain, or on a ``session``'s."""
        self.bench = bench
        self.subject = bench.subject
        self.session = session or bench.session
        self.memory = bench.memory
        self.draws = bench.draws
        node = self.session.run(ExaminerNode)
        assert isinstance(node, ExaminerNode)
        self.node = node
        self.still = 0
        self.elapsed = 0.0
        self.position = 0.0
        self.untouched = True
        self.first_top: float | None = None
        self.films = False
        self.asker: Asker | None = None
        self.broadcasts = False
        self.limit: float | None = None
        self.obeyed: float | None = None
        self.settle = SETTLE
        self._threads = Stillness(bench.outside)
        self._steps = [(0, 0.0)]
        self._beside = ThreadPoolExecutor(thread_name_prefix="asking")
        self._clients: dict[str, Any] = {}
        self._by_the_clock: set[str] = self.memory.setdefault("answers by the clock", set())
        self._told: set[str] = set()
        self._deaf_to: set[str] = set()

    # Time.

    def start(self) -> None:
        """Have the student's node made, on simulated time.

        Raises:
            StudentError: it could not be made.
        """
        self.subject.open(threads=THREADS, sim_time=True)
        self.subject.start(NODE)
        self.stands_still()

    def stands_still(self) -> None:
        """Note since when (ns, as messages are stamped) the student's clock stands still."""
        self.still = time.time_ns()

    def step(self, seconds: float = STEP, grain: float = GRAIN) -> None:
        """Move the student's clock on; everything that this sets off has then run.

        ``grain`` is the time (s) between two moments that the student's nodes get to see.
        """
        self._advance_clock(seconds, grain)
        self.elapsed = round(self.elapsed + seconds, 6)
        self.stands_still()
        self._steps.append((self.still, self.elapsed))

    def _advance_clock(self, seconds: float, grain: float) -> None:
        try:
            self.subject.advance(seconds, grain)
        except StudentError as error:
            told = str(error).partition(": ")[2] or str(error)  # without the exception's name
            raise Failed(
                expected="Your callbacks end, sleep or await, so that the others get their turn.",
                actual=f"{told.rstrip('.')}. Does one go on without a pause, wait for another "
                f"one, or spin the node, which spins already? Or do so many wait for the clock at "
                f"once that all {THREADS} threads are taken?",
            ) from None

    def nudge(self) -> None:
        """Tell the student's nodes that hardly any time has passed, and wait for nothing."""
        self.subject.nudge()

    def clock_at(self, moment: int) -> tuple[float, float]:
        """Return between which simulated times (s) the student's clock was at a ``moment`` (ns)."""
        at = bisect_left(self._steps, (moment, 0.0))
        return self._steps[at - 1][1], self._steps[at][1] if at < len(self._steps) else self.elapsed

    def wait(self, condition: Callable[[], Any], timeout: float | None = None) -> bool:
        """Wait until ``condition`` holds, the student's clock standing still; return whether.

        Without ``timeout`` (s) as long as it may come: see `Patience`.
        """
        if timeout is None:
            return self.start_patience(self.settle).wait(self.session, condition)
        with suppress(WaitTimeout):
            self.session.until(condition, timeout=max(0.0, timeout), what="an observation")
            return True
        return False

    def start_patience(self, seconds: float, stepped: float = 0.0) -> Patience:
        """Return for how long something is waited for that may never come: so many s at most.

        ``stepped`` is how long (s of wall time) the clock has been moving before: DDS has repaired
        lost messages in that time, too, so it counts as idle.
        """
        return Patience(self._threads, seconds, max(LEAST_IDLE, IDLE_S - stepped))

    def wait_stepping(
        self,
        condition: Callable[[], Any],
        seconds: float | None = None,
        timeout: float | None = None,
        step: float = STEP,
    ) -> bool:
        """Let the student's clock run until ``condition`` holds; return whether it did.

        Args:
            condition: a function without arguments. Where it moves the clock itself, as a call
                may, that counts.
            seconds: of simulated time that there are; None is `LATEST`.
            timeout: seconds of wall time that it has to become visible here; None is `settle`.
            step: seconds of simulated time between two looks.
        """
        most = LATEST if seconds is None else seconds
        started, began = time.monotonic(), self.elapsed
        deadline = started + (self.settle if timeout is None else timeout)
        while not condition():
            if time.monotonic() >= deadline:
                return False
            if most - (self.elapsed - began) <= step / 2:
                now = time.monotonic()
                patience = self.start_patience(max(0.0, deadline - now), now - started)
                return patience.wait(self.session, condition)
            # After so long a wait it does not matter when exactly in a step something happens.
            self.step(step, GRAIN if self.elapsed - began < FINE else step)
            self.wait(condition, 0.01)
        return True

    # Asking.

    def call(self, srv_type: Any, name: str, request: Any) -> Any | None:
        """Call a service of the subject's; return its answer, or None if there was none in time.

        An answer that does not come at once may wait for the node's clock, which then moves on.
        """
        if name not in self._clients:
            self._clients[name] = self.node.create_client(srv_type, name)
        client = self._clients[name]
        if not self.wait(client.service_is_ready):
            return None
        future = client.call_async(request)
        patience = self._answer_patience(name)
        if self.wait(future.done, patience):
            return future.result()
        if self.wait_stepping(future.done, timeout=max(patience, self.settle - patience)):
            self._by_the_clock.add(name)
            return future.result()
        client.remove_pending_request(future)
        return None

    def _answer_patience(self, name: str) -> float:
        """Return for how long the clock stands still for an answer (s of wall time)."""
        return AGAIN if name in self._by_the_clock else ANSWERED

    def submit_request(self, name: str, function: Callable[[], T]) -> Future[T]:
        """Run a function that waits for an answer beside the check; return what it will return.

        Most answers are there at once. One that is not may wait for the node's clock, so whoever
        needs it moves that on. ``name`` is what it asks for.
        """
        answer = self._beside.submit(function)
        wait_for([answer], self._answer_patience(name))
        return answer

    def run_request(self, name: str, function: Callable[[], T]) -> T:
        """Return what a function that waits for an answer returns, or raise what it raises."""
        answer = self.submit_request(name, function)
        self.await_answer(answer, name)
        return answer.result()

    def await_answer(self, answer: Future[T], name: str, seconds: float | None = None) -> None:
        """Let the student's clock run until an answer is there, for so long (s) at most."""
        if not answer.done() and self.wait_stepping(answer.done, seconds):
            self._by_the_clock.add(name)

    def close(self) -> None:
        """Take the examiner's endpoints down."""
        self._beside.shutdown(wait=False)
        self.session.stop(self.node)

    # The hardware.

    def report(self, what: str, value: float) -> None:
        """Have the hardware report a value once, and the student's node take it in."""
        self.listens_to(what)  # what is sent before DDS has connected them is lost
        self.publish(what, value)
        self.node.hardware[what].wait_for_all_acked(Duration(seconds=SETTLE))
        self.step(0.01)

    def publish(self, what: str, value: float) -> None:
        """Have the hardware report a value, and let it find its way."""
        if what == "position":
            self.position = value
        self.node.hardware[what].publish(Float64(data=value))

    def listens_to(self, what: str) -> bool:
        """Return whether the student's node subscribes to ``hardware/<what>``.

        One that did not in good time is not waited for again.
        """
        there = self.node.hardware[what].get_subscription_count
        if what in self._deaf_to or self.wait(there):
            return bool(there())
        self._deaf_to.add(what)
        return False

    @property
    def speed(self) -> float:
        """The last commanded speed in m/s."""
        return self.node.speeds[-1] if self.node.speeds else 0.0

    def told_level(self, level: float) -> bool:
        """Return whether the last battery level that was heard is ``level``."""
        return bool(self.node.levels) and abs(self.node.levels[-1] - level) < LEVEL_MARGIN

    def error_note(self) -> str:
        """Return what a callback of the student's raised, as the end of a sentence.

        Once each: what one check has told is not the next one's cause.
        """
        try:
            raised = [error for error in self.subject.errors() if error not in self._told]
        except StudentError:
            return ""
        self._told.update(raised)
        return f" ({callback_raised(raised[-1])})" if raised else ""


@contextmanager
def robot_rig(bench: CheckContext) -> Iterator[RobotRig]:
    """Give a rig, and take the examiner's endpoints down afterwards."""
    rig = RobotRig(bench)
    try:
        yield rig
    finally:
        rig.close()
