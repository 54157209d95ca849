"""What a camera driver must do, and must not leave behind: observations that several checks share.

Each ``require_…`` returns if it was seen, and raises `Failed` with what was seen instead.
"""

from __future__ import annotations

from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_examiner import IMAGE
from autograder.exercises.resources.camera_graph import PUBLISHER
from autograder.exercises.resources.rig import ENDED, CameraRig
from autograder.observe.patience import SETTLE_S
from autograder.observe.phrases import as_phrase, capitalize_first, pictures_phrase
from course.runtime.waiting import Deadline

DRIVER = "CameraDriver"
DEFAULT = "front"
WAKES = 3.0  # s of wall time in which a thread does something that it has been given


def require_endpoints(rig: CameraRig, node: str) -> None:
    """Fail unless the driver's endpoints are all on the graph, with their types.

    Only what was seen to be there can be seen to go.
    """
    if rig.wait(lambda: not rig.graph.list_missing(node)):
        return
    raise Failed(
        expected="The driver has the endpoints of the task.",
        actual=" ".join(rig.graph.list_missing(node)),
    )


def require_picture(rig: CameraRig, device: str, when: str = "") -> None:
    """Fail unless a picture of ``device`` comes over the topic."""
    if not rig.see_picture(device):
        pictures = f"{when} pictures" if when else "Pictures"
        raise Failed(
            expected=f"{pictures} of the camera {device!r} come on {IMAGE}.",
            actual=f"In {SETTLE_S:.0f} s of the robot's time none came. {_who_could_send(rig)}"
            f"{rig.error_note()}.",
        )


def _who_could_send(rig: CameraRig) -> str:
    """Return whether anybody could have sent a picture, as a sentence without its end."""
    number = rig.graph.count_publishers()
    if not number:
        return f"There was no publisher on {IMAGE}"
    has = f"There was {PUBLISHER}" if number == 1 else f"There were {number} publishers on {IMAGE}"
    return f"{has}, but no picture of that camera"


def require_open(rig: CameraRig, device: str) -> None:
    """Fail unless the camera of ``device`` is open."""
    if not rig.wait(lambda: rig.open_cameras(device)):
        raise Failed(
            expected=f"The node opens the camera it is told: {device!r}.",
            actual="Your process has not opened that camera.",
        )


def require_default_device(rig: CameraRig, name: str) -> None:
    """Fail unless the driver can be made without arguments, and then opens the front camera.

    Unless somebody has it open already: a notebook's own driver may run.
    """
    if rig.open_cameras(DEFAULT):
        return
    with rig.run_life(name):
        require_open(rig, DEFAULT)


def require_closed(rig: CameraRig, device: str, when: str) -> None:
    """Fail if the camera of ``device`` is not closed."""
    if not rig.wait(lambda: not rig.open_cameras(device), idle=ENDED):
        raise Failed(
            expected=f"{when} the camera is closed.",
            actual=f"Your process still had the camera {device!r} open {rig.end_of_wait}.",
        )


def require_gone(rig: CameraRig, device: str, when: str, node: str = "") -> None:
    """Fail if an endpoint or a node of the driver is on the graph: it may have made several."""
    if rig.wait(lambda: not rig.graph.list_leftovers(node), idle=ENDED):
        return
    when_seen = rig.end_of_wait
    rig.catch_up()  # what was said of an end by then may have been lost, and is said again
    if not (left := rig.graph.list_leftovers(node)):
        return
    before = len(rig.get_pictures(device))
    rig.advance(1.0)
    sent = len(rig.get_pictures(device)) - before
    more = f" In one more second it sent {pictures_phrase(sent)}." if sent else ""
    raise Failed(
        expected=f"{when} no endpoint of the driver is on the graph.",
        actual=f"{capitalize_first(when_seen)} there still was {as_phrase(left)}.{more}",
    )


def require_threads_ended(rig: CameraRig, among: set[int], when: str) -> None:
    """Fail if a thread goes on that is here now and is not ``among`` those of before."""
    new = rig.process.thread_ids() - among

    def over() -> bool:
        return not new & rig.process.thread_ids()

    deadline = Deadline(SETTLE_S)
    if rig.wait_for_end(over, among=new):
        return
    # A busy machine may not have come to it yet. But when all is at rest, who is left just waits.
    rig.wait(lambda: over() or rig.wait_for_rest(), deadline.seconds_left)
    if left := len(new & rig.process.thread_ids()):
        raise Failed(
            expected=f"{when} every thread of the driver has ended, within a second.",
            actual=f"{SETTLE_S - deadline.seconds_left:.1f} s later {left} of the threads that it "
            "had started were still there. If you start a thread, tell it to end, and wake it if "
            f"it sleeps; if you make a thread pool, shut it down.{rig.process_note()}",
        )


def require_callbacks_ended(rig: CameraRig, among: set[int], usual: int, when: str) -> None:
    """Fail if a callback of a driver that was taken down goes on for ever.

    A session gives such a callback's thread up and goes on with a new one. So there is a thread
    that is not ``among`` those of before, and one more than the ``usual`` number without a driver;
    and it works when the session has something to do. One that does not was left by the driver,
    which is another check's.
    """

    def replaced() -> bool:
        now = rig.process.thread_ids()
        return bool(now - among) and len(now) > usual

    if rig.wait(lambda: not replaced()):
        return
    when_seen = rig.end_of_wait
    if _is_working(rig, rig.process.thread_ids() - among):
        raise Failed(
            expected=f"{when} every callback of the driver comes to its end.",
            actual=f"One that waited for the camera was still waiting {when_seen}. The "
            "thread that runs it is lost: a program with that one thread takes up no callback "
            "ever again.",
        )


def _is_working(rig: CameraRig, threads: set[int]) -> bool:
    """Whether one of these ``threads`` has a part in what the session now has to do."""
    before = rig.process.count_naps(threads)
    rig.catch_up()
    return rig.wait(
        lambda: any(
            naps > before[thread] for thread, naps in rig.process.count_naps(before).items()
        ),
        WAKES,
    )
