"""What a camera driver does: its endpoints, its snapshots and zooms, and what its end leaves."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rclpy.duration import Duration
from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from autograder.examination.check_context import StudentError
from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_examiner import IMAGE, SNAPSHOT, ZOOM
from autograder.exercises.resources.rig import (
    DRIVER,
    PERIOD_S,
    STEP_S,
    CameraRig,
    ObservedCamera,
    new_device,
)
from autograder.observe.patience import SETTLE_S

RUNS = "While the driver runs"
DEFAULT_DEVICE = "front"
FURTHER = 3
"""Pictures: one may have been under way with another zoom."""
TICKS = 20
"""Ticks in which a picture with a new zoom comes, or a slow camera is behind with them."""
BURST = 4
"""Snapshots that are asked for at once."""
A_FEW = 5
"""Ticks, and pictures of a slow camera: 4 that take 0.3 s each are as many as a second allows."""


@contextmanager
def run_driver(rig: CameraRig, kind: str = "front") -> Iterator[Driver]:
    """Give a driver for one life, with a camera of a ``kind``."""
    device = new_device(kind)
    with rig.life(DRIVER, device) as node:
        yield Driver(rig, node, device)


def require_default_device(rig: CameraRig) -> None:
    """Fail unless the driver can be made without arguments, and then opens the front camera.

    Unless somebody has it open already: a notebook's own driver may run.
    """
    front = Driver(rig, "", DEFAULT_DEVICE)
    if not front.asked():
        with rig.life(DRIVER):
            front.require_open()


def start_driver(rig: CameraRig) -> Driver:
    """Start a driver with a camera of its own, and leave its end to the caller."""
    device = new_device()
    return Driver(rig, rig.start(DRIVER, device), device)


def attempt_start(rig: CameraRig, device: str) -> None:
    """Start the driver on a ``device`` that has something wrong with it: it must raise."""
    try:
        rig.subject.start(DRIVER, device)
    except StudentError:
        return
    rig.stop(DRIVER)
    raise Failed(
        expected=f"{DRIVER}({device!r}) raises: who starts a driver must learn that it has no "
        "picture to give.",
        actual="It made a node as if all were well.",
    )


class Driver(ObservedCamera):
    """One life of a camera driver."""

    def require_endpoints(self) -> None:
        """Fail unless its endpoints are all on the graph, with their types."""
        self.rig.require_endpoints(self.node)

    def require_gone(self, when: str) -> None:
        """Fail if an endpoint or a node of it is on the graph: it may have made several."""
        self.rig.require_gone(self.node, when, self.count, "pictures")

    # Snapshots.

    def require_snapshot(self, when: str = RUNS, *, slow: bool = False) -> None:
        """Fail unless a snapshot is answered, and its picture comes without time passing.

        With a ``slow`` camera an answer that does not wait for its picture comes clearly too early.
        """
        before, asked = self.count(), self.count_asked()
        reply = self.rig.ask(Trigger, SNAPSHOT, Trigger.Request(), nudging=True)
        answered = time.time_ns()
        if reply is None:
            raise Failed(
                expected=f"{when} the service {SNAPSHOT} answers, without waiting for the next "
                "tick.",
                actual=f"No answer came while the node's clock stood still{self.rig.error_note()}.",
            )
        if not reply.success:
            raise Failed(
                expected=f"{when} {SNAPSHOT} succeeds.", actual="It answered with success=False."
            )
        if slow:  # its picture is still being exposed if the answer has not waited for it
            self.rig.settle_messages()
        if not self.rig.wait(lambda: self.count() > before):
            raise Failed(
                expected=f"{when} {SNAPSHOT} publishes a picture on {IMAGE} at once.",
                actual="It answered, but no picture came.",
            )
        # By the time that DDS gives it, which is this machine's; what came after a rest, since.
        if slow and all(picture.published > answered for picture in self.pictures()[before:]):
            raise Failed(
                expected=f"{when} {SNAPSHOT} answers when its picture has been published.",
                actual="It answered before it had taken one.",
            )
        # A thread may read all the time, and the snapshot publish what it read last.
        if not self.rig.wait(lambda: self.count_asked() > asked):
            raise Failed(
                expected=f"{when} {SNAPSHOT} takes a picture.",
                actual="It published an old one: the camera was not asked.",
            )

    def require_one_picture_each(self) -> None:
        """Fail if snapshots publish more pictures than they are asked for, as time stands still."""
        self.let_arrive()
        before, requests = self.count(), self.rig.requests
        for _ in range(FURTHER):
            self.require_snapshot()
        self.let_arrive()
        came, asked = self.count() - before, self.rig.requests - requests
        if came > asked + 1:  # a tick's may have been on its way
            raise Failed(
                expected=f"{RUNS} {SNAPSHOT} takes one picture.",
                actual=f"{asked} snapshots published {came} pictures.",
            )

    def begin_snapshots(self, *, answered: bool) -> Callable[[], int]:
        """Ask for some snapshots, and return when a callback waits for the picture of one.

        A design that takes several pictures at a time has then answered nearly all. So it is enough
        that the camera is asked, unless one has to be ``answered`` first.

        Return a function that says how many of them have not succeeded by the time of its call.

        rclpy 7.1 resumes a callback that awaits a future when its executor has something else to
        do: on a robot, at the next tick. Here time stands still, so that ticks ask the camera for
        no picture; a zoom is that something, or a nudge, where zooms are of the callback group that
        awaits.
        """
        client = self.rig.client_of(Trigger, SNAPSHOT)
        asked = self.count_asked()
        replies = [client.call_async(Trigger.Request()) for _ in range(BURST)]

        def does_next_wait() -> bool:
            done, more = [reply.done() for reply in replies], self.count_asked() - asked
            return all(done) or (any(done) and more >= 2) or (not answered and more >= 1)

        patience = self.rig.start_patience()
        while not self.rig.wait(does_next_wait, PERIOD_S) and patience.has_time_left():
            self.rig.node.zoom.publish(Int32(data=1))
            self.rig.nudge()
        if not any(reply.done() for reply in replies) and (answered or not does_next_wait()):
            raise Failed(
                expected=f"The service {SNAPSHOT} answers when the picture is there.",
                actual=f"No answer came{self.rig.error_note()}.",
            )
        return lambda: sum(not (reply.done() and reply.result().success) for reply in replies)

    # Zooms.

    def require_zoom(self, factor: int, when: str = RUNS, *, once: bool = False) -> None:
        """Fail unless pictures come with the zoom ``factor`` soon after it was sent.

        It is sent again until it is followed, as DDS may not have connected both ends; or ``once``,
        where one has been followed before and the subscription is reliable.
        """
        offers = self.rig.node.get_subscriptions_info_by_topic(ZOOM)
        lossy = any(o.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT for o in offers)
        patience, sent = self.rig.start_patience(), False
        while patience.has_time_left():
            if not (once and sent) or lossy:
                self.rig.node.zoom.publish(Int32(data=factor))
                sent = True
            self.require_snapshot(when)
            if self.rig.wait(lambda: self.last_zoom() == factor, PERIOD_S):
                return
        does = f"one message on {ZOOM} sets a zoom of {factor}"
        raise Failed(
            expected=f"{when} {does if once else f'a zoom of {factor} on {ZOOM} is followed'}.",
            actual=f"The pictures went on with a zoom of {self.last_zoom()}"
            f"{self.rig.error_note()}.",
        )

    def require_zoom_kept(self, factor: int, when: str) -> None:
        """Fail unless further pictures have the zoom ``factor``, without its being sent again."""
        for _ in range(FURTHER):
            self.require_snapshot(when)
        if not self.rig.wait(lambda: self.last_zoom() == factor):
            raise self._wrong_zoom(
                f"{when} the next pictures have a zoom of {factor}, until another one is set."
            )

    def require_tick_zoom(self, factor: int) -> None:
        """Fail unless pictures that nobody asks for have the zoom ``factor``, too."""
        before = self.count()

        def has_come() -> bool:
            return any(picture.value.zoom == factor for picture in self.pictures()[before:])

        for _ in range(TICKS):
            self.rig.advance(STEP_S)
            if self.rig.wait(has_come, PERIOD_S):
                return
        raise self._wrong_zoom(
            f"After a zoom of {factor} the ten pictures a second have a zoom of {factor} as well."
        )

    def _wrong_zoom(self, expected: str) -> Failed:
        had = f"They had a zoom of {self.last_zoom()}{self.rig.error_note()}."
        return Failed(expected=expected, actual=had)

    def refuse_zoom(self, factor: int = 99) -> None:
        """Send a zoom that the camera does not have; it is with the driver when this returns."""
        self.rig.provoked = True
        self.rig.node.zoom.publish(Int32(data=factor))
        self.rig.node.zoom.wait_for_all_acked(Duration(seconds=SETTLE_S))

    def last_zoom(self) -> int:
        """Return the zoom of the picture that came last."""
        return int(self.pictures()[-1].value.zoom)

    # The end of a busy one.

    def require_no_queue(self, destroy: Callable[[], object]) -> None:
        """Fail if ``destroy`` waits for all pictures that a slow camera is behind with."""
        before = self.count_asked()
        self.rig.advance(A_FEW * PERIOD_S)
        if self.count_asked() - before < A_FEW - 1:  # it does not take them one by one at once
            self.rig.advance(TICKS * PERIOD_S)
        before = self.count_asked()  # it is closed at the end, and not counted any more
        if (asked := self.rig.highest_during(destroy, self.count_asked) - before) > A_FEW:
            raise Failed(
                expected="destroy_node() ends every thread within a second, also while the camera "
                "is slower than the timer.",
                actual=f"While it ran the camera was asked for {asked} more pictures, each of "
                "which takes 0.3 s: they had been ordered before, and waited in a queue.",
            )
