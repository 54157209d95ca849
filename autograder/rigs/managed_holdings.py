"""What a managed camera has in its states: its camera, endpoints, and itself on the graph."""

from __future__ import annotations

from autograder.exam import Failed
from autograder.rigs.camera import SETTLE, CameraRig
from autograder.rigs.camera_duties import require_closed
from autograder.rigs.camera_graph import NODE, SERVICE, SUBSCRIPTION
from autograder.rigs.camera_node import IMAGE
from autograder.rigs.phrases import phrase


def require_only_pictures(rig: CameraRig) -> None:
    """Fail if a managed node that has sent a picture has endpoints of the plain one as well.

    Those that it made before that publisher are known by then.
    """
    if more := [what for what in rig.graph.endpoints() if what in (SUBSCRIPTION, SERVICE)]:
        raise Failed(
            expected="The managed node has no zoom and no snapshot.",
            actual=f"There was {phrase(more)} on the graph.",
        )


def require_no_publisher_yet(rig: CameraRig) -> None:
    """Fail if a node that has never been configured has a publisher on the image topic."""
    rig.catch_up()
    if rig.graph.publishers():
        raise Failed(
            expected=f"Before the first “configure” there is no publisher on {IMAGE}.",
            actual="There was one: your node makes it in its constructor.",
        )


def require_one_publisher(rig: CameraRig) -> None:
    """Fail unless a node that is configured has exactly one publisher on the image topic."""
    if not rig.wait(lambda: rig.graph.publishers() == 1):
        raise Failed(
            expected=f"A configured node has one publisher on {IMAGE}.",
            actual=f"The number of its publishers was {rig.graph.publishers()}.",
        )


def require_nothing_held(rig: CameraRig, device: str, when: str) -> None:
    """Fail if a managed node holds a camera or a publisher."""
    require_closed(rig, device, when)
    if not rig.wait(lambda: not rig.graph.publishers()):
        raise Failed(
            expected=f"{when} there is no publisher on {IMAGE}.",
            actual=f"{SETTLE:.0f} s later the number of publishers was {rig.graph.publishers()}.",
        )


def require_off_graph(rig: CameraRig, node: str, when: str) -> None:
    """Fail if the ``node`` itself is on the graph, or another one that it made."""
    name = f"{NODE}{node}"
    if rig.wait(lambda: name not in rig.graph.endpoints(node) and not rig.graph.nodes()):
        return
    if name in rig.graph.endpoints(node):
        raise Failed(
            expected=f"{when} the node is off the graph.",
            actual=f"{SETTLE:.0f} s later {name} was still there: only the inherited "
            "destroy_node() takes it down.",
        )
    made = phrase([NODE + name for name in rig.graph.nodes()])
    raise Failed(
        expected=f"{when} nothing that your node made is on the graph.",
        actual=f"{SETTLE:.0f} s later there still was {made}.",
    )
