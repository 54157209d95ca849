"""What a camera driver does when it is asked: snapshots, zooms, and what happens in between."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_examiner import IMAGE, SNAPSHOT, ZOOM
from autograder.exercises.resources.camera_rate import let_arrive
from autograder.exercises.resources.rig import PERIOD, CameraRig

FURTHER = 3  # pictures: one may have been under way with another zoom
BURST = 4  # snapshots that are asked for at once
A_FEW, MANY = 5, 20  # ticks
LAST_ONES = 5  # pictures: 4 that take 0.3 s each are about as many as a second allows


def require_snapshot(rig: CameraRig, device: str, when: str, *, slow: bool = False) -> None:
    """Fail unless a snapshot is answered, and its picture comes without time passing.

    With a ``slow`` camera an answer that does not wait for its picture comes clearly too early.
    """
    before, asked = len(rig.get_pictures(device)), sum(rig.open_cameras(device))
    reply = rig.ask(Trigger, SNAPSHOT, Trigger.Request(), nudging=True)
    answered = time.time_ns()
    if reply is None:
        raise Failed(
            expected=f"{when} the service {SNAPSHOT} answers, without waiting for the next tick.",
            actual=f"No answer came while the node's clock stood still{rig.error_note()}.",
        )
    if not reply.success:
        raise Failed(
            expected=f"{when} {SNAPSHOT} succeeds.", actual="It answered with success=False."
        )
    if slow:  # its picture is still being exposed if the answer has not waited for it
        rig.settle_messages()
    if not rig.wait(lambda: len(rig.get_pictures(device)) > before):
        raise Failed(
            expected=f"{when} {SNAPSHOT} publishes a picture on {IMAGE} at once.",
            actual="It answered, but no picture came.",
        )
    # By the time that DDS gives it, which is this machine's; what came after a rest, since then.
    if slow and not any(p.published <= answered for p in rig.get_pictures(device)[before:]):
        raise Failed(
            expected=f"{when} {SNAPSHOT} answers when its picture has been published.",
            actual="It answered before it had taken one.",
        )
    # A thread may read all the time, and the snapshot publish what it read last.
    if not rig.wait(lambda: sum(rig.open_cameras(device)) > asked):
        raise Failed(
            expected=f"{when} {SNAPSHOT} takes a picture.",
            actual="It published an old one: the camera was not asked.",
        )


def require_one_picture_each(rig: CameraRig, device: str, when: str) -> None:
    """Fail if snapshots publish more pictures than they are asked for, while time stands still."""
    let_arrive(rig, device)
    before, requests = len(rig.get_pictures(device)), rig.requests
    for _ in range(FURTHER):
        require_snapshot(rig, device, when)
    let_arrive(rig, device)
    came, asked = len(rig.get_pictures(device)) - before, rig.requests - requests
    if came > asked + 1:  # a tick's may have been on its way
        raise Failed(
            expected=f"{when} {SNAPSHOT} takes one picture.",
            actual=f"{asked} snapshots published {came} pictures.",
        )


def require_snapshots_under_way(
    rig: CameraRig, device: str, *, answered: bool = True
) -> Callable[[], int]:
    """Ask for some snapshots; fail unless one is answered. A callback waits for the next one then.

    A design that takes several pictures at a time has then answered nearly all. So without
    ``answered`` it is enough that the camera is asked: a callback waits for the first one.

    Return a function that says how many of them have not succeeded by the time of its call.

    rclpy 7.1 resumes a callback that awaits a future when its executor has something else to do: on
    a robot, at the next tick. Here time stands still, so that ticks ask the camera for no picture;
    a zoom is that something, or a nudge, where zooms are of the callback group that awaits.
    """
    snapshot = rig.get_client(Trigger, SNAPSHOT)
    asked = sum(rig.open_cameras(device))
    replies = [snapshot.call_async(Trigger.Request()) for _ in range(BURST)]

    def next_one_waits() -> bool:
        """Whether a first answer is here, if it has to be, and a callback waits for a picture."""
        done, more = [reply.done() for reply in replies], sum(rig.open_cameras(device)) - asked
        return all(done) or (any(done) and more >= 2) or (not answered and more >= 1)

    patience = rig.start_patience()
    while not rig.wait(next_one_waits, PERIOD) and patience.has_time_left():
        rig.node.zoom.publish(Int32(data=1))
        rig.nudge()
    if not any(reply.done() for reply in replies) and (answered or not next_one_waits()):
        raise Failed(
            expected=f"The service {SNAPSHOT} answers when the picture is there.",
            actual=f"No answer came{rig.error_note()}.",
        )
    return lambda: sum(not (reply.done() and reply.result().success) for reply in replies)


def require_no_queue(rig: CameraRig, device: str, destroy: Callable[[], object]) -> None:
    """Fail if pictures that a slow camera is behind with are all taken before ``destroy`` ends."""
    before = sum(rig.open_cameras(device))
    rig.advance(A_FEW * PERIOD)
    if (
        sum(rig.open_cameras(device)) - before < A_FEW - 1
    ):  # it does not take them one by one at once
        rig.advance(MANY * PERIOD)
    if (asked := _asked_during(rig, device, destroy)) > LAST_ONES:
        raise Failed(
            expected="destroy_node() ends every thread within a second, also while the camera is "
            "slower than the timer.",
            actual=f"While it ran the camera was asked for {asked} more pictures, each of which "
            "takes 0.3 s: they had been ordered before, and waited in a queue.",
        )


def _asked_during(rig: CameraRig, device: str, act: Callable[[], object]) -> int:
    """Return for how many pictures the camera of ``device`` was asked while ``act`` ran."""
    before = highest = sum(rig.open_cameras(device))
    over = threading.Event()

    def look() -> None:
        nonlocal highest
        while not over.wait(PERIOD):
            highest = max(highest, sum(rig.open_cameras(device)))

    with ThreadPoolExecutor(max_workers=1) as beside:
        looking = beside.submit(look)
        try:
            act()
        finally:
            over.set()
    looking.result()
    return highest - before


def require_zoom(rig: CameraRig, device: str, factor: int, when: str) -> None:
    """Fail unless pictures come with the zoom ``factor`` soon after it was sent."""
    expected = f"{when} a zoom of {factor} on {ZOOM} is followed."
    _require_followed(rig, device, factor, when, expected, again=True)


def require_zoom_at_once(rig: CameraRig, device: str, factor: int, when: str) -> None:
    """Fail unless pictures come with the zoom ``factor``, which is sent once.

    A zoom must have been followed before: then what is sent arrives, if the subscription is
    reliable.
    """
    offers = rig.node.get_subscriptions_info_by_topic(ZOOM)
    lossy = any(o.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT for o in offers)
    expected = f"{when} one message on {ZOOM} sets a zoom of {factor}."
    _require_followed(rig, device, factor, when, expected, again=lossy)


def _require_followed(
    rig: CameraRig, device: str, factor: int, when: str, expected: str, *, again: bool
) -> None:
    """Fail unless the zoom ``factor`` is seen soon; send it once, or ``again`` until it is."""
    patience, sent = rig.start_patience(), False
    while patience.has_time_left():
        if again or not sent:
            rig.node.zoom.publish(Int32(data=factor))
            sent = True
        require_snapshot(rig, device, when)
        if rig.wait(lambda: rig.get_pictures(device)[-1].zoom == factor, PERIOD):
            return
    raise Failed(
        expected=expected,
        actual=f"The pictures went on with a zoom of {rig.get_pictures(device)[-1].zoom}"
        f"{rig.error_note()}.",
    )


def require_zoom_kept(rig: CameraRig, device: str, factor: int, when: str) -> None:
    """Fail unless further pictures have the zoom ``factor``, without its being sent again."""
    for _ in range(FURTHER):
        require_snapshot(rig, device, when)
    if not rig.wait(lambda: rig.get_pictures(device)[-1].zoom == factor):
        raise Failed(
            expected=f"{when} the next pictures have a zoom of {factor}, until another one is set.",
            actual=f"They had a zoom of {rig.get_pictures(device)[-1].zoom}{rig.error_note()}.",
        )
