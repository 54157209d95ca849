"""A managed camera in a plain program: its rounds, its pace, and what it leaves at Ctrl-C."""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise

from autograder.examination.exam import Failed, NotExaminable
from autograder.examination.plain_programs import Programs
from autograder.exercises.resources.camera_examiner import IMAGE
from autograder.exercises.resources.camera_program import GONE, KEPT_KIB, CameraProgram
from autograder.exercises.resources.rig import MANAGED, RATE_HZ, CameraRig, new_device
from autograder.observe.lifecycle.lifecycle_leaks import memory_kept
from autograder.observe.lifecycle.lifecycle_manager import LifecycleManager, find_lifecycle_node
from autograder.observe.lifecycle.observer import ENDED_S
from autograder.observe.lifecycle.process_holdings import Usage, list_kept
from autograder.observe.phrases import as_phrase
from autograder.observe.programs.program_observer import Faults, require_no_fault

LIVES, TAKES = 3, 2
"""In a program; and programs, as one may end or be slow on a busy machine: the last take counts."""
USUAL_HZ = 20
"""Pictures a second: a rate is taken in half the time that the default one takes."""
ROUND_HZ = 0.1
"""During the rounds: a timer that goes on while it is inactive does not come to a tick, whose error
would end the program. That is another check's, and would depend on the machine here."""
ROUNDS = 5
"""From “configure” to “cleanup”, whose memory is measured."""
ALONE = "When the managed camera runs in a program of its own,"
ENDED = f"{ALONE} which is ended by Ctrl-C while it is active,"
WORKS, ENDS = "managed_gives_back", "managed_shutdown"
"""The checks in which it counts how it works, and how it ends."""


def require_managed_in_program(rig: CameraRig, check: str, node: str) -> None:
    """Fail if the managed camera ``node`` has shown something against a check in a program."""

    def watch_managed(programs: Programs) -> Faults:
        faults: Faults = {}
        for _ in range(TAKES):
            with programs.program([(MANAGED, [])], twice=True) as program:
                seen = ManagedWatch(rig, program, new_device())
                seen.watch_lives(node)
            if not (faults := seen.faults):
                break
        return faults

    require_no_fault(rig, check, watch_managed)


class ManagedWatch(CameraProgram):
    """Watches a managed camera, which is driven over its services and interrupted when active."""

    def watch_lives(self, node: str) -> None:
        """Watch its lives: what the program has more after each of them is left by it.

        So is a node that is there after a later one, and was not after the first.
        """
        own: Collection[bytes] | None = None
        for life in range(LIVES):
            try:
                name, hz = self._begin_life(node, is_first=life == 0)
            except (Failed, NotExaminable) as fault:
                # rclpy 7.1 leaves an ended node's services: one of them may have been asked later.
                if life == 0:
                    self.faults = {WORKS: fault, ENDS: fault}
                break
            self._require_pace(hz)
            self.program.interrupt()
            self._require_ended(name, own)
            if self.faults:
                return
            self.usages.append(self.process.read_usage())
            own = {*self.find_nodes()} if own is None else own
            self.program.interrupt()
        grown = [after.growth_since(before) for before, after in pairwise(self.usages)]
        if grown:
            self._note_left(list_kept(Usage(*map(min, zip(*grown, strict=True)))))

    def _begin_life(self, node: str, *, is_first: bool) -> tuple[str, float]:
        """Have the managed camera activated; return its name and its rate in Hz."""
        name, self.device = self._find_managed(node), new_device()
        manager = LifecycleManager(self, name, MANAGED)
        hz = float(self.rig.draws.whole("a rate by the machine's clock", USUAL_HZ, 15, 25))
        try:
            manager.require_parameters(device=self.device)
            if is_first:
                self._require_flat_rounds(manager)
            if not manager.set_parameters(rate=hz):  # that is another check's
                hz = RATE_HZ
                manager.set_parameters(rate=hz)
            manager.make_transitions("configure", "activate")
        except Failed as failed:
            raise Failed(
                expected=f"{ALONE} it goes through its states as well: {failed.expected}",
                actual=failed.actual,
                picture=failed.picture,
            ) from None
        return name, hz

    def _find_managed(self, node: str) -> str:
        if name := find_lifecycle_node(self, node, lambda: self.find_nodes().values()):
            return name
        if self.is_gone():
            raise Failed(expected=f"{ALONE} it can be made as well.", actual=GONE)
        raise NotExaminable(
            f"It was not found out which node of a plain program is {MANAGED}. After a hand-in a "
            "person looks at it."
        )

    def _require_flat_rounds(self, manager: LifecycleManager) -> None:
        """Note what memory rounds through the states keep: nobody has Python collect it here."""
        manager.set_parameters(rate=ROUND_HZ)
        if manager.attempt_transition("configure") == "inactive":
            manager.make_transitions("cleanup")
        else:  # that is another check's
            manager.set_parameters(rate=RATE_HZ)
        kept_kib = memory_kept(self, manager, ROUNDS)
        if kept_kib >= KEPT_KIB:
            self.note_fault(
                WORKS,
                f"{ALONE} rounds from “configure” to “cleanup” leave less than 1 MiB of memory "
                "each.",
                f"Each of {ROUNDS} rounds left {kept_kib // 1024} MiB.{self.process.others_note()}",
            )

    def _require_pace(self, hz: float) -> None:
        came = self.wait(self.count, idle=ENDED_S)
        if pace := self.rate_fault(self.count, hz, "pictures") if came else "None came.":
            self.note_fault(
                WORKS,
                f"{ALONE} it sends as many pictures a second by the machine's clock as its rate "
                f"says, which was {hz:g} Hz.",
                pace,
            )

    def _require_ended(self, name: str, own: Collection[bytes] | None) -> None:
        """Note what an interrupted node leaves; of nodes those that are not the notebook's own.

        Without them only one of its name is known to be left by it.
        """

        def nodes_left() -> list[str]:
            found = self.find_nodes().items()
            names = {n for end, n in found if (n == name if own is None else end not in own)}
            return [f"the node {name}" for name in sorted(names)]

        left = [] if self.wait_for_end(lambda: not self.asked()) else ["its open camera"]
        if not self.wait_for_end(lambda: not self.node.count_publishers(IMAGE)):
            left.append(f"its publisher on {IMAGE}")
        if not self.wait_for_end(lambda: not nodes_left()):
            left += nodes_left()
        if self.is_gone():
            self.note_fault(
                ENDS,
                f"{ENDED} its destroy_node() returns, and may be called a second time.",
                GONE,
            )
        else:
            self._note_left(left)

    def _note_left(self, left: list[str]) -> None:
        if left:
            self.note_fault(
                ENDS,
                f"{ENDED} its destroy_node() leaves nothing behind.",
                f"It left {as_phrase(left)} behind.{self.process.others_note()}",
            )
