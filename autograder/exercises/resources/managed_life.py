"""One life of a managed camera in a plain program: driven over its services, ended by SIGINT."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_examiner import IMAGE
from autograder.exercises.resources.managed import Managed
from autograder.exercises.resources.program_observer import ProgramObserver
from autograder.exercises.resources.rig import ENDED, CameraRig

MANAGED = "ManagedCamera"
RATE, USUAL_RATE = 20, 10
"""Pictures a second: a rate is taken in half the time that the usual one takes."""
ROUND_RATE = 0.1
"""Hz during the rounds: a timer that goes on while it is inactive does not come to a tick, whose
error would end the program. That is another check's, and would depend on the machine here."""
FIRST_ROUNDS, ROUNDS = 2, 5
"""From “configure” to “cleanup”: some may cost what no later ones do."""
MEMORY = 1024  # KiB a round, as in a harness that has garbage collected


@dataclass(frozen=True)
class ManagedLife:
    """What was seen of a managed camera's life in a plain program.

    ``made`` is whether it was found, ``failed`` what kept it from being active, ``pace`` tells of
    pictures that do not come at their rate. ``raised`` is whether its end was that of the program,
    ``left`` what it had not given back then. ``new_threads`` and ``new_files`` are how many there
    are since it was made, some of which the middleware may keep. ``kept`` is the memory in KiB that
    it had more after each round through its states.
    """

    made: bool = True
    failed: Failed | None = None
    rate: int = RATE
    pace: str = ""
    raised: bool = False
    left: tuple[str, ...] = ()
    new_threads: int = 0
    new_files: int = 0
    kept: int = 0

    @property
    def has_worked(self) -> bool:
        """Whether it was active and sent its pictures, and its rounds kept no memory."""
        return self.made and self.failed is None and not self.pace and self.kept < MEMORY

    @property
    def went_on(self) -> bool:
        """Whether the program was there after it."""
        return self.made and self.failed is None and not self.raised

    @property
    def is_clean(self) -> bool:
        """Whether it is certain that nothing of it was left."""
        return self.went_on and not (self.left or self.new_threads > 0 or self.new_files > 0)


def watch_managed(
    seen: ProgramObserver,
    node: str = "",
    own: Collection[bytes] | None = None,
    *,
    weigh: bool = True,
) -> ManagedLife:
    """Have a managed camera, which is being made, send pictures, and interrupt its program then.

    ``node`` is its full name where that is known; else, or if it is not there, the one lifecycle
    node is taken for it. ``own`` are nodes that the notebook's cells have made, which stay, as in
    `ProgramObserver.find_nodes`; without them only one of its name is known to be left by it.
    ``weigh`` what memory its rounds keep.
    """
    rig = seen.rig
    seen.wait(lambda: node in seen.lifecycle_nodes() or (not node and seen.lifecycle_nodes()))
    there = seen.lifecycle_nodes()
    if node not in there and len(there) != 1:
        return ManagedLife(made=False, raised=seen.is_gone())
    device = rig.new_device()
    rate = rig.draws.whole("a rate by the machine's clock", RATE, 15, 25)
    name = node if node in there else there[0]
    managed = Managed(seen, name)
    threads, before = rig.process.thread_ids(), rig.process.read_usage()
    try:
        managed.require_parameters(device=device)
        kept = _measure_rounds(rig, managed) if weigh else 0
        if not managed.set_parameters(rate=float(rate)):  # that is another check's
            rate = USUAL_RATE
            managed.set_parameters(rate=float(rate))
        managed.make_transitions("configure", "activate")
    except Failed as failed:
        return ManagedLife(failed=failed, raised=seen.is_gone())
    came = seen.wait(lambda: seen.node.pictures_of(device), idle=ENDED)
    pace = seen.pace_fault(device, rate) if came else "None came."
    seen.program.interrupt()
    left = []
    if not seen.wait_for_end(lambda: not rig.open_cameras(device)):
        left.append("its open camera")
    if not seen.wait_for_end(lambda: not seen.node.count_publishers(IMAGE)):
        left.append(f"its publisher on {IMAGE}")

    def nodes_left() -> list[str]:
        found = seen.find_nodes().items()
        return sorted({n for end, n in found if (n == name if own is None else end not in own)})

    if not seen.wait_for_end(lambda: not nodes_left()):
        left += [f"the node {name}" for name in nodes_left()]
    if seen.is_gone():
        return ManagedLife(rate=rate, pace=pace, raised=True, kept=kept)

    def new_threads() -> int:
        return len(rig.process.thread_ids() - threads)

    def new_files() -> int:
        return rig.process.read_usage().growth_since(before).files

    seen.wait_for_end(lambda: new_threads() <= 0 and new_files() <= 0)
    return ManagedLife(
        rate=rate, pace=pace, left=tuple(left), new_threads=new_threads(), new_files=new_files(),
        kept=kept,
    )  # fmt: skip


def _measure_rounds(rig: CameraRig, managed: Managed) -> int:
    """Return what memory in KiB the program has more after each of some rounds: nobody collects."""
    managed.set_parameters(rate=ROUND_RATE)
    if managed.attempt_transition("configure") == "inactive":
        managed.make_transitions("cleanup")
    else:  # that is another check's
        managed.set_parameters(rate=float(USUAL_RATE))
    for rounds in (FIRST_ROUNDS, ROUNDS):
        before = rig.process.read_usage()
        for _ in range(rounds):
            managed.make_transitions("configure", "activate", "deactivate", "cleanup")
    return rig.process.read_usage().growth_since(before).memory // ROUNDS
