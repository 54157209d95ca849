"""What a managed camera has in its states: its camera, endpoints, and itself on the graph."""

from __future__ import annotations

from collections import Counter

from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_duties import require_closed
from autograder.exercises.resources.camera_examiner import IMAGE
from autograder.exercises.resources.camera_graph import NODE, SERVICE, SUBSCRIPTION, describe_node
from autograder.exercises.resources.managed import Managed
from autograder.exercises.resources.rig import GHOSTS, CameraRig
from autograder.observe.patience import SETTLE_S
from autograder.observe.phrases import as_phrase, capitalize_first

FOUND = 3.0  # s in which a node in another context is found, as a participant of its own


def require_only_pictures(rig: CameraRig) -> None:
    """Fail if a managed node that has sent a picture has endpoints of the plain one as well.

    Those that it made before that publisher are known by then.
    """
    if more := [what for what in rig.graph.list_endpoints() if what in (SUBSCRIPTION, SERVICE)]:
        raise Failed(
            expected="The managed node has no zoom and no snapshot.",
            actual=f"There was {as_phrase(more)} on the graph.",
        )


def require_no_publisher_yet(rig: CameraRig) -> None:
    """Fail if a node that has never been configured has a publisher on the image topic."""
    rig.catch_up()
    if rig.graph.count_publishers():
        raise Failed(
            expected=f"Before the first “configure” there is no publisher on {IMAGE}.",
            actual="There was one: your node makes it in its constructor.",
        )


def require_one_publisher(rig: CameraRig) -> None:
    """Fail unless a node that is configured has exactly one publisher on the image topic."""
    if not rig.wait(lambda: rig.graph.count_publishers() == 1):
        raise Failed(
            expected=f"A configured node has one publisher on {IMAGE}.",
            actual=f"The number of its publishers was {rig.graph.count_publishers()}.",
        )


def require_nothing_held(rig: CameraRig, device: str, when: str) -> None:
    """Fail if a managed node holds a camera or a publisher."""
    require_closed(rig, device, when)
    if not rig.wait(lambda: not rig.graph.count_publishers()):
        raise Failed(
            expected=f"{when} there is no publisher on {IMAGE}.",
            actual=f"{capitalize_first(rig.end_of_wait)} the number of publishers was "
            f"{rig.graph.count_publishers()}.",
        )


def require_off_graph(rig: CameraRig, node: str, when: str) -> None:
    """Fail if the ``node`` itself is on the graph, or another one that it made."""
    name = f"{NODE}{node}"
    if rig.wait(lambda: name not in rig.graph.list_endpoints(node) and not rig.graph.list_nodes()):
        return
    if name in rig.graph.list_endpoints(node):
        raise Failed(
            expected=f"{when} the node is off the graph.",
            actual=f"{capitalize_first(rig.end_of_wait)} {name} was still there: only the "
            "inherited destroy_node() takes it down.",
        )
    made = as_phrase([describe_node(name) for name in rig.graph.list_nodes()])
    raise Failed(
        expected=f"{when} nothing that your node made is on the graph.",
        actual=f"{capitalize_first(rig.end_of_wait)} there still was {made}.",
    )


def require_no_helper_finalized(rig: CameraRig, node: Managed) -> None:
    """Fail if a node that was made for a state, and goes with it, stays after a shutdown.

    One that is made once and for all is there in the state unconfigured, too: it may stay until
    destroy_node().
    """
    device = rig.new_device()
    node.require_parameters(device=device)
    rig.subject.collect()  # an earlier life may have left a node in a context that goes on
    at_first = len(_made_nodes(rig))
    node.make_transitions("configure", "activate", "deactivate", "cleanup")
    # Nodes go off the graph in their own time.
    rig.wait(lambda: len(rig.graph.list_nodes(process=True)) <= at_first, GHOSTS)
    idle, threads = _made_nodes(rig), rig.process.thread_ids()
    node.make_transitions("configure", "activate")
    started = rig.process.thread_ids() - threads
    node.make_transitions("shutdown")

    def left() -> list[str]:
        """Return the nodes that came since.

        A node alone in another context has threads, and they end with it: it need not be seen off.
        """
        ended = bool(started) and not started & rig.process.thread_ids()
        now = rig.graph.list_nodes(process=not ended)
        return list((Counter(now) - Counter(idle)).elements()) if len(now) > len(idle) else []

    _made_nodes(rig)
    # One with threads of its own may be found later than a mark.
    rig.wait(lambda: left() or not started & rig.process.thread_ids(), FOUND)
    if not left():
        return
    rig.subject.collect()  # who shuts a helper's context down leaves the rest to Python
    rig.see_picture(device, lambda: not left())
    if still := left():
        raise Failed(
            expected="After shutdown in the state active your node holds nothing, no other node "
            "that it has made for this state either.",
            actual=f"{SETTLE_S:.0f} s later there still was "
            f"{as_phrase([describe_node(name) for name in still])}: "
            "on_shutdown() runs then, and neither on_deactivate() nor on_cleanup() before it.",
        )


def _made_nodes(rig: CameraRig) -> list[str]:
    """Return the managed node, and the nodes that it has by now made beside itself."""
    rig.catch_up()
    # The mark is in one context; what others have told is here when all is at rest.
    rig.wait_for_rest()
    return rig.graph.list_nodes(process=True)
