"""The rig of the resources exam: looks at a camera driver on the graph, on the wire, in /proc.

The library ``Camera`` that the notebook gives opens a memory file ``camera:<device>`` for a device
and ``camera-stream:<device>`` for its stream, and moves the position in the first by one whenever
somebody asks for a picture. So what a node does with its camera is seen from outside.
"""

# mypy: allow-untyped-calls
# rclpy leaves most of its functions untyped.

from __future__ import annotations

import re
import secrets
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, NamedTuple

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image
from std_msgs.msg import Int32

from autograder.bench import REPLY_TIMEOUT, Bench, StudentError, SubjectGone
from autograder.exam import Failed
from autograder.rigs.process import Process
from autograder.rigs.quiet import QuietNode
from course import WaitTimeout
from course.runtime.names import full_name
from course.runtime.waiting import Deadline

IMAGE, ZOOM, SNAPSHOT = "camera/image", "camera/zoom", "camera/snapshot"

PUBLISHER = f"a publisher on {IMAGE}"
SUBSCRIPTION = f"a subscription to {ZOOM}"
SERVICE = f"a service {SNAPSHOT}"
TYPES = {
    PUBLISHER: "sensor_msgs/msg/Image",
    SUBSCRIPTION: "std_msgs/msg/Int32",
    SERVICE: "std_srvs/srv/Trigger",
}

SETTLE = 8.0
"""Seconds that something expected may take: it takes milliseconds, on a busy machine a few s."""
GHOSTS = 1.0
"""Seconds that endpoints of an earlier life are given to go off the graph."""
RESEND = 1.0
"""Seconds after which a request that has no response is made again."""
PERIOD = 0.1
"""Seconds of simulated time between two pictures, and of wall time between two probes."""


class Picture(NamedTuple):
    """What a picture's pixels say: its device, its number since the device was opened, its zoom.

    And when it was published, by DDS: in ns of this machine's time of day.
    """

    device: str
    number: int
    zoom: int
    published: int


def _picture(message: Any, published: int) -> Picture | None:
    label = bytes(message.data[:200]).split(b"\n")[0].decode(errors="replace")
    found = re.fullmatch(r"([\w-]{1,100}) (\d{1,9}) (\d{1,3})", label)
    return Picture(found[1], int(found[2]), int(found[3]), published) if found else None


class ExaminerNode(QuietNode):
    """The examiner's endpoints, and what each of two readers got, in the order of its arrival."""

    def __init__(self) -> None:
        """Listen on the image topic, whichever reliability is offered."""
        super().__init__(f"examiner_{secrets.token_hex(4)}")
        self.heard: dict[ReliabilityPolicy, list[Picture]] = {}
        for reliability in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT):
            qos = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=reliability)
            heard = self.heard[reliability] = []
            note = partial(self._note, heard)
            self.create_subscription(Image, IMAGE, note, qos)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.zoom = self.create_publisher(Int32, ZOOM, latched)

    def _note(self, heard: list[Picture], message: Any, info: dict[str, int]) -> None:
        if (picture := _picture(message, info["source_timestamp"])) is not None:
            heard.append(picture)

    def of(self, device: str) -> list[Picture]:
        """Return the pictures of ``device``, from the reliable reader if it gets any."""
        reliable, any_offer = (
            [picture for picture in list(heard) if picture.device == device]
            for heard in self.heard.values()
        )
        return reliable or any_offer


class CameraRig:
    """The examiner's view of one subject during the resources exam."""

    def __init__(self, bench: Bench) -> None:
        """Bring up the examiner's endpoints on the subject's domain, or go on with them.

        They stay from one part of the exam to the next. New ones would have to find out anew what
        is on the graph, and take what an earlier check left there for the next one's.
        """
        self.subject = bench.subject
        self.session = bench.session
        self.process = Process(bench.subject.pid)
        node = bench.memory.get(ExaminerNode.__name__) or bench.session.run(ExaminerNode)
        assert isinstance(node, ExaminerNode)
        bench.memory[ExaminerNode.__name__] = node
        self.node = node
        self.memory = bench.memory
        self._ghosts: set[bytes] = set()
        self._clean = False
        self._provoked = False
        self._clients: dict[str, Any] = {}

    # The subject.

    def fresh(self) -> None:
        """Begin a new session on simulated time; nothing of an earlier one goes on."""
        self.subject.open(sim_time=True)
        self._clean, self._provoked = True, False

    @contextmanager
    def life(self, name: str, *args: Any) -> Iterator[str]:
        """Give the full name of a node of the class ``name`` for one life.

        It is stopped at the end, unless it is destroyed by then. What its cleanup raises then is
        for another check to find.
        """
        with self.trying():
            node = self.start(name, *args)
            yield node
        try:
            self.subject.stop(name)
            self._clean = self._vanishes(node)
        except StudentError:
            self._clean = False

    def _vanishes(self, node: str) -> bool:
        """Whether a node that was stopped goes off the graph.

        rclpy 7.1 leaves the services of a destroyed lifecycle node there until it is collected; the
        next node of that name must not be taken for it.
        """
        service = f"{node}/get_state"
        if self.node.count_services(service):
            self.subject.collect()
        return self.wait(lambda: not self.node.count_services(service))

    @contextmanager
    def trying(self) -> Iterator[None]:
        """Begin with a clean session, and leave none to the next check if this one fails.

        What a wrong design has left on the graph by now is not held against it again, and what the
        examiner made a callback raise in an earlier check explains nothing in this one.
        """
        if not self._clean or self._provoked:
            self.fresh()
        self.wait(lambda: not self.endpoints(), GHOSTS)
        self._ghosts = {end for _, end in self._endpoints()}
        self._clean = False
        yield
        self._clean = True

    def start(self, name: str, *args: Any) -> str:
        """Make a node; return its fully qualified name."""
        try:
            return self.subject.start(name, *args)
        except StudentError as error:
            shown = ", ".join(repr(arg) for arg in args)
            raise Failed(
                expected=f"{name}({shown}) makes a node without an error.",
                actual=error.told,
            ) from None

    def stop(self, name: str, *, bare: bool = False) -> None:
        """Have the node taken out of its executor and destroyed.

        A session tidies up after its ``destroy_node()``; ``bare``: nobody does.
        """
        self._cleanup(name, lambda: self.subject.stop(name, bare=bare))

    def destroy(self, name: str) -> None:
        """Have ``destroy_node()`` called while the node spins."""
        self._cleanup(name, lambda: self.subject.call(name, "destroy_node"))

    def destroy_again(self, name: str) -> None:
        """Have ``destroy_node()`` called a second time, which must return as well."""
        try:
            self.destroy(name)
        except SubjectGone as gone:
            if not self.subject.hangs:
                raise
            raise Failed(
                expected="destroy_node() can be called a second time.",
                actual=f"The second call did not return within {REPLY_TIMEOUT:.0f} s.",
            ) from gone

    def drop(self, name: str) -> None:
        """Have the session let go of a node that is destroyed; it destroys it once more."""
        with suppress(StudentError):
            self.subject.stop(name)

    def _cleanup(self, name: str, act: Callable[[], object]) -> None:
        try:
            act()
        except StudentError as error:
            raise Failed(
                expected=f"destroy_node() of {name} ends without an error.",
                actual=error.told,
            ) from None

    def advance(self, seconds: float) -> None:
        """Move simulated time on."""
        try:
            self.subject.advance(seconds)
        except StudentError as error:
            raise Failed(
                expected="Your callbacks return, so that the next one can run.",
                actual=f"{error}{self.raised()}",
            ) from None

    def raised(self) -> str:
        """Return what the student's callbacks raised, as the end of a sentence."""
        errors = self.subject.errors()
        return f" (a callback raised: {errors[-1]})" if errors else ""

    def refused_zoom(self, factor: int) -> None:
        """Send a zoom that the camera does not have; it is with the driver when this returns."""
        self._provoked = True
        self.node.zoom.publish(Int32(data=factor))
        self.node.zoom.wait_for_all_acked(Duration(seconds=SETTLE))

    def ask(self, service: Any, name: str, request: Any, patience: float = SETTLE) -> Any:
        """Call a service; return its response, or None if none came in ``patience`` seconds.

        A response that goes out before its way back is known is lost: it is asked for again, so
        this is for requests that may be made twice.
        """
        deadline = Deadline(patience)
        client = self.client(service, name)
        self.wait(client.service_is_ready, deadline.left)
        replies: list[Any] = []
        while deadline.left:
            replies.append(client.call_async(request))
            self.wait(lambda: any(reply.done() for reply in replies), min(RESEND, deadline.left))
            for reply in replies:
                if reply.done():
                    return reply.result()
        return None

    def client(self, service: Any, name: str) -> Any:
        """Return the client of a service, one for all lives of its server."""
        if name not in self._clients:
            self._clients[name] = self.node.create_client(service, name)
        return self._clients[name]

    # What is seen.

    def wait(self, condition: Callable[[], Any], timeout: float = SETTLE) -> bool:
        """Wait until ``condition`` holds; return whether it did before the deadline."""
        with suppress(WaitTimeout):
            self.session.until(condition, timeout=timeout, what="an observation")
            return True
        return False

    def device(self, kind: str = "front") -> str:
        """Return a device that nobody else uses; ``kind`` is its name's beginning."""
        return f"{kind}-{secrets.token_hex(4)}"

    def cameras(self, device: str) -> list[int]:
        """Return how often each open camera of ``device`` was asked for a picture."""
        return self.process.positions(f"camera:{device}")

    def asked_during(self, device: str, act: Callable[[], object]) -> int:
        """Return for how many pictures the camera of ``device`` was asked while ``act`` ran."""
        before = highest = sum(self.cameras(device))
        over = threading.Event()

        def look() -> None:
            nonlocal highest
            while not over.wait(PERIOD):
                highest = max(highest, sum(self.cameras(device)))

        with ThreadPoolExecutor(max_workers=1) as beside:
            looking = beside.submit(look)
            try:
                act()
            finally:
                over.set()
        looking.result()
        return highest - before

    def streams(self, device: str) -> bool:
        """Whether the stream of ``device`` runs."""
        return bool(self.process.positions(f"camera-stream:{device}"))

    def pictures(self, device: str) -> list[Picture]:
        """Return the pictures of ``device`` that went over the topic, in order of arrival."""
        return self.node.of(device)

    def see(self, device: str, condition: Callable[[], Any] | None = None) -> bool:
        """Let time pass until ``condition`` (by default: that there is a picture) holds.

        Endpoints find each other in their own time, and what is sent before is lost.
        """
        condition = condition or (lambda: self.pictures(device))
        for _ in range(int(SETTLE / PERIOD)):
            self.advance(PERIOD)
            if self.wait(condition, PERIOD):
                return True
        return False

    def catch_up(self) -> None:
        """Wait until every endpoint that the subject has by now is known here.

        A participant's endpoints are told in order: those of a mark that is made now come last.
        """
        mark = f"mark_{secrets.token_hex(4)}"
        self.subject.mark(mark)
        self.wait(lambda: self.node.count_publishers(mark) and self.node.count_subscribers(mark))

    def publishers(self) -> int:
        """Return how many publishers there are on the image topic."""
        return sum(what == PUBLISHER and end not in self._ghosts for what, end in self._endpoints())

    def endpoints(self, node: str = "") -> list[str]:
        """Return the driver's endpoints that are on the graph, and whether ``node`` is."""
        ours = (*TYPES, f"the node {node}")
        there = {what for what, end in self._endpoints() if end not in self._ghosts}
        return [what for what in ours if what in there]

    def missing(self, node: str) -> list[str]:
        """Return what the driver ``node`` lacks on the graph, or has with another type."""
        services = dict(self.node.get_service_names_and_types())
        types = {
            PUBLISHER: {e.topic_type for e in self.node.get_publishers_info_by_topic(IMAGE)},
            SUBSCRIPTION: {e.topic_type for e in self.node.get_subscriptions_info_by_topic(ZOOM)},
            SERVICE: set(services.get(f"/{SNAPSHOT}", [])),
        }
        there = self.endpoints(node)
        found = [f"There is no {what[2:]} on the graph." for what in TYPES if what not in there]
        found += [
            f"There is {what} of the type {phrase(sorted(types[what]))}, not {wanted}."
            for what, wanted in TYPES.items()
            if what in there and wanted not in types[what]
        ]
        if not found and f"the node {node}" not in there:
            found = [f"The node {node} is not on the graph."]
        return found

    def _endpoints(self) -> list[tuple[str, bytes]]:
        found = {
            PUBLISHER: self.node.get_publishers_info_by_topic(IMAGE),
            SUBSCRIPTION: self.node.get_subscriptions_info_by_topic(ZOOM),
            # A service has no endpoints in ROS's eyes; in DDS it reads its requests.
            SERVICE: self.node.get_subscriptions_info_by_topic(f"rq/{SNAPSHOT}Request", True),
        }
        # Every node announces changes of its parameters: a node itself has no endpoint.
        for end in self.node.get_publishers_info_by_topic("/parameter_events"):
            name = full_name(end.node_name, end.node_namespace)
            found.setdefault(f"the node {name}", []).append(end)
        return [(what, bytes(end.endpoint_gid)) for what, ends in found.items() for end in ends]


@contextmanager
def camera_rig(bench: Bench) -> Iterator[CameraRig]:
    """Give a rig; the examiner's session takes its endpoints down at its end."""
    yield CameraRig(bench)


def phrase(items: list[str]) -> str:
    """Return a list as a phrase: "a, b and c"."""
    return " and ".join(part for part in (", ".join(items[:-1]), *items[-1:]) if part)
