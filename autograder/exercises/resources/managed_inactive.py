"""What a managed camera does while it is inactive: it holds its camera, and sends nothing."""

from __future__ import annotations

import time

from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_examiner import IMAGE
from autograder.exercises.resources.camera_rate import let_arrive
from autograder.exercises.resources.managed import Managed
from autograder.exercises.resources.rig import CameraRig
from autograder.observe.phrases import as_phrase, pictures_phrase
from course.runtime.waiting import Deadline

EXPOSURE = 0.3  # s of a slow camera
EXPOSURES = 3  # at most, that are waited for on a busy machine, where one may be over too soon


def require_stopped(rig: CameraRig, device: str, transition: str) -> None:
    """Fail if the camera is streaming."""
    if not rig.wait(lambda: not rig.is_streaming(device)):
        raise Failed(
            expected=f"After “{transition}” the camera's stream is stopped.",
            actual="The stream went on: nobody called stop().",
        )


def require_still(rig: CameraRig, device: str, transition: str) -> None:
    """Fail if the camera is streaming or is asked for pictures while time passes."""
    require_stopped(rig, device, transition)
    before = sum(rig.open_cameras(device))
    rig.advance(1.0)
    asked = sum(rig.open_cameras(device)) - before
    if asked:
        raise Failed(
            expected="An inactive node asks its camera for no picture.",
            actual=f"In one second after “{transition}” it asked for {pictures_phrase(asked)}.",
        )


def require_silent_at_once(rig: CameraRig, node: Managed, device: str) -> None:
    """Fail if a picture that was being exposed at “deactivate” is published after it.

    By the times that DDS gives: what was published before, and arrives after, is in order. But a
    writer that lies about them is not believed once all has come to rest.
    """
    for _ in range(EXPOSURES):
        node.make_transitions("activate")
        asked = sum(rig.open_cameras(device))
        rig.see_picture(device, lambda n=asked: sum(rig.open_cameras(device)) > n)  # type: ignore[misc]
        under_way = Deadline(EXPOSURE)
        node.make_transitions("deactivate")
        in_time, inactive = under_way.seconds_left, time.time_ns()
        rig.settle_messages()
        let_arrive(rig, device)
        if any(picture.published > inactive for picture in rig.get_pictures(device)[-1:]):
            raise Failed(
                expected="When “deactivate” has succeeded the node sends no picture, also not the "
                "one that its camera was just taking.",
                actual="It sent one that a slow camera had ready when the node was inactive.",
            )
        if in_time:
            return


def require_still_held(rig: CameraRig, device: str) -> None:
    """Fail unless a node that was deactivated has kept its camera open, and its publisher.

    A participant's endpoints are told in order: a publisher that went with “deactivate” is not
    known here any more when a mark that is made now is.
    """
    rig.catch_up()
    gone = [] if rig.open_cameras(device) else ["its camera was closed"]
    gone += [] if rig.graph.count_publishers() else [f"its publisher on {IMAGE} was gone"]
    if gone:
        raise Failed(
            expected="After “deactivate” your node holds its open camera and its publisher until "
            "“cleanup”: inactive is one state, whichever way it came there.",
            actual=f"While it was inactive again {as_phrase(gone)}.",
        )


def require_fresh(rig: CameraRig, device: str, inactive: int, asked: int, strange: int) -> None:
    """Fail unless pictures come again, and all that were published while ``inactive`` are new.

    That is since when it was, in ns: by the times that DDS gives, as what was published before may
    arrive after. Pictures that the camera took before it was ``asked`` so often are old. There had
    been so many ``strange`` images, which are nobody's pictures, when the node was configured.
    """
    # Pictures of one publisher arrive in order: what was sent earlier is here by then.
    if not rig.see_picture(device, lambda: rig.get_pictures(device)[-1].number >= asked):
        raise Failed(
            expected="After a second “activate” pictures come again.",
            actual=f"None came{rig.error_note()}.",
        )
    if old := [p for p in rig.get_pictures(device) if p.published > inactive and p.number < asked]:
        raise Failed(
            expected="An inactive node publishes nothing, and one that is active again only "
            "pictures that its camera has taken since.",
            actual=f"After “deactivate”, or after the next “activate”, it published "
            f"{pictures_phrase(len(old))} taken before that “activate”.",
        )
    if more := rig.node.count_strange() - strange:
        raise Failed(
            expected="An inactive node publishes nothing.",
            actual=f"It published {pictures_phrase(more)} that its camera had not taken.",
        )
