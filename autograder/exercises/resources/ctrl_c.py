"""A camera driver in a plain program that is ended by SIGINT: what it then has not given back.

The harness asks a student's process to destroy a node, so that process knows when it is looked at.
A program that is interrupted is not asked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from rclpy.node import Node

from autograder.exam import Failed
from autograder.exercises.resources.camera_duties import DRIVER, ENDED
from autograder.exercises.resources.examiner_node import IMAGE, SNAPSHOT
from autograder.exercises.resources.rig import CameraRig
from autograder.observe.patience import Patience
from autograder.observe.stillness import Stillness
from autograder.programs import Program

LIVES = 4
WHEN = "When the driver runs in a program of its own, which is ended by Ctrl-C,"


@dataclass(frozen=True)
class Lives:
    """What was seen of a driver's lives in a plain program.

    ``worked`` is whether it took pictures in each, ``raised`` whether its end was that of the
    program; ``left_open`` and ``left_on_graph`` are what it had not given back after one, and
    ``threads`` how many there were after each.
    """

    worked: bool = True
    raised: bool = False
    left_open: bool = False
    left_on_graph: bool = False
    threads: tuple[int, ...] = ()


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


def require_no_thread_at_the_end(rig: CameraRig) -> None:
    """Fail if each life of a driver leaves a thread that goes on after Ctrl-C."""
    lives = _lives(rig)
    if lives is None or len(lives.threads) < LIVES:
        return
    if all(later > earlier for earlier, later in pairwise(lives.threads)):
        raise _failed("it ends its threads.", "Each of its lives left a thread behind.")


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

    threads: list[int] = []
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
        threads.append(_threads(rig, program, min(threads, default=0)))
        program.interrupt()
    return Lives(threads=tuple(threads))


def _threads(rig: CameraRig, program: Program, before: int) -> int:
    """Return how many threads there are, once no more end that the task gives a second to end."""
    program.wait(lambda: len(rig.process.thread_ids()) <= before, ENDED if before else 0.0)
    return len(rig.process.thread_ids())


def _failed(expected: str, actual: str) -> Failed:
    return Failed(expected=f"{WHEN} {expected}", actual=actual)
