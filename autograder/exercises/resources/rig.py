"""The rig of the resources exam: a camera of a node of the student's, on its topic and in /proc.

The library ``Camera`` that the notebook gives opens a memory file ``camera:<device>`` for a device
and ``camera-stream:<device>`` for its stream, and moves the position in the first by one whenever
somebody asks for a picture. So what a node does with its camera is seen from outside.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable

from sensor_msgs.msg import Image
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_examiner import IMAGE, SNAPSHOT, ZOOM, ExaminerNode
from autograder.observe.examiner.lossless_listener import Published
from autograder.observe.lifecycle.node_lives import NodeLives
from autograder.observe.lifecycle.observer import ENDED_S
from autograder.observe.lifecycle.stepped_rate import OVER, MessageCounter
from autograder.observe.nouns import Service, Topic
from autograder.observe.patience import SETTLE_S

DRIVER, MANAGED = "CameraDriver", "ManagedCamera"
PERIOD_S, RATE_HZ = 0.1, 10.0
"""Seconds of simulated time between two pictures, and of wall time between two looks."""
STEP_S = OVER * PERIOD_S
"""Seconds of simulated time after which the next picture is due."""
ARRIVES_S, ARRIVES_ASLEEP_S = 1.0, 0.6
"""Seconds that a picture which was read is given, see `Patience`: a slow camera takes 0.3 s."""
UNPUBLISHED = 10
"""Pictures, read in a row while time stands still: who reads so reads all the time."""


class CameraRig(NodeLives):
    """The examiner's view of one subject during the resources exam."""

    node: ExaminerNode

    def __init__(self, bench: CheckContext) -> None:
        """Bring up the examiner's endpoints on the subject's domain."""
        super().__init__(
            bench,
            ExaminerNode,
            publishes=[Topic(IMAGE, Image)],
            subscribes=[Topic(ZOOM, Int32)],
            serves=[Service(SNAPSHOT, Trigger)],
        )

    def count_publishers(self) -> int:
        """Return how many publishers of pictures there are on the graph."""
        return self.graph.count(f"a publisher on {IMAGE}")

    def settle_messages(self) -> None:
        """Wait until all that was sent has been dealt with: what comes then was sent after that."""
        if self.wait_for_rest():
            self.node.settled = time.time_ns()


def new_device(kind: str = "front") -> str:
    """Return a device that nobody else uses; ``kind`` is its name's beginning."""
    return f"{kind}-{secrets.token_hex(4)}"


class ObservedCamera:
    """A camera that a node of the student's has open, or is to have.

    Attributes:
        node: the full name of the node.
        device: the camera's; a managed node may be given another one.
    """

    def __init__(self, rig: CameraRig, node: str, device: str) -> None:
        """Look at the camera ``device`` of ``node``."""
        self.rig, self.node, self.device = rig, node, device
        self._counter = MessageCounter(rig, self.count, self.let_arrive, "pictures")
        self.require_rate = self._counter.require_rate
        self.require_one_by_one = self._counter.require_one_by_one

    def asked(self) -> list[int]:
        """Return how often each open camera of this device was asked for a picture."""
        return self.rig.process.file_positions(f"camera:{self.device}")

    def count_asked(self) -> int:
        """Return for how many pictures the camera was asked so far; 0 if it is closed."""
        return sum(self.asked())

    def is_streaming(self) -> bool:
        """Whether its stream runs."""
        return bool(self.rig.process.file_positions(f"camera-stream:{self.device}"))

    def pictures(self) -> list[Published]:
        """Return its pictures that went over the topic, in order of arrival."""
        return self.rig.node.pictures_of(self.device)

    def count(self) -> int:
        """Return how many of its pictures went over the topic."""
        return len(self.pictures())

    def see_picture(self, condition: Callable[[], object] | None = None) -> bool:
        """Let time pass until ``condition`` (by default: that there is a picture) holds."""
        return self.rig.pass_time(condition or self.count, STEP_S)

    def let_arrive(self) -> None:
        """Wait for pictures that were read and are on their way.

        Not for long: a thread may read all the time, and publish just some of what it reads.
        """

        def count_unpublished() -> int:
            return self.count_asked() - self.count()

        before = count_unpublished()

        def is_newest_here() -> bool:
            newest = [picture.value.number for picture in self.pictures()[-1:]]
            return newest >= [self.count_asked() - 1] or count_unpublished() - before >= UNPUBLISHED

        patience = self.rig.start_patience(ARRIVES_ASLEEP_S, ARRIVES_S)
        patience.wait(self.rig.session, is_newest_here)

    def require_picture(self, when: str = "") -> None:
        """Fail unless a picture comes over the topic."""
        if self.see_picture():
            return
        who = f"There was no publisher on {IMAGE}"
        if self.rig.count_publishers():
            who = f"There was a publisher on {IMAGE}, but no picture of that camera"
        pictures = f"{when} pictures" if when else "Pictures"
        raise Failed(
            expected=f"{pictures} of the camera {self.device!r} come on {IMAGE}.",
            actual=f"In {SETTLE_S:.0f} s of the robot's time none came. {who}"
            f"{self.rig.error_note()}.",
        )

    def require_open(self) -> None:
        """Fail unless the camera is open."""
        if not self.rig.wait(self.asked):
            raise Failed(
                expected=f"The node opens the camera it is told: {self.device!r}.",
                actual="Your process has not opened that camera.",
            )

    def require_closed(self, when: str) -> None:
        """Fail if the camera is not closed."""
        if not self.rig.wait(lambda: not self.asked(), idle=ENDED_S):
            raise Failed(
                expected=f"{when} the camera is closed.",
                actual=f"Your process still had the camera {self.device!r} open "
                f"{self.rig.end_of_wait}.",
            )
