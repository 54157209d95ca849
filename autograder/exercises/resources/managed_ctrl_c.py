"""A managed camera in a plain program: its pace by the machine's clock, and its end by SIGINT.

What it does there is seen once, after the driver's lives. Whatever is not right then is looked at
again in a program of its own, in which nothing can come of the driver.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from autograder.examination.exam import Failed, NotExaminable
from autograder.examination.plain_programs import Programs
from autograder.exercises.resources.camera_usage import Usage
from autograder.exercises.resources.ctrl_c import lives_so_far
from autograder.exercises.resources.managed_life import (
    MANAGED,
    MEMORY,
    ROUNDS,
    ManagedLife,
    watch_managed,
)
from autograder.exercises.resources.program_observer import ProgramObserver
from autograder.exercises.resources.rig import CameraRig
from autograder.observe.phrases import as_phrase

LIVES = 3
ALONE = "When the managed camera runs in a program of its own,"
ENDED = f"{ALONE} which is ended by Ctrl-C while it is active,"


def require_managed_pace(rig: CameraRig, node: str) -> None:
    """Fail unless a managed camera, ``node``, keeps its rate by the machine's clock.

    Nor may the rounds before that keep memory.
    """
    life = _in_shared_program(rig)
    if life is None or not life.has_worked:
        life = _in_own_program(rig, node)
    if life is None:
        return
    _require_active(life)
    if life.kept >= MEMORY:
        raise Failed(
            expected=f"{ALONE} rounds from “configure” to “cleanup” leave less than 1 MiB of "
            "memory each.",
            actual=f"Each of {ROUNDS} rounds left {life.kept // 1024} MiB.{rig.process_note()}",
        )
    if life.pace:
        raise Failed(
            expected=f"{ALONE} it sends as many pictures a second by the machine's clock as its "
            f"rate says, which was {life.rate} Hz.",
            actual=life.pace,
        )


def require_managed_ended(rig: CameraRig, node: str) -> None:
    """Fail unless an active managed camera, ``node``, gives everything back at Ctrl-C."""
    life = _in_shared_program(rig)
    if life is None or not life.is_clean:
        life = _in_own_program(rig, node)
    if life is None:
        return
    _require_active(life)
    if life.raised:
        raise Failed(
            expected=f"{ENDED} its destroy_node() returns, and may be called a second time.",
            actual="The program was gone: an exception left it, or an exit.",
        )
    if life.left:
        raise Failed(
            expected=f"{ENDED} its destroy_node() leaves nothing behind.",
            actual=f"It left {as_phrase([*life.left])} behind.{rig.process_note()}",
        )


def _require_active(life: ManagedLife) -> None:
    if life.failed is not None:
        raise Failed(
            expected=f"{ALONE} it goes through its states as well: {life.failed.expected}",
            actual=life.failed.actual,
        )
    if not life.made and life.raised:
        raise Failed(
            expected=f"{ALONE} it can be made as well.",
            actual="The program was gone: an exception left it, or an exit.",
        )
    if not life.made:
        raise NotExaminable(
            f"It was not found out which node of a plain program is {MANAGED}. After a hand-in a "
            "person looks at it."
        )


def _in_shared_program(rig: CameraRig) -> ManagedLife | None:
    """Return what was seen after the driver's lives; None if these did not go so far."""
    lives = lives_so_far(rig)
    return lives.managed if lives is not None else None


def _in_own_program(rig: CameraRig, node: str) -> ManagedLife | None:
    """Return what was seen in a program of its own, once a notebook; None if there is none."""
    if rig.programs is None:
        return None
    if ManagedLife.__name__ not in rig.memory:
        rig.memory[ManagedLife.__name__] = _watch_alone(rig, rig.programs, node)
    found = rig.memory[ManagedLife.__name__]
    assert isinstance(found, ManagedLife)
    return found


def _watch_alone(rig: CameraRig, programs: Programs, node: str) -> ManagedLife:
    """Watch some lives; what the program has more after each of them is left by it.

    So is a node that is there after a later one, and was not after the first.
    """
    lives = lives_so_far(rig)
    own: set[bytes] | None = None if lives is None or lives.own_nodes else set()
    with programs.program([(MANAGED, [])], twice=True) as program:
        seen, usages, life = ProgramObserver(rig, program), list[Usage](), ManagedLife()
        for _ in range(LIVES):
            again = watch_managed(seen, node, own, weigh=not usages)
            if usages and again.failed is not None:
                break  # rclpy 7.1 leaves an ended node's services: one of them may have been asked
            life = replace(again, kept=max(life.kept, again.kept))
            if not life.went_on or life.left or life.pace:
                return life
            usages.append(rig.process.read_usage())
            own = {*seen.find_nodes()} if own is None else own
            program.interrupt()
    grown = [after.growth_since(before) for before, after in pairwise(usages)]
    if not grown:
        return life
    threads, files, _ = map(min, zip(*grown, strict=True))
    left = ["a thread"] if threads > 0 else []
    left += ["an open file"] if files > 0 else []
    return replace(life, left=tuple(left))
