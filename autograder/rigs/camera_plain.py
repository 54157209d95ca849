"""A camera driver in a plain program that is ended by SIGINT: what it then has not given back.

The harness asks a student's process to destroy a node, so that process knows when it is looked at.
A program that is interrupted is not asked.
"""

from __future__ import annotations

from itertools import pairwise

from rclpy.node import Node

from autograder.exam import Failed
from autograder.programs import Program
from autograder.rigs.camera import CameraRig
from autograder.rigs.camera_duties import DRIVER, ENDED
from autograder.rigs.camera_node import IMAGE, SNAPSHOT
from autograder.rigs.patience import SETTLE_S

LIVES = 4
WHEN = "When the driver runs in a program of its own, which is ended by Ctrl-C,"


def require_given_back_at_the_end(rig: CameraRig) -> None:
    """Fail unless a driver gives back its camera, its endpoints and its threads at Ctrl-C."""
    if rig.programs is None:
        return
    device = rig.device()
    with rig.programs.program([(DRIVER, [device])]) as program:
        watcher = program.session.run(lambda: Node("watcher"))
        assert isinstance(watcher, Node)
        threads: list[int] = []
        for _ in range(LIVES):
            if not program.up or not program.wait(lambda: any(rig.cameras(device)), SETTLE_S):
                raise _failed("it takes pictures.", "It took none.")
            program.interrupt()
            _require_closed(rig, program, device)
            _require_off_graph(program, watcher)
            threads.append(_threads(rig, program, min(threads, default=0)))
            program.interrupt()
    if all(later > earlier for earlier, later in pairwise(threads)):
        raise _failed("it ends its threads.", "Each life of the driver left a thread behind.")


def _require_closed(rig: CameraRig, program: Program, device: str) -> None:
    if not program.wait(lambda: not rig.cameras(device), SETTLE_S) or program.ended():
        raise _failed(
            "its destroy_node() closes the camera.",
            "The program ended with it, as an exception left destroy_node()."
            if program.ended()
            else f"{SETTLE_S:.0f} s later the camera {device!r} was still open.",
        )


def _require_off_graph(program: Program, watcher: Node) -> None:
    def gone() -> bool:
        return not watcher.count_publishers(IMAGE) and not watcher.count_services(SNAPSHOT)

    if not program.wait(gone, SETTLE_S):
        raise _failed("nothing of it is on the graph.", "Its publisher or service still was.")


def _threads(rig: CameraRig, program: Program, before: int) -> int:
    """Return how many threads there are, once no more end that the task gives a second to end."""
    program.wait(lambda: before and len(rig.process.thread_ids()) <= before, ENDED if before else 0)
    return len(rig.process.thread_ids())


def _failed(expected: str, actual: str) -> Failed:
    return Failed(expected=f"{WHEN} {expected}", actual=actual)
