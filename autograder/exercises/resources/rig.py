"""The rig of the resources exam: looks at a camera driver on the graph, on the wire, in /proc.

The library ``Camera`` that the notebook gives opens a memory file ``camera:<device>`` for a device
and ``camera-stream:<device>`` for its stream, and moves the position in the first by one whenever
somebody asks for a picture. So what a node does with its camera is seen from outside.
"""

from __future__ import annotations

import re
import secrets
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from rclpy.duration import Duration
from std_msgs.msg import Int32

from autograder.examination.check_context import PATIENCE_S, CheckContext, StudentError
from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_examiner import Picture
from autograder.exercises.resources.camera_graph import CameraGraph
from autograder.exercises.resources.camera_program import Program
from autograder.exercises.resources.camera_usage import Process
from autograder.exercises.resources.observer import Observer
from autograder.observe.patience import SETTLE_S, Waits
from autograder.observe.phrases import as_phrase

GHOSTS = 1.0
"""Seconds that endpoints of an earlier life are given to go off the graph."""
ENDED, SOON = 1.5, 0.5
"""Seconds in which all sleep that something may take to end: the task says 1. And to be woken up by
another thread."""
PERIOD = 0.1
"""Seconds of simulated time between two pictures, and of wall time between two probes."""
OVER = 1.01
"""Of a period, that time moves on by for a picture: to a thread that looks at the clock in float
seconds, exactly one period may not be over yet."""
STEP = OVER * PERIOD
"""Seconds of simulated time after which the next picture is due."""


class CameraRig(Observer):
    """The examiner's view of one subject during the resources exam."""

    def __init__(self, bench: CheckContext) -> None:
        """Bring up the examiner's endpoints on the subject's domain."""
        super().__init__(bench.session, bench.outside)
        self.subject = bench.subject
        self.programs = bench.programs
        self.outside = bench.outside
        self.process = Process(bench.outside)
        self.graph = CameraGraph(self.node)
        self.program = Program(bench.subject, self.graph)
        self.memory = bench.memory
        self.draws = bench.draws
        self._clean = False
        self._provoked = False
        self._leaves_ghosts = False

    # The subject.

    def begin_session(self) -> None:
        """Begin a new session on simulated time; nothing of an earlier one goes on."""
        self.subject.open(sim_time=True)
        self._clean, self._provoked = True, False

    @contextmanager
    def run_life(self, name: str, *args: Any) -> Iterator[str]:
        """Give the full name of a node of the class ``name`` for one life.

        It is stopped at the end, unless it is destroyed by then. What its cleanup raises then is
        for another check to find.
        """
        with self.clean_session():
            node = self.program.start(name, *args)
            yield node
        try:
            self.subject.stop(name)
            self._clean = self._has_vanished(node)
        except StudentError:
            self._clean = False

    def _has_vanished(self, node: str) -> bool:
        """Whether a node that was stopped goes off the graph.

        rclpy 7.1 leaves the services of a destroyed lifecycle node there until it is collected; the
        next node of that name must not be taken for it.
        """
        service = f"{node}/get_state"
        if self.node.count_services(service):
            self.subject.collect()
        return self.wait(lambda: not self.node.count_services(service))

    @contextmanager
    def clean_session(self) -> Iterator[None]:
        """Begin with a clean session, and leave none to the next check if this one fails.

        What a wrong design has left on the graph by now is not held against it again, and what the
        examiner made a callback raise in an earlier check explains nothing in this one.
        """
        if not self._clean or self._provoked:
            self.begin_session()
        # A design that has left some once leaves them each time, and they are told from new ones.
        if not self._leaves_ghosts:
            self._leaves_ghosts = not self.wait(lambda: not self.graph.list_endpoints(), GHOSTS)
        self.graph.ignore_present()
        self._clean = False
        yield
        self._clean = True

    def advance(self, seconds: float) -> None:
        """Move simulated time on."""
        try:
            self.subject.advance(seconds)
        except StudentError as error:
            raise Failed(
                expected="Your callbacks return, and the driver follows the robot's time.",
                actual=f"{_held_up(str(error))}{self.error_note()}.",
            ) from None

    def nudge(self) -> None:
        """Give the subject's executors something to do, and no timer a reason to fire.

        rclpy 7.1 resumes a callback that awaits something when its executor has something else to
        do: on a robot, at the next tick. Here it learns that a nanosecond has passed.
        """
        self.subject.nudge()

    def error_note(self) -> str:
        """Return what the student's callbacks raised, as the end of a sentence."""
        raised, ended = self.subject.errors(), self.subject.thread_errors()
        told = [f"a callback raised: {raised[-1].rstrip('.')}"] if raised else []
        told += [f"a thread of yours ended with {ended[-1].rstrip('.')}"] if ended else []
        return f" ({as_phrase(told)})" if told else ""

    def refused_zoom(self, factor: int) -> None:
        """Send a zoom that the camera does not have; it is with the driver when this returns."""
        self._provoked = True
        self.node.zoom.publish(Int32(data=factor))
        self.node.zoom.wait_for_all_acked(Duration(seconds=SETTLE_S))

    # What is seen.

    def wait_for_end(
        self,
        over: Callable[[], Any],
        session: Waits | None = None,
        among: Iterable[int] | None = None,
    ) -> bool:
        """Wait until what the task gives a second to end is ``over``; return whether it is.

        Where no thread sleeps for such a time, and there is no other process, nobody wakes up by
        itself.

        Args:
            over: whether it is.
            session: the examiner's in the network of what ends; None for that of this rig.
            among: the threads that may have a part in it; None for all.
        """
        session = session or self.session
        if self.start_patience(SOON).wait(session, over):
            return True
        if (
            min(self.process.wake_times(among), default=ENDED) >= ENDED
            and not self.process.other_processes()
        ):
            return False
        return self.start_patience(ENDED).wait(session, over)

    def wait_for_rest(self) -> bool:
        """Return True when all that was sent has been dealt with, False if a thread never rests."""
        return self._still.wait_for_rest()

    def settle_messages(self) -> None:
        """Wait until all that was sent has been dealt with: what comes then was sent after that."""
        if self.wait_for_rest():
            self.node.settled = time.time_ns()

    def process_note(self) -> str:
        """Return a sentence on the processes that the notebook has started, if there are any."""
        if not (names := self.process.other_processes()):
            return ""
        were = "A process that it had started was" if len(names) == 1 else "Processes were"
        return f" {were} left: {as_phrase(names)}."

    def new_device(self, kind: str = "front") -> str:
        """Return a device that nobody else uses; ``kind`` is its name's beginning."""
        return f"{kind}-{secrets.token_hex(4)}"

    def open_cameras(self, device: str) -> list[int]:
        """Return how often each open camera of ``device`` was asked for a picture."""
        return self.process.file_positions(f"camera:{device}")

    def is_streaming(self, device: str) -> bool:
        """Whether the stream of ``device`` runs."""
        return bool(self.process.file_positions(f"camera-stream:{device}"))

    def get_pictures(self, device: str) -> list[Picture]:
        """Return the pictures of ``device`` that went over the topic, in order of arrival."""
        return self.node.pictures_of(device)

    def see_picture(self, device: str, condition: Callable[[], Any] | None = None) -> bool:
        """Let time pass until ``condition`` (by default: that there is a picture) holds.

        Endpoints find each other in their own time, and what is sent before is lost.
        """
        condition = condition or (lambda: self.get_pictures(device))
        patience = self.start_patience()
        for _ in range(int(SETTLE_S / PERIOD)):
            self.advance(STEP)
            if self.wait(condition, PERIOD if patience.has_time_left() else 0.0):
                return True
        return False

    def catch_up(self) -> None:
        """Wait until every endpoint that the subject has by now is known here.

        A participant's endpoints are told in order: those of a mark that is made now come last.
        """
        mark = f"mark_{secrets.token_hex(4)}"
        self.graph.note_mark(mark)
        self.subject.mark(mark)
        self.wait(lambda: self.node.count_publishers(mark) and self.node.count_subscribers(mark))


@contextmanager
def camera_rig(bench: CheckContext) -> Iterator[CameraRig]:
    """Give a rig; the examiner's session takes its endpoints down at its end."""
    yield CameraRig(bench)


def _held_up(error: str) -> str:
    """Return why simulated time could not be moved on, from the session's error."""
    found = re.fullmatch(r"\w+: (.+) did not follow simulated time to ([\d.]+) s: .*", error, re.S)
    if found is None:
        return error.rstrip(".")
    if found[1] == "the session":  # all nodes know the time: something goes on without end
        return (
            f"At {found[2]} s of the robot's time your program did not come to rest: for "
            f"{PATIENCE_S:.0f} s there always was a callback running, or the next one ready"
        )
    return (
        f"At {found[2]} s of the robot's time a callback of {found[1]} had been running for "
        f"{PATIENCE_S:.0f} s"
    )
