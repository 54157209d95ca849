"""What a camera driver must do, and must not leave behind: observations that several checks share.

Each ``require_…`` returns if it was seen, and raises `Failed` with what was seen instead.
"""

from __future__ import annotations

from collections.abc import Callable

from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from autograder.exam import Failed
from autograder.rigs.camera import IMAGE, PERIOD, SETTLE, SNAPSHOT, ZOOM, CameraRig, phrase
from course.runtime.waiting import Deadline

STEPS = 10  # at least, in which a rate is counted
KEEP_UP = 0.25  # s of wall time that a picture which is due is waited for before time moves on
FURTHER = 3  # pictures: one may have been under way with another zoom
STANDSTILL = 0.5  # s of wall time without two pictures: they stand still
BURST = 4  # snapshots that are asked for at once
BACKLOG = 3.0  # s of wall time in which pictures may come that had been ordered before
A_FEW, MANY = 5, 20  # ticks
LAST_ONES = 5  # pictures: 4 that take 0.3 s each are about as many as a second allows


def require_endpoints(rig: CameraRig, node: str) -> None:
    """Fail unless the driver's endpoints are all on the graph, with their types.

    Only what was seen to be there can be seen to go.
    """
    if rig.wait(lambda: not rig.missing(node)):
        return
    raise Failed(
        expected="The driver has the endpoints of the task.", actual=" ".join(rig.missing(node))
    )


def require_picture(rig: CameraRig, device: str, when: str = "") -> None:
    """Fail unless a picture of ``device`` comes over the topic."""
    if not rig.see(device):
        pictures = f"{when} pictures" if when else "Pictures"
        raise Failed(
            expected=f"{pictures} of the camera {device!r} come on {IMAGE}.",
            actual=f"In {SETTLE / PERIOD * PERIOD:.0f} s of the robot's time none came"
            f"{rig.raised()}.",
        )


def require_rate(
    rig: CameraRig, device: str, rate: float, when: str = "", seconds: int = 1
) -> None:
    """Fail unless ``rate`` pictures of ``device`` come a second of simulated time, or about that.

    Time moves on picture by picture: a thread may publish a moment after the timer, and a design
    may keep one order at a time and drop the next one while it is busy.
    """
    wanted = rate * seconds
    steps = max(STEPS, round(wanted))
    before, late = len(rig.pictures(device)), 0
    deadline = Deadline(SETTLE)

    def came() -> int:
        return len(rig.pictures(device)) - before

    for step in range(1, steps + 1):
        rig.advance(seconds / steps)
        due = int(wanted * step / steps)
        # By its phase a design may be one picture behind, and stay so: it is not waited for twice.
        if not rig.wait(lambda least=due - late: came() >= least, KEEP_UP):  # type: ignore[misc]
            rig.wait(lambda least=due - 1: came() >= least, deadline.left)  # type: ignore[misc]
        late = max(0, due - came())
    let_arrive(rig, device)
    # Some of those before may have been on their way: not more than come in a tenth of a second.
    if abs(came() - wanted) > max(1.0, rate / STEPS):
        time = "one second" if seconds == 1 else f"{seconds} seconds"
        raise Failed(
            expected=f"In {time} {wanted:.0f} pictures come{when}.",
            actual=f"In {time} of the robot's time {came()} came{rig.raised()}.",
        )


def let_arrive(rig: CameraRig, device: str) -> None:
    """Wait for pictures of ``device`` that were read and are on their way.

    Not for long: a thread may read all the time, and publish just some of what it reads.
    """

    def newest_is_here() -> bool:
        newest = [picture.number for picture in rig.pictures(device)[-1:]]
        return newest >= [max(rig.cameras(device), default=0) - 1]

    rig.wait(newest_is_here, 1.0)


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
    before, asked = len(rig.pictures(device)), sum(rig.cameras(device))
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
    # A thread may read all the time, and the snapshot publish what it read last.
    if not rig.wait(lambda: sum(rig.cameras(device)) > asked):
        raise Failed(
            expected=f"{when} {SNAPSHOT} takes a picture.",
            actual="It published an old one: the camera was not asked.",
        )


def require_snapshots_under_way(rig: CameraRig, device: str) -> None:
    """Ask for some snapshots; fail unless one is answered. A callback waits for the next one then.

    rclpy 7.1 resumes a callback that awaits a future when its executor has something else to do: on
    a robot, at the next tick. Here time stands still, so that ticks ask the camera for no picture,
    and a zoom is that something.
    """
    snapshot = rig.client(Trigger, SNAPSHOT)
    asked = sum(rig.cameras(device))
    replies = [snapshot.call_async(Trigger.Request()) for _ in range(BURST)]

    def next_one_waits() -> bool:
        """Whether a first answer is here, and a callback waits for a further picture."""
        done = [reply.done() for reply in replies]
        return all(done) or (any(done) and sum(rig.cameras(device)) >= asked + 2)

    deadline = Deadline(SETTLE)
    while not rig.wait(next_one_waits, min(PERIOD, deadline.left)) and deadline.left:
        rig.node.zoom.publish(Int32(data=1))
    if not any(reply.done() for reply in replies):
        raise Failed(
            expected=f"The service {SNAPSHOT} answers when the picture is there.",
            actual=f"No answer came within {SETTLE:.0f} s{rig.raised()}.",
        )


def require_no_queue(rig: CameraRig, device: str, destroy: Callable[[], object]) -> None:
    """Fail if pictures that a slow camera is behind with are all taken before ``destroy`` ends."""
    before = sum(rig.cameras(device))
    rig.advance(A_FEW * PERIOD)
    if sum(rig.cameras(device)) - before < A_FEW - 1:  # it does not take them one by one at once
        rig.advance(MANY * PERIOD)
    if (asked := rig.asked_during(device, destroy)) > LAST_ONES:
        raise Failed(
            expected="destroy_node() ends every thread within a second, also while the camera is "
            "slower than the timer.",
            actual=f"While it ran the camera was asked for {asked} more pictures, each of which "
            "takes 0.3 s: they had been ordered before, and waited in a queue.",
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


def require_threads_ended(rig: CameraRig, among: set[int], when: str) -> None:
    """Fail if a thread goes on that is here now and is not ``among`` those of before."""
    new = rig.process.thread_ids() - among
    if not rig.wait(lambda: not new & rig.process.thread_ids()):
        left = len(new & rig.process.thread_ids())
        raise Failed(
            expected=f"{when} every thread of the driver has ended.",
            actual=f"{SETTLE:.0f} s later {left} of those that it had started went on: whoever "
            "starts a thread tells it to end, whoever makes a pool shuts it down.",
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
