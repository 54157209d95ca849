"""A managed node that does nothing is named with the reason: its state, or a failed transition."""

from __future__ import annotations

import gc
import subprocess
import weakref
from collections.abc import Callable

import pytest
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from std_msgs.msg import String

from course import Session
from course.runtime.callbacks.transitions import failed_transitions

SUCCESS = TransitionCallbackReturn.SUCCESS


class Camera(LifecycleNode):
    """Makes its publisher when it is configured; one of its transitions may go wrong."""

    def __init__(self, wrong: str = "", how: Callable[[], object] = lambda: SUCCESS) -> None:
        super().__init__("camera")
        self.wrong, self.how = wrong, how

    def outcome(self, name: str, state: LifecycleState) -> object:
        if name == self.wrong:
            return self.how()
        return getattr(super(), name)(state)

    def on_configure(self, state: LifecycleState) -> object:
        self.images = self.create_lifecycle_publisher(String, "image", 1)
        return self.outcome("on_configure", state)

    def on_activate(self, state: LifecycleState) -> object:
        return self.outcome("on_activate", state)

    def on_deactivate(self, state: LifecycleState) -> object:
        return self.outcome("on_deactivate", state)

    def on_cleanup(self, state: LifecycleState) -> object:
        return self.outcome("on_cleanup", state)

    def on_shutdown(self, state: LifecycleState) -> object:
        return self.outcome("on_shutdown", state)


def refuse_work() -> object:
    raise OSError("no camera 7")


def said(session: Session) -> str:
    return "\n".join(one.as_text() for one in session.diagnose() if one.name == "lifecycle")


def test_an_inactive_publisher_publishes_nothing_and_is_named(session: Session) -> None:
    node = session.run(Camera)
    assert isinstance(node, Camera)
    session.run(listener)
    text = said(session)
    assert "/camera is unconfigured: what its on_configure() makes is not there yet, /image" in text
    assert "node.trigger_configure(), then node.trigger_activate()" in text
    node.trigger_configure()
    text = said(session)
    assert "/camera is inactive: what it publishes on /image goes nowhere, without a word" in text
    assert "-> Activate it: node.trigger_activate()." in text
    node.trigger_activate()
    assert said(session) == ""
    node.trigger_deactivate()
    assert "/camera is inactive" in said(session)
    node.trigger_shutdown()
    assert "/camera is finalized: no transition leads out of it." in said(session)


def listener() -> Node:
    node = Node("listener")
    node.create_subscription(String, "image", lambda _message: None, 1)
    return node


BEFORE = {
    "on_configure": (),
    "on_activate": ("configure",),
    "on_deactivate": ("configure", "activate"),
    "on_cleanup": ("configure",),
    "on_shutdown": (),
}


@pytest.mark.parametrize("name", BEFORE)
def test_an_exception_that_rclpy_swallows_is_seen(session: Session, name: str) -> None:
    node = session.run(Camera, name, refuse_work)
    assert isinstance(node, Camera)
    for verb in BEFORE[name]:
        getattr(node, f"trigger_{verb}")()
    trigger = getattr(node, name.replace("on_", "trigger_"))
    assert trigger() == TransitionCallbackReturn.ERROR
    line = refuse_work.__code__.co_firstlineno + 1
    text = said(session)
    assert (
        f"problem  lifecycle: Camera.{name} of /camera raised OSError: no camera 7 (line {line}: "
        'raise OSError("no camera 7")). rclpy hides it and calls on_error(). It is unconfigured '
        "now."
    ) in text
    assert "-> Mend that line and run the cell again." in text
    (failure,) = session.failed_transitions
    assert failure.traceback.startswith("Traceback (most recent call last):")
    assert "in refuse_work" in failure.traceback
    assert "rclpy" not in failure.traceback


def test_what_on_error_raises_finalizes_the_node(session: Session) -> None:
    class Worse(Camera):
        def on_error(self, state: LifecycleState) -> object:
            raise KeyError("cleanup")

    node = session.run(Worse, "on_configure", refuse_work)
    assert isinstance(node, Worse)
    node.trigger_configure()
    first, second, state = said(session).split("problem  ")[1:]
    assert "Camera.on_configure of /camera raised OSError: no camera 7" in first
    assert "Worse.on_error of /camera raised KeyError: 'cleanup'" in second
    assert "rclpy hides it and finalizes the node." in second
    assert "/camera is finalized" in state


def change(session: Session, number: int) -> object:
    request = ChangeState.Request()
    request.transition.id = number
    return session.call(ChangeState, "/camera/change_state", request).success


def test_a_transition_that_a_service_asks_for_is_seen_as_well(session: Session) -> None:
    session.run(Camera, "on_configure", refuse_work)
    assert change(session, 1) is False
    assert "raised OSError: no camera 7" in said(session)
    session.explains = True
    with pytest.raises(Exception, match=r"in vain for a picture\. .*raised OSError: no camera 7"):
        session.until(lambda: False, timeout=0, what="a picture")


def test_one_that_the_constructor_makes_is_seen_as_well(session: Session) -> None:
    class Eager(Camera):
        def __init__(self) -> None:
            super().__init__("on_configure", refuse_work)
            self.trigger_configure()

    session.run(Eager)
    assert "Camera.on_configure of /camera raised OSError: no camera 7" in said(session)


def test_a_callback_that_returns_nothing_leaves_the_node_half_way(session: Session) -> None:
    node = session.run(Camera, "on_configure", lambda: None)
    assert isinstance(node, Camera)
    with pytest.raises(AttributeError):
        node.trigger_configure()
    text = said(session)
    assert (
        "Camera.on_configure of /camera returned NoneType, which is no TransitionCallback" in text
    )
    assert "the node stays configuring." in text
    assert "-> End the method with `return TransitionCallbackReturn.SUCCESS`" in text


def test_a_transition_that_failed_is_told_until_it_succeeds(session: Session) -> None:
    node = session.run(Camera, "on_activate", lambda: TransitionCallbackReturn.FAILURE)
    assert isinstance(node, Camera)
    node.trigger_configure()
    node.trigger_activate()
    assert "Camera.on_activate of /camera returned FAILURE. It is inactive now." in said(session)
    node.wrong = ""
    node.trigger_activate()
    assert said(session) == ""
    assert session.failed_transitions == []


@pytest.mark.parametrize("by", ["method", "service"])
def test_a_transition_that_is_refused_is_told(session: Session, by: str) -> None:
    node = session.run(Camera)
    assert isinstance(node, Camera)
    if by == "method":
        with pytest.raises(RuntimeError, match="Transition is not registered"):
            node.trigger_activate()
    else:
        with pytest.raises(Exception, match="did not answer"):
            session.call(ChangeState, "/camera/change_state", _activate(), 0.5)
    assert (
        "/camera was asked to activate and cannot: it is unconfigured, from where it can configure "
        "or shutdown. It is unconfigured now."
    ) in said(session)


def _activate() -> ChangeState.Request:
    request = ChangeState.Request()
    request.transition.id = 3
    return request


def test_a_publisher_that_on_activate_forgets_is_named(session: Session) -> None:
    node = session.run(Camera, "on_activate", lambda: SUCCESS)
    assert isinstance(node, Camera)
    node.trigger_configure()
    node.trigger_activate()
    text = said(session)
    assert "/camera is active, but its publisher on /image is not and publishes nothing" in text
    assert "`return super().on_activate(state)`" in text


def test_a_timer_that_stays_cancelled_is_named(session: Session) -> None:
    class Ticking(Camera):
        def on_configure(self, state: LifecycleState) -> object:
            self.timer = self.create_timer(0.5, self.tick, autostart=False)
            return super().on_configure(state)

        def tick(self) -> None:
            pass

    node = session.run(Ticking)
    assert isinstance(node, Ticking)
    node.trigger_configure()
    node.trigger_activate()
    text = said(session)
    assert "/camera is active, but its timer of 0.5 s is cancelled: " in text
    assert "Ticking.tick is never called." in text
    node.timer.reset()
    assert said(session) == ""


def test_what_a_transition_raised_keeps_nothing_alive(session: Session) -> None:
    class Picture:
        pass

    kept = []

    def take() -> object:
        picture = Picture()
        kept.append(weakref.ref(picture))
        raise OSError(f"no place for {type(picture).__name__}")

    node = session.run(Camera, "on_configure", take)
    assert isinstance(node, Camera)
    node.trigger_configure()
    gc.collect()
    assert len(failed_transitions(node)) == 1
    assert [reference() for reference in kept] == [None]


OTHER_PROGRAM = """
import rclpy
from rclpy.lifecycle import LifecycleNode
from course import Session
session = Session(domain_id={domain})
node = session.run(LifecycleNode, "driver")
for verb in {verbs}:
    getattr(node, f"trigger_{{verb}}")()
print("ready", flush=True)
session.spin()
"""


@pytest.mark.parametrize(
    ("verbs", "state", "mend"),
    [
        ([], "/driver is unconfigured: what its on_configure() makes is not there yet", "id: 1"),
        (["configure"], "/driver is inactive: a managed node publishes nothing until", "id: 3"),
        (["shutdown"], "/driver is finalized: no transition leads out", "Start its program again"),
        (["configure", "activate"], "", ""),
    ],
)
def test_a_node_of_another_program_is_asked_for_its_state(
    session: Session,
    start_script: Callable[[str], subprocess.Popen[str]],
    verbs: list[str],
    state: str,
    mend: str,
) -> None:
    program = start_script(OTHER_PROGRAM.format(domain=session.domain_id, verbs=verbs))
    assert program.stdout is not None
    assert program.stdout.readline() == "ready\n"
    session.until(lambda: session.observer.count_services("/driver/get_state"), timeout=20)
    session.until(lambda: state in said(session) and bool(state) == bool(said(session)), 20)
    assert mend in said(session)
