"""A managed camera in its states: what it holds there, what it sends, and what it refuses."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_examiner import IMAGE, SNAPSHOT, ZOOM
from autograder.exercises.resources.rig import (
    MANAGED,
    CameraRig,
    ObservedCamera,
    new_device,
)
from autograder.observe.lifecycle.flat_rounds import require_flat
from autograder.observe.lifecycle.lifecycle_leaks import LifecycleLeaks
from autograder.observe.lifecycle.lifecycle_manager import LifecycleManager
from autograder.observe.phrases import as_phrase, capitalize_first, pictures_phrase
from course.runtime.waiting import Deadline

ROUNDS, ROUND_KIB = 10, 1024
"""Through the states; and KiB of memory that each may keep."""
TICK_S = 0.3
"""Seconds of simulated time in which an active node sends a picture."""
EXPOSURE_S, EXPOSURES = 0.3, 3
"""Seconds that a slow camera needs; and how many are waited for on a busy machine, at most."""


@contextmanager
def run_managed(rig: CameraRig) -> Iterator[ManagedCamera]:
    """Give a managed camera for one life, unconfigured."""
    with rig.life(MANAGED) as node:
        yield ManagedCamera(rig, node, "")


class ManagedCamera(ObservedCamera):
    """One life of a managed camera, which a lifecycle manager drives."""

    def __init__(self, rig: CameraRig, node: str, device: str) -> None:
        """Look at the lifecycle node ``node``."""
        super().__init__(rig, node, device)
        self.manager = LifecycleManager(rig, node, MANAGED)
        self.leaks = LifecycleLeaks(rig, self.manager)
        self.make_transitions = self.manager.make_transitions
        self.attempt_transition = self.manager.attempt_transition

    def configure(self, kind: str = "front", **parameters: float) -> None:
        """Give it a camera of a ``kind``, and other parameters; then have it configured."""
        self.set_camera(kind, **parameters)
        self.make_transitions("configure")

    def set_camera(self, kind: str = "front", **parameters: float) -> None:
        """Have it told a camera of a ``kind``, and other parameters, all of which it must take."""
        self.device = new_device(kind)
        self.manager.require_parameters(device=self.device, **parameters)

    # What it holds.

    def require_only_pictures(self) -> None:
        """Fail if a node that has sent a picture has endpoints of the plain driver as well.

        Those that it made before that publisher are known by then.
        """
        endpoints = self.rig.graph.list_endpoints()
        if more := [what for what in endpoints if what.endswith((ZOOM, SNAPSHOT))]:
            raise Failed(
                expected="The managed node has no zoom and no snapshot.",
                actual=f"There was {as_phrase(more)} on the graph.",
            )

    def require_publishers(self, number: int, when: str) -> None:
        """Fail unless there are so many publishers on the image topic: one or none."""
        count = self.rig.count_publishers
        if not self.rig.wait(lambda: count() == number):
            raise Failed(
                expected=f"{when} there is {'one' if number else 'no'} publisher on {IMAGE}.",
                actual=f"{capitalize_first(self.rig.end_of_wait)} there were {count()}.",
            )

    def require_nothing_held(self, when: str) -> None:
        """Fail if it holds a camera or a publisher."""
        self.require_closed(when)
        self.require_publishers(0, when)

    def require_callbacks_ended(self, when: str) -> None:
        """Fail if a callback goes on and raises, as one does that still wants pictures."""
        before = self.rig.subject.own_errors()
        self.rig.advance(TICK_S)
        if new := [e for e, n in self.rig.subject.own_errors().items() if n > before.get(e, 0)]:
            raise Failed(
                expected=f"{when} no callback of the node's goes on.",
                actual=f"One went on, and raised: {new[0].rstrip('.')}.",
            )

    def require_still_held(self) -> None:
        """Fail unless a node that was deactivated has kept its camera open, and its publisher.

        A participant's endpoints are told in order: a publisher that went with “deactivate” is not
        known here any more when a mark that is made now is.
        """
        self.rig.catch_up()
        gone = [] if self.asked() else ["its camera was closed"]
        gone += [] if self.rig.count_publishers() else [f"its publisher on {IMAGE} was gone"]
        if gone:
            raise Failed(
                expected="After “deactivate” your node holds its open camera and its publisher "
                "until “cleanup”: inactive is one state, whichever way it came there.",
                actual=f"While it was inactive again {as_phrase(gone)}.",
            )

    # What it does while it is inactive.

    def require_still(self, transition: str) -> None:
        """Fail if the camera is streaming or is asked for pictures while time passes."""
        if not self.rig.wait(lambda: not self.is_streaming()):
            raise Failed(
                expected=f"After “{transition}” the camera's stream is stopped.",
                actual="The stream went on: nobody called stop().",
            )
        before = self.count_asked()
        self.rig.advance(1.0)
        if asked := self.count_asked() - before:
            raise Failed(
                expected="An inactive node asks its camera for no picture.",
                actual=f"In one second after “{transition}” it asked for {pictures_phrase(asked)}.",
            )

    def require_only_new(self, inactive: int, strange: int) -> None:
        """Fail unless pictures come after “activate”, and all since it was ``inactive`` are new.

        That is since when it was, in ns: by the times that DDS gives, as what was published before
        may arrive after. There had been so many ``strange`` images, which are nobody's pictures,
        when the node was configured.
        """
        asked = self.count_asked()
        self.make_transitions("activate")
        # Pictures of one publisher arrive in order: what was sent earlier is here by then.
        if not self.see_picture(lambda: self.pictures()[-1].value.number >= asked):
            raise Failed(
                expected="After a second “activate” pictures come again.",
                actual=f"None came{self.rig.error_note()}.",
            )
        if old := [p for p in self.pictures() if p.published > inactive and p.value.number < asked]:
            raise Failed(
                expected="An inactive node publishes nothing, and one that is active again only "
                "pictures that its camera has taken since.",
                actual=f"After “deactivate”, or after the next “activate”, it published "
                f"{pictures_phrase(len(old))} taken before that “activate”.",
            )
        if more := self.rig.node.count_strange() - strange:
            raise Failed(
                expected="An inactive node publishes nothing.",
                actual=f"It published {pictures_phrase(more)} that its camera had not taken.",
            )

    def require_silent_at_once(self) -> None:
        """Fail if a picture that was being exposed at “deactivate” is published after it.

        By the times that DDS gives: what was published before, and arrives after, is in order. But
        a writer that lies about them is not believed once all has come to rest.
        """
        for _ in range(EXPOSURES):
            self.make_transitions("activate")
            asked = self.count_asked()
            self.see_picture(lambda least=asked: self.count_asked() > least)  # type: ignore[misc]
            under_way = Deadline(EXPOSURE_S)
            self.make_transitions("deactivate")
            in_time, inactive = under_way.seconds_left, time.time_ns()
            self.rig.settle_messages()
            self.let_arrive()
            if any(picture.published > inactive for picture in self.pictures()[-1:]):
                raise Failed(
                    expected="When “deactivate” has succeeded the node sends no picture, also not "
                    "the one that its camera was just taking.",
                    actual="It sent one that a slow camera had ready when the node was inactive.",
                )
            if in_time:
                return

    # Its rounds through the states.

    def require_round(self, hz: float, *, seconds: int = 1, later_hz: float = 0.0) -> None:
        """Fail unless a node works by the rate that it is configured with, and gives all back.

        ``later_hz`` is a rate that is set later: good for the next time, or refused.
        """
        self.configure(rate=hz)
        self.require_open()
        self.require_publishers(1, "After “configure”")
        when = f" with a rate of {hz:g} Hz"
        if later_hz:
            self.manager.set_parameters(device=new_device())  # good for the next time as well
            if self.manager.set_parameters(rate=later_hz):
                when = (
                    f": {hz:g} Hz was set at “configure”, the {later_hz:g} Hz set since are for "
                    "the next"
                )
        self.make_transitions("activate")
        self.require_picture()
        self.require_rate(hz, when, seconds=seconds)
        self.make_transitions("deactivate", "cleanup")
        self.require_nothing_held("After “cleanup”")

    def require_refusals(self, what: str, kind: str, rates_hz: Sequence[float]) -> None:
        """Fail unless configurations of a kind are refused, and leave nothing behind.

        ``what`` they are called in the plural: a ``kind`` of camera, with one of the rates.
        """
        before = self.rig.process.read_usage()
        for hz in rates_hz:
            how = f"a rate of {hz:g} Hz" if kind == "front" else f"a camera {kind!r}"
            self.device = new_device(kind)
            if not self.manager.set_parameters(device=self.device, rate=hz):
                continue  # refused even earlier: a parameter callback is as good
            if (state := self.attempt_transition("configure")) != "unconfigured":
                raise Failed(
                    expected=f"Configured with {how}, your node stays unconfigured.",
                    actual=f"It is {state}.",
                )
            self.require_closed(f"After a “configure” with {how}")
        expected = "A configuration that is refused leaves no thread and no file behind."
        require_flat(self.rig, before, len(rates_hz), what=what, expected=expected)

    def fail_to_activate(self, time: str) -> str:
        """Fail unless a camera whose stream does not start ends in an error; return the state.

        ``time`` says which time it is, to end a phrase with.
        """
        self.set_camera("stuck")
        # Whoever tries the stream when the node is configured finds out even earlier.
        if (state := self.attempt_transition("configure")) == "inactive":
            self.require_publishers(1, "After “configure”")
            state = self.attempt_transition("activate")
        if state not in ("unconfigured", "finalized"):
            raise Failed(
                expected=f"If the stream does not start{time}, your node ends unconfigured or "
                "finalized.",
                actual=f"It is {state}.",
            )
        self.require_nothing_held(f"After the error{time}")
        return state
