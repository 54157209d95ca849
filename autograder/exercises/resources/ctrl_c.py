"""A camera driver in a plain program that is ended by SIGINT: what it then has not given back.

The harness asks a student's process to destroy a node, so that process knows when it is looked at.
A program that is interrupted is not asked.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median_low
from typing import Any

from rclpy.node import Node

from autograder.exam import Failed
from autograder.exercises.resources.camera_duties import DRIVER, ENDED
from autograder.exercises.resources.examiner_node import IMAGE, SNAPSHOT
from autograder.exercises.resources.process_usage import Usage
from autograder.exercises.resources.rig import CameraRig
from autograder.observe.patience import Patience
from autograder.observe.phrases import phrase
from autograder.observe.stillness import Stillness
from autograder.programs import Program

LIVES = 4
MEMORY = 1024  # KiB a life: nobody has Python collect what is garbage
WHEN = "When the driver runs in a program of its own, which is ended by Ctrl-C,"


@dataclass(frozen=True)
class Lives:
    """What was seen of a driver's lives in a plain program.

    ``worked`` is whether it took pictures in each, ``raised`` whether its end was that of the
    program; ``left_open`` and ``left_on_graph`` are what it had not given back after one, and
    ``usages`` what the program held after each; ``others`` tells of processes that were left then.
    """

    worked: bool = True
    raised: bool = False
    left_open: bool = False
    left_on_graph: bool = False
    usages: tuple[Usage, ...] = ()
    others: str = ""

    def kept(self) -> Usage:
        """Return what a life leaves behind: the median, as something else may come or go once."""
        grown = [after.grown(before) for before, after in pairwise(self.usages)]
        return Usage(*map(median_low, zip(*grown, strict=True)))


def require_off_graph_at_the_end(rig: CameraRig) -> None:
    """Fail unless a driver's endpoints go at Ctrl-C."""
    if (lives := _lives(rig)) is not None and lives.left_on_graph:
        raise _failed("nothing of it is on the graph.", "Its publisher or service still was.")


def require_closed_at_the_end(rig: CameraRig) -> None:
    """Fail unless a driver closes its camera at Ctrl-C."""
    if (lives := _lives(rig)) is None:
        return
    if not lives.worked:
        raise _failed("it takes pictures.", "It took none.")
    if lives.raised:
        raise _failed(
            "its destroy_node() returns.", "The program was gone: an exception left it, or an exit."
        )
    if lives.left_open:
        raise _failed("its destroy_node() closes the camera.", "It was still open.")


def require_nothing_kept_at_the_end(rig: CameraRig) -> None:
    """Fail if each life of a driver leaves a thread, a file or memory in the program."""
    lives = _lives(rig)
    if lives is None or len(lives.usages) < LIVES:
        return
    if left := _leaks(lives.kept()):
        raise _failed(
            "it leaves no thread and no file behind, and less than 1 MiB.",
            f"Each of its lives left {phrase(left)} behind.{lives.others}",
        )


def _leaks(kept: Usage) -> list[str]:
    left = ["a thread"] if kept.threads > 0 else []
    left += ["an open file"] if kept.files > 0 else []
    left += [f"{kept.memory // 1024} MiB of memory"] if kept.memory >= MEMORY else []
    return left


def _lives(rig: CameraRig) -> Lives | None:
    """Return what was seen, once a notebook; None where there are no such programs."""
    if rig.programs is None:
        return None
    if Lives.__name__ not in rig.memory:
        device = rig.device()
        with rig.programs.program([(DRIVER, [device])]) as program:
            rig.memory[Lives.__name__] = _watch(rig, program, device)
    found = rig.memory[Lives.__name__]
    assert isinstance(found, Lives)
    return found


def _watch(rig: CameraRig, program: Program, device: str) -> Lives:
    watcher = program.session.run(lambda: Node("watcher"))
    assert isinstance(watcher, Node)

    def on_graph() -> bool:
        return bool(watcher.count_publishers(IMAGE) or watcher.count_services(SNAPSHOT))

    still = Stillness(rig.outside)

    def comes(condition: Callable[[], Any]) -> bool:
        return Patience(still).wait(program.session, condition)

    usages: list[Usage] = []
    for _ in range(LIVES):
        # A picture is asked for by a timer or a thread, once the nodes spin.
        if not program.up or not comes(lambda: any(rig.cameras(device))):
            return Lives(worked=False)
        comes(on_graph)
        program.interrupt()
        closed = comes(lambda: not rig.cameras(device))
        off_graph = comes(lambda: not on_graph())
        if program.ended():
            return Lives(raised=True)
        if not closed or not off_graph:
            return Lives(left_open=not closed, left_on_graph=not off_graph)
        usages.append(_usage(rig, program, usages))
        others = rig.others()
        program.interrupt()
    return Lives(usages=tuple(usages), others=others)


def _usage(rig: CameraRig, program: Program, before: Sequence[Usage]) -> Usage:
    """Return what the program holds, once no more goes that the task gives a second to go."""
    if before:
        last = before[-1]
        program.wait(lambda: not _leaks(rig.process.usage().grown(last)), ENDED)
    return rig.process.usage()


def _failed(expected: str, actual: str) -> Failed:
    return Failed(expected=f"{WHEN} {expected}", actual=actual)
