"""Looks at nodes in a plain program, where nobody but the machine tells what time it is."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from autograder.examination.plain_programs import Program
from autograder.exercises.resources.camera_examiner import IMAGE, SNAPSHOT
from autograder.exercises.resources.observer import Observer
from autograder.exercises.resources.rig import CameraRig
from autograder.observe.participants import node_of, of_others
from autograder.observe.patience import IDLE_S
from autograder.observe.phrases import capitalize_first, pictures_phrase
from autograder.processes.fair_deadline import FairDeadline

COUNTED = 6
"""Pictures whose rate is taken."""
SLOWEST, FASTEST = 0.6, 1.6
"""Times a rate that are taken for it: a busy machine is no fault of a node's."""
TAKES, SLOW_TAKES = 12, 2
"""Of a rate, as pictures that have been held up come many at a time; and of one that is too slow
although nothing has held it up."""
HELD_UP = 0.2
"""Part of a take's time from which on a busy machine may be why it was slow: it says nothing."""
CHANGE_STATE = "/change_state"
"""What is added to the name of a lifecycle node for that of a service which each has."""


class ProgramObserver(Observer):
    """Someone in the network of a plain program; what the program's processes hold, a rig sees."""

    def __init__(self, rig: CameraRig, program: Program) -> None:
        """Bring up endpoints in the network of ``program``."""
        super().__init__(program.session, rig.outside)
        self.rig = rig
        self.program = program

    def is_gone(self) -> bool:
        """Whether the program has ended."""
        return self.program.has_ended()

    def wait(
        self, condition: Callable[[], Any], timeout: float | None = None, idle: float = IDLE_S
    ) -> bool:
        """Wait as `Observer.wait` does, as long as the program is there."""
        super().wait(lambda: condition() or self.is_gone(), timeout, idle)
        return bool(condition())

    def wait_for_end(self, over: Callable[[], Any]) -> bool:
        """Wait as `CameraRig.wait_for_end` does, as long as the program is there."""
        self.rig.wait_for_end(lambda: over() or self.is_gone(), self.session)
        return bool(over())

    def is_working(self) -> bool:
        """Whether a publisher of pictures or a service for them is on the graph."""
        return bool(self.node.count_publishers(IMAGE) or self.node.count_services(SNAPSHOT))

    def find_nodes(self) -> dict[bytes, str]:
        """Return the program's nodes on the graph, by what each of them publishes on."""
        ends = of_others(self.node.get_publishers_info_by_topic("/parameter_events"))
        return {bytes(end.endpoint_gid): node_of(end) for end in ends}

    def lifecycle_nodes(self) -> list[str]:
        """Return the full names of the lifecycle nodes on the graph.

        Of one that was destroyed rclpy 7.1 leaves the services there until Python collects it.
        """
        services = {name for name, _ in self.node.get_service_names_and_types()}
        nodes = sorted({*self.find_nodes().values()})
        return [name for name in nodes if f"{name}{CHANGE_STATE}" in services]

    def pace_fault(self, device: str, rate: float) -> str:
        """Return how many pictures of ``device`` come in what time, unless at about this rate."""

        def came() -> int:
            return len(self.node.pictures_of(device))

        slow, held_up, delay = 0, 0, self.rig.outside.delay
        for _ in range(TAKES):
            begun, before, mark = time.monotonic(), came(), delay.mark()
            deadline = FairDeadline(COUNTED / (SLOWEST * rate), delay)
            while (
                (left := deadline.seconds_left) and came() < before + COUNTED and not self.is_gone()
            ):
                self.wait(lambda most=before + COUNTED: came() >= most, left)  # type: ignore[misc]
            number, seconds = came() - before, time.monotonic() - begun
            if SLOWEST * rate * seconds <= number <= FASTEST * rate * seconds:
                return ""
            if number < SLOWEST * rate * seconds:
                was_held_up = number >= COUNTED and delay.delay_since(mark) >= HELD_UP * seconds
                held_up += was_held_up
                slow += not was_held_up
            if slow == SLOW_TAKES:
                break
        if held_up > TAKES // 2:
            return ""  # the machine was too busy to tell
        return f"{capitalize_first(pictures_phrase(number))} came in {seconds:.1f} s."
