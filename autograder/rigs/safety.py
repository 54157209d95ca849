"""The rig of the error-handling exam: one of the student's nodes at a time, on simulated time.

Only the examiner moves time. It does so in short strides, and lets both processes come to rest
after each, so that what it observes does not depend on the machine's load.
"""

# mypy: allow-untyped-calls
# rclpy leaves most of its functions untyped.

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.task import Future

from autograder.bench import Bench, Endpoints, StudentError
from autograder.exam import Failed
from autograder.rigs.quiet import QuietNode
from autograder.rigs.stillness import Stillness
from course import WaitTimeout

THREADS = 4
STRIDE = 0.1  # s of simulated time between two looks
COARSE = 0.5  # s between two looks where it does not matter when exactly something happens
ROUNDS = 10  # of requests that may follow from each other while time stands still
SETTLE = 8.0  # s of wall time that endpoints may take to find each other; 0.3 s as a rule

# Which QoS a student's subscription has is free: what is offered meets every demand but a deadline.
# Only one that joins later and demands it is sent the last message again.
LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
LOSSLESS = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)
UNDEMANDING = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT)


class Player(QuietNode):
    """The examiner's end of one part of the task: plays the world around the student's node."""

    def __init__(self, name: str) -> None:
        """Create no endpoints yet; ``now`` is simulated time in s, which the rig keeps."""
        super().__init__(name)
        self.now = 0.0
        self._ears: dict[str, tuple[Any, Callable[[Any], None]]] = {}
        self.spoken: list[str] = []
        self.used: list[str] = []
        self._paused: deque[tuple[Executor, Future]] = deque()

    async def pause(self, server: Node) -> None:
        """Let a server of the examiner's wait until the subject has come to rest.

        rclpy's action client registers a request after it has sent it, and drops an answer that
        another thread takes in between. Where the student's node runs in several threads, an
        answer must not be faster than the line that asks.
        """
        executor = server.executor
        assert isinstance(executor, Executor)
        over = Future(executor=executor)
        self._paused.append((executor, over))
        await over

    def resume(self) -> bool:
        """Let all go on that wait in `pause`; return whether there were any."""
        resumed = False
        while self._paused:
            executor, over = self._paused.popleft()
            over.set_result(None)
            executor.wake()
            resumed = True
        return resumed

    def hear(self, msg_type: Any, topic: str, note: Callable[[Any], None]) -> None:
        """Listen to a topic that the student's node publishes on, once it does."""
        self._ears[topic] = (msg_type, note)

    @property
    def heard(self) -> list[str]:
        """The topics that the student's node publishes on."""
        return list(self._ears)

    def attend(self) -> None:
        """Subscribe, with what is offered: lossless wherever that is possible."""
        for topic, (msg_type, note) in self._ears.items():
            offers = [end.qos_profile for end in self.get_publishers_info_by_topic(topic)]
            reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offers)
            self.create_subscription(msg_type, topic, note, LOSSLESS if reliable else UNDEMANDING)

    def speak(self, msg_type: Any, topic: str) -> Any:
        """Return a publisher on a topic that the student's node listens to."""
        self.spoken.append(topic)
        return self.create_publisher(msg_type, topic, LATCHED)

    def unheard(self) -> str:
        """Return which of the node's subscriptions cannot be served, and why; empty if none."""
        for topic in self.spoken:
            offers = [end.qos_profile for end in self.get_publishers_info_by_topic(topic)]
            demands = [end.qos_profile for end in self.get_subscriptions_info_by_topic(topic)]
            pairs = [qos_check_compatible(offer, demand) for offer in offers for demand in demands]
            if pairs and all(verdict == QoSCompatibility.ERROR for verdict, _why in pairs):
                why = str(pairs[0][1]).partition(";")[0].removeprefix("ERROR: ")
                return f"Its subscription to {topic} demands more than any publisher offers: {why}."
        return ""

    def uses(self, service: str) -> None:
        """Say that the examiner is a client of a service that the student's node serves."""
        self.used.append(service)

    def missing(self) -> str:
        """Return what the student's node lacks, a sentence each; empty if all is connected."""
        lacking = [f"no publisher on {t}" for t in self.heard if not self.count_publishers(t)]
        lacking += [f"no subscription to {t}" for t in self.spoken if not self.count_subscribers(t)]
        lacking += self.missing_servers()
        return "There is " + ", ".join(lacking) + "." if lacking else ""

    def missing_servers(self) -> list[str]:
        """Return which of the student's servers and clients are not there, a phrase each."""
        return []


PlayerT = TypeVar("PlayerT", bound=Player)


class Robot:
    """One of the student's nodes at work."""

    def __init__(self, bench: Bench, name: str, player: Player, still: Stillness) -> None:
        """Make the node of class ``name`` in the subject's present session.

        Raises:
            Failed: it cannot be made, or lacks an endpoint of the task.
        """
        self.name, self._bench, self._player, self._still = name, bench, player, still
        self._unserved = False
        self._known = bench.subject.own_errors()  # of earlier nodes of the same session
        try:
            bench.subject.start(name)
        except StudentError as error:
            raise Failed(
                expected=f"{name}() makes a node without an error.",
                actual=error.told,
            ) from None
        self.wait(lambda: not player.missing())
        if lacking := player.missing():
            raise Failed(expected=f"{name} has every endpoint of the task.", actual=lacking)
        if unheard := player.unheard():
            raise Failed(expected=f"{name} can hear what it is told.", actual=unheard)
        player.attend()
        self.sees(
            {"publishers": player.spoken, "subscribers": player.heard, "clients": player.used}
        )
        self.rest()

    def wait(self, condition: Callable[[], Any], timeout: float = SETTLE) -> bool:
        """Wait for something of DDS's own: simulated time stands still."""
        with suppress(WaitTimeout):
            self._bench.session.until(condition, timeout=timeout, what="an observation")
            return True
        return False

    def sees(self, endpoints: Endpoints, there: bool = True) -> bool:
        """Wait until the node has discovered each endpoint, or the loss of each; return if so."""

        def all_seen() -> bool:
            counts = self._bench.subject.sees(self.name, endpoints)
            return all(bool(n) is there for kind in counts.values() for n in kind.values())

        return self.wait(all_seen)

    def rest(self) -> None:
        """Return when all that was sent has been dealt with, on both sides.

        A node that meets each answer with another request never comes to rest: time goes on.
        """
        self._still.reached()
        for _ in range(ROUNDS):
            if not self._player.resume():
                return
            self._still.reached()

    def run(self, until: Callable[[], Any], limit: float, stride: float = STRIDE) -> bool:
        """Let time pass until ``until`` holds, ``limit`` s at most; return whether it does."""
        end = self._player.now + limit
        self.rest()
        while not until():
            if self._player.now >= end - STRIDE / 2:
                return False
            self._go_on(min(stride, end - self._player.now))
        return True

    def spend(self, seconds: float, stride: float = STRIDE) -> None:
        """Let so much time pass."""
        self.run(lambda: False, seconds, stride)

    @contextmanager
    def unserved(self) -> Iterator[None]:
        """Let no callback wait by the wall clock within the block: nobody serves what it asks for.

        How much simulated time such a wait takes depends on the machine, and so would every
        observation. Threads of the student's own may wait as they like.
        """
        self._unserved = True
        try:
            yield
        finally:
            self._unserved = False

    def _go_on(self, seconds: float) -> None:
        # Now, and not after the stride: what the node does has just come to rest, so that a wait
        # has only begun, while a stride with a blocked callback takes long in real time.
        waits = self._bench.subject.wall_waits() if self._unserved else []
        self._player.now += seconds  # before: what comes in on the way bears the stride's end
        try:
            self._bench.subject.advance(seconds)
        except StudentError:
            raise Failed(
                expected=f"No callback of {self.name} blocks while something is slow or broken.",
                actual="A callback held up the node so that even its clock stood still."
                + _of_waits(waits)
                + self.complaint(),
            ) from None
        if waits:
            raise Failed(
                expected=f"All waiting of {self.name} runs on the node's clock.",
                actual=_of_waits(waits).strip(),
            )
        self.rest()

    def complaint(self) -> str:
        """Return what a callback and a thread raised last, a sentence each; empty if none did."""
        raised, ended = self._bench.subject.errors(), self._bench.subject.thread_errors()
        told = f" A callback raised {raised[-1].rstrip('.')}." if raised else ""
        return told + (f" A thread of yours ended with {ended[-1].rstrip('.')}." if ended else "")

    def require_no_errors(self) -> None:
        """Require that nothing of the student's own has left a callback since the node was made."""
        for told, count in self._bench.subject.own_errors().items():
            if count > self._known.get(told, 0):
                raise Failed(
                    expected="Nothing leaves a callback as an exception.",
                    actual=f"What was seen from outside was right, but {told.rstrip('.')}.",
                )


def following(before: list[str]) -> str:
    """Return which request a request follows, to put behind it; empty if it is the first one."""
    return f", the next one after “{before[0]}”" if before else ""


def _of_waits(waits: list[str]) -> str:
    """Return a sentence on callbacks that wait by the wall clock, to add; empty if none does."""
    return f" A callback waits on the wall clock in {waits[0].rstrip('.')}." if waits else ""


class RobotRig:
    """Gives each check the node that it examines, and its counterpart."""

    def __init__(self, bench: Bench) -> None:
        """Nothing runs yet."""
        self.bench = bench
        self._robot: Robot | None = None
        self._player: Player | None = None
        self._fresh = False
        self._still = Stillness(bench.subject.pid)

    @contextmanager
    def robot(self, name: str, player: type[PlayerT]) -> Iterator[tuple[Robot, PlayerT]]:
        """Give the node of a class and its counterpart; after a failed check, fresh ones.

        A check that passed leaves a subject that can go on: another session would have to be
        discovered first. One that failed may have left callbacks that never end.
        """
        try:
            if self._robot is None or self._robot.name != name:
                self._change_to(name, player)
            assert self._robot is not None
            assert isinstance(self._player, player)
            yield self._robot, self._player
        except BaseException:
            self._robot, self._fresh = None, False
            raise

    def _change_to(self, name: str, player: type[Player]) -> None:
        self.renew()
        if not self._fresh:
            self.bench.subject.open(threads=THREADS, sim_time=True)
            self._fresh = True
        made = self.bench.session.run(player)
        assert isinstance(made, player)
        self._player = made
        self._robot = Robot(self.bench, name, made, self._still)

    def renew(self) -> None:
        """Have the next check begin with a fresh node, in the same session."""
        if self._robot is not None:
            self.bench.subject.stop(self._robot.name)
        self.clear()

    def begin_anew(self) -> None:
        """Have the next check begin with a fresh node in a fresh session, whose time begins at 0.

        A constructor always finds the clock at 0. In a session where time has gone on, a thread
        that it starts has to catch up with it first.
        """
        self.clear()
        self._fresh = False

    def once(self, trial: Callable[[RobotRig], None]) -> None:
        """Run a trial that others build on, unless an earlier part of the exam has passed it."""
        if trial.__name__ not in self.bench.memory:
            trial(self)
            self.bench.memory[trial.__name__] = True

    def clear(self) -> None:
        """Take the examiner's end down."""
        self._robot = None
        if self._player is not None:
            self.bench.session.stop(self._player)
            self._player = None


@contextmanager
def serving(
    rig: RobotRig, robot: Robot, make: Callable[[], Node], services: Endpoints
) -> Iterator[None]:
    """Run a server of the examiner's for the length of the block; the robot knows both ends."""
    server = rig.bench.session.run(make)
    try:
        robot.sees(services)
        robot.rest()
        yield
    finally:
        rig.bench.session.stop(server)


@contextmanager
def robot_rig(bench: Bench) -> Iterator[RobotRig]:
    """Give a rig, and take the examiner's endpoints down afterwards."""
    rig = RobotRig(bench)
    try:
        yield rig
    finally:
        rig.clear()
