"""What a camera driver must do, and must not leave behind: observations that several checks share.

Each ``require_…`` returns if it was seen, and raises `Failed` with what was seen instead.
"""

from __future__ import annotations

from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from autograder.exam import Failed
from autograder.rigs.camera import IMAGE, PERIOD, SETTLE, SNAPSHOT, ZOOM, CameraRig, phrase
from course.runtime.waiting import Deadline

STEPS = 10
FURTHER = 3  # pictures: one may have been under way with another zoom
STANDSTILL = 0.5  # s of wall time without two pictures: they stand still
BACKLOG = 3.0  # s of wall time in which pictures may come that had been ordered before


def require_endpoints(rig: CameraRig, node: str) -> None:
    """Fail unless the driver's endpoints are all on the graph, with their types.

    Only what was seen to be there can be seen to go.
    """
    if rig.wait(lambda: not rig.missing(node)):
        return
    raise Failed(
        expected="The driver has the endpoints of the task.", actual=" ".join(rig.missing(node))
    )


def require_picture(rig: CameraRig, device: str) -> None:
    """Fail unless a picture of ``device`` comes over the topic."""
    if not rig.see(device):
        raise Failed(
            expected=f"Pictures of the camera {device!r} come on {IMAGE}.",
            actual=f"In {SETTLE / PERIOD * PERIOD:.0f} s of the robot's time none came"
            f"{rig.raised()}.",
        )


def require_rate(rig: CameraRig, device: str, rate: float, when: str = "") -> None:
    """Fail unless in a second of simulated time about ``rate`` pictures of ``device`` come."""
    before = len(rig.pictures(device))
    deadline = Deadline(SETTLE)
    for step in range(1, STEPS + 1):
        rig.advance(1 / STEPS)
        # A thread may publish a moment after the timer: let it keep up.
        due = before + int(rate / STEPS * step) - 1
        rig.wait(lambda due=due: len(rig.pictures(device)) >= due, deadline.left)  # type: ignore[misc]
    let_arrive(rig, device)
    came = len(rig.pictures(device)) - before
    # Some of those before may have been on their way: not more than one step's.
    if abs(came - rate) > max(1.0, rate / STEPS):
        raise Failed(
            expected=f"In one second {rate:.0f} pictures come{when}.",
            actual=f"In one second of the robot's time {came} came{rig.raised()}.",
        )


def let_arrive(rig: CameraRig, device: str) -> None:
    """Wait for pictures of ``device`` that were read and are on their way.

    Not for long: a thread may read all the time, and publish just some of what it reads.
    """

    def all_here() -> bool:
        newest = [picture.number for picture in rig.pictures(device)[-1:]]
        return newest >= [max(rig.cameras(device), default=0) - 1]

    rig.wait(all_here, 1.0)


def require_own_clock(rig: CameraRig, device: str) -> None:
    """Fail if pictures of ``device`` are published while the robot's time stands still.

    Only those: a thread may read the camera all the time, and a timer publish the newest picture.
    """
    deadline = Deadline(BACKLOG)
    while deadline.left:
        before = len(rig.pictures(device))
        if not rig.wait(lambda n=before: len(rig.pictures(device)) >= n + 2, STANDSTILL):  # type: ignore[misc]
            return
    raise Failed(
        expected="The pictures are timed by a ROS timer, or by the node's clock.",
        actual="Pictures came although the robot's time, which is simulated, stood still.",
    )


def require_open(rig: CameraRig, device: str) -> None:
    """Fail unless the camera of ``device`` is open."""
    if not rig.wait(lambda: rig.cameras(device)):
        raise Failed(
            expected=f"The node opens the camera it is told: {device!r}.",
            actual="Your process has not opened that camera.",
        )


def require_closed(rig: CameraRig, device: str, when: str) -> None:
    """Fail if the camera of ``device`` is not closed."""
    if not rig.wait(lambda: not rig.cameras(device)):
        raise Failed(
            expected=f"{when} the camera is closed.",
            actual=f"Your process still had the camera {device!r} open {SETTLE:.0f} s later.",
        )


def require_gone(rig: CameraRig, device: str, when: str, node: str = "") -> None:
    """Fail if an endpoint of the driver is on the graph."""
    if rig.wait(lambda: not rig.endpoints(node)):
        return
    left = rig.endpoints(node)
    before = len(rig.pictures(device))
    rig.advance(1.0)
    sent = len(rig.pictures(device)) - before
    more = f" In one more second it sent {sent} pictures." if sent else ""
    raise Failed(
        expected=f"{when} no endpoint of the driver is on the graph.",
        actual=f"{SETTLE:.0f} s later there still was {phrase(left)}.{more}",
    )


def require_snapshot(rig: CameraRig, device: str, when: str) -> None:
    """Fail unless a snapshot is answered, and its picture comes without time passing."""
    before = len(rig.pictures(device))
    reply = rig.ask(Trigger, SNAPSHOT, Trigger.Request())
    if reply is None:
        raise Failed(
            expected=f"{when} the service {SNAPSHOT} answers.",
            actual=f"No answer came within {SETTLE:.0f} s{rig.raised()}.",
        )
    if not reply.success:
        raise Failed(
            expected=f"{when} {SNAPSHOT} succeeds.", actual="It answered with success=False."
        )
    if not rig.wait(lambda: len(rig.pictures(device)) > before):
        raise Failed(
            expected=f"{when} {SNAPSHOT} publishes a picture on {IMAGE} at once.",
            actual="It answered, but no picture came.",
        )


def require_zoom(rig: CameraRig, device: str, factor: int, when: str) -> None:
    """Fail unless pictures come with the zoom ``factor`` soon after it was sent."""
    for _ in range(int(SETTLE / PERIOD)):
        rig.node.zoom.publish(Int32(data=factor))
        require_snapshot(rig, device, when)
        if rig.wait(lambda: rig.pictures(device)[-1].zoom == factor, PERIOD):
            return
    raise Failed(
        expected=f"{when} a zoom of {factor} on {ZOOM} is followed.",
        actual=f"The pictures went on with a zoom of {rig.pictures(device)[-1].zoom}"
        f"{rig.raised()}.",
    )


def require_zoom_kept(rig: CameraRig, device: str, factor: int, when: str) -> None:
    """Fail unless further pictures have the zoom ``factor``, without its being sent again."""
    for _ in range(FURTHER):
        require_snapshot(rig, device, when)
    if not rig.wait(lambda: rig.pictures(device)[-1].zoom == factor):
        raise Failed(
            expected=f"{when} the next pictures have a zoom of {factor}, until another one is set.",
            actual=f"They had a zoom of {rig.pictures(device)[-1].zoom}{rig.raised()}.",
        )


def require_callbacks_ended(rig: CameraRig, among: set[int], usual: int, when: str) -> None:
    """Fail if a callback of a driver that was taken down goes on for ever.

    A session gives such a callback's thread up and goes on with a new one. So there is a thread
    that is not ``among`` those of before, and one more than the ``usual`` number without a driver.
    """

    def replaced() -> bool:
        now = rig.process.thread_ids()
        return bool(now - among) and len(now) > usual

    if not rig.wait(lambda: not replaced()):
        raise Failed(
            expected=f"{when} every callback of the driver comes to its end.",
            actual=f"One that waited for the camera was still waiting {SETTLE:.0f} s later. The "
            "thread that runs it is lost: a program with that one thread takes up no callback "
            "ever again.",
        )
