"""A managed camera's ways from one “configure” to the next: those that work, those it refuses."""

from __future__ import annotations

from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_duties import (
    require_closed,
    require_open,
    require_picture,
    require_threads_ended,
)
from autograder.exercises.resources.camera_rate import require_rate
from autograder.exercises.resources.leaks import require_flat, require_flat_memory
from autograder.exercises.resources.managed import Managed
from autograder.exercises.resources.managed_holdings import (
    require_nothing_held,
    require_one_publisher,
)
from autograder.exercises.resources.rig import CameraRig

ROUNDS = 10
REFUSALS = 4  # at least, of a kind


def require_configuration(
    rig: CameraRig, node: Managed, rate: float, *, seconds: int = 1, later: float = 0.0
) -> None:
    """Fail unless a node that is configured with ``rate`` works by it, and gives everything back.

    ``later`` is a rate that is set once it is configured: good for the next time, or refused.
    """
    device = rig.new_device()
    node.require_parameters(device=device, rate=rate)
    node.make_transitions("configure")
    require_open(rig, device)
    require_one_publisher(rig)
    when = f" with a rate of {rate:g} Hz"
    if later:
        node.set_parameters(device=rig.new_device())  # good for the next time as well
    if later and node.set_parameters(rate=later):
        when = f": {rate:g} Hz was set at “configure”, the {later:g} Hz set since are for the next"
    node.make_transitions("activate")
    require_picture(rig, device)
    require_rate(rig, device, rate, when, seconds)
    node.make_transitions("deactivate", "cleanup")
    require_nothing_held(rig, device, "After “cleanup”")


def require_flat_rounds(rig: CameraRig, node: Managed) -> None:
    """Fail if rounds through the states leave threads, files, nodes or memory behind."""
    device = rig.new_device()
    node.require_parameters(device=device, rate=10.0)
    rig.subject.collect()
    rig.catch_up()
    nodes, before = len(rig.graph.list_nodes()), rig.process.read_usage()

    def some() -> None:
        for _ in range(ROUNDS):
            node.make_transitions("configure", "activate")
            rig.advance(0.3)
            node.make_transitions("deactivate", "cleanup")

    some()
    expected = f"{ROUNDS} rounds from “configure” to “cleanup” leave nothing behind,"
    require_flat(rig, before, ROUNDS, expected, "rounds")
    rig.catch_up()
    if (more := len(rig.graph.list_nodes()) - nodes) >= ROUNDS / 2:
        raise Failed(
            expected=f"{expected} and no node on the graph.",
            actual=f"There were {more} more nodes than before: your node makes helpers, and does "
            "not destroy them.",
        )
    require_flat_memory(rig, before, some, ROUNDS, expected, "rounds")


def require_no_thread_inactive(rig: CameraRig, node: Managed) -> None:
    """Fail if a thread that was started by “activate” goes on after “deactivate”."""
    node.make_transitions("configure")
    threads = rig.process.thread_ids()
    node.make_transitions("activate")
    rig.advance(0.3)
    node.make_transitions("deactivate")
    rig.advance(0.3)  # one that waits for the node's clock gets to see it
    require_threads_ended(rig, threads, "After “deactivate”")
    node.make_transitions("cleanup")


def require_refusals(rig: CameraRig, node: Managed, rates: tuple[float, ...]) -> None:
    """Fail unless configurations that are not possible are refused, and leave nothing behind."""
    kinds: dict[str, list[tuple[str, float, str]]] = {
        "refused rates": [(f"a rate of {rate:g} Hz", rate, "front") for rate in rates],
        "unplugged cameras": [("a camera 'unplugged'", 10.0, "unplugged")],
    }
    for rounds, refused in kinds.items():
        before = rig.process.read_usage()
        times = 0
        while times < REFUSALS:
            for what, rate, kind in refused:
                require_refused(rig, node, what, rate, kind)
                times += 1
        expected = "A configuration that is refused leaves nothing behind,"
        require_flat(rig, before, times, expected, rounds)


def require_refused(rig: CameraRig, node: Managed, what: str, rate: float, kind: str) -> None:
    """Fail unless the node stays unconfigured, and closes the camera of that ``kind``."""
    device = rig.new_device(kind)
    if not node.set_parameters(device=device, rate=rate):
        return  # refused even earlier: a parameter callback is as good
    if (state := node.attempt_transition("configure")) != "unconfigured":
        raise Failed(
            expected=f"Configured with {what}, your node stays unconfigured.",
            actual=f"It is {state}.",
        )
    require_closed(rig, device, f"After a “configure” with {what}")
