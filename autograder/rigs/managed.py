"""Drives a lifecycle node through its states, over the services that every lifecycle node has.

Sources: the ROS 2 design article "Managed nodes", and the interfaces of ``lifecycle_msgs``.
"""

from __future__ import annotations

import time
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters

from autograder.exam import Failed
from autograder.rigs.camera import IMAGE, RESEND, SETTLE, CameraRig, phrase
from autograder.rigs.camera_duties import (
    let_arrive,
    require_closed,
    require_open,
    require_picture,
    require_rate,
)
from autograder.rigs.lives import require_flat
from course.runtime.waiting import Deadline

TRANSITIONS = {
    "configure": (Transition.TRANSITION_CONFIGURE, "inactive"),
    "activate": (Transition.TRANSITION_ACTIVATE, "active"),
    "deactivate": (Transition.TRANSITION_DEACTIVATE, "inactive"),
    "cleanup": (Transition.TRANSITION_CLEANUP, "unconfigured"),
}
ROUNDS = 10
EXPOSURE = 0.3  # s of a slow camera
EXPOSURES = 3  # at most, that are waited for on a busy machine, where one may be over too soon
STATES = ("unconfigured", "inactive", "active", "finalized")
SHUTDOWNS = {
    "unconfigured": Transition.TRANSITION_UNCONFIGURED_SHUTDOWN,
    "inactive": Transition.TRANSITION_INACTIVE_SHUTDOWN,
    "active": Transition.TRANSITION_ACTIVE_SHUTDOWN,
}


class Managed:
    """One lifecycle node of the subject, by its fully qualified name."""

    def __init__(self, rig: CameraRig, node: str) -> None:
        """Drive ``node``; its services are looked for when they are needed."""
        self._rig = rig
        self._node = node
        self._rate = ""

    def set(self, **values: str | float) -> bool:
        """Set parameters; return whether the node took them all."""
        return not self._refused(values)

    def _refused(self, values: dict[str, str | float]) -> list[str]:
        """Set parameters; return what the node refused, and why."""
        self._rate = f" with a rate of {values['rate']:g} Hz" if "rate" in values else ""
        parameters = [Parameter(name=name, value=_value(value)) for name, value in values.items()]
        request = SetParameters.Request(parameters=parameters)
        reply = self._ask(SetParameters, "set_parameters", request)
        return [
            f"{name}={value!r}" + (f" ({result.reason.rstrip('.')})" if result.reason else "")
            for (name, value), result in zip(values.items(), reply.results, strict=True)
            if not result.successful
        ]

    def require(self, **values: str | float) -> None:
        """Set parameters that the node must take."""
        if refused := self._refused(values):
            shown = ", ".join(f"{name}={value!r}" for name, value in values.items())
            raise Failed(
                expected=f"The parameters {shown} can be set.",
                actual=f"The node refused {phrase(refused)}.",
            )

    def state(self) -> str:
        """Return the label of the node's state."""
        return str(self._ask(GetState, "get_state", GetState.Request()).current_state.label)

    def attempt(self, transition: str) -> str:
        """Ask for a transition; return the state that came of it."""
        if transition in TRANSITIONS:
            number = TRANSITIONS[transition][0]
        else:
            number = SHUTDOWNS[self.state()]
        client = self._rig.client(ChangeState, f"{self._node}/change_state")
        self._rig.wait(client.service_is_ready)
        reply = client.call_async(ChangeState.Request(transition=Transition(id=number)))
        # The state says what came of it, even if the response is lost.
        self._rig.wait(reply.done, RESEND)
        states: list[str] = []
        if not self._rig.wait(lambda: states.append(self.state()) or states[-1] in STATES):  # type: ignore[func-returns-value]
            raise Failed(
                expected=f"A “{transition}” comes to its end.",
                actual=f"Your node is stuck in “{states[-1]}”{self._rig.raised()}. Each on_…() "
                "method must return, and return a TransitionCallbackReturn.",
            )
        return states[-1]

    def go(self, *transitions: str) -> None:
        """Make transitions that must all succeed."""
        for transition in transitions:
            goal = TRANSITIONS[transition][1] if transition in TRANSITIONS else "finalized"
            if (state := self.attempt(transition)) != goal:
                how = self._rate if transition == "configure" else ""
                raise Failed(
                    expected=f"After “{transition}”{how} your node is {goal}.",
                    actual=f"It is {state}{self._rig.raised()}. {self._hint(transition)}",
                )

    @staticmethod
    def _hint(transition: str) -> str:
        """Return why rclpy says nothing, and how to see it: it catches what on_…() raises."""
        return (
            f"Your on_{transition}() did not return SUCCESS, or it raised. rclpy keeps such an "
            "exception to itself: call the method in a cell of your own to see it."
        )

    def _ask(self, service: Any, name: str, request: Any) -> Any:
        reply = self._rig.ask(service, f"{self._node}/{name}", request)
        if reply is None:
            raise Failed(
                expected=f"Your node answers its service {self._node}/{name}.",
                actual=f"No answer came within {SETTLE:.0f} s{self._rig.raised()}.",
            )
        return reply


def _value(value: str | float) -> ParameterValue:
    if isinstance(value, str):
        return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value)
    return ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)


def require_still(rig: CameraRig, device: str, transition: str) -> None:
    """Fail if the camera is streaming or is asked for pictures while time passes."""
    if not rig.wait(lambda: not rig.streams(device)):
        raise Failed(
            expected=f"After “{transition}” the camera's stream is stopped.",
            actual="The stream went on: nobody called stop().",
        )
    before = sum(rig.cameras(device))
    rig.advance(1.0)
    asked = sum(rig.cameras(device)) - before
    if asked:
        raise Failed(
            expected="An inactive node asks its camera for no picture: it has no timer.",
            actual=f"In one second after “{transition}” it asked {asked} times.",
        )


def require_silent_at_once(rig: CameraRig, node: Managed, device: str) -> None:
    """Fail if a picture that was being exposed at “deactivate” is published after it.

    By the times that DDS gives: what was published before, and arrives after, is in order.
    """
    for _ in range(EXPOSURES):
        node.go("activate")
        asked = sum(rig.cameras(device))
        rig.see(device, lambda n=asked: sum(rig.cameras(device)) > n)  # type: ignore[misc]
        under_way = Deadline(EXPOSURE)
        node.go("deactivate")
        in_time, inactive = under_way.left, time.time_ns()
        let_arrive(rig, device)
        if any(picture.published > inactive for picture in rig.pictures(device)[-1:]):
            raise Failed(
                expected="When “deactivate” has succeeded the node sends no picture, also not the "
                "one that its camera was just taking.",
                actual="It sent one that a slow camera had ready when the node was inactive.",
            )
        if in_time:
            return


def require_still_held(rig: CameraRig, device: str) -> None:
    """Fail unless a node that was deactivated has kept its camera open, and its publisher.

    A participant's endpoints are told in order: a publisher that went with “deactivate” is not
    known here any more when a mark that is made now is.
    """
    rig.catch_up()
    gone = [] if rig.cameras(device) else ["its camera was closed"]
    gone += [] if rig.publishers() else [f"its publisher on {IMAGE} was gone"]
    if gone:
        raise Failed(
            expected="After “deactivate” your node holds its open camera and its publisher until "
            "“cleanup”: inactive is one state, whichever way it came there.",
            actual=f"While it was inactive again {phrase(gone)}.",
        )


def require_fresh(rig: CameraRig, device: str, sent: int, asked: int) -> None:
    """Fail unless pictures come again, and all but the first ``sent`` are new ones.

    Those that the camera took before it was ``asked`` so often are old.
    """
    # Pictures of one publisher arrive in order: what was sent earlier is here by then.
    if not rig.see(device, lambda: rig.pictures(device)[-1].number >= asked):
        raise Failed(
            expected="After a second “activate” pictures come again.",
            actual=f"None came{rig.raised()}.",
        )
    if old := [p for p in rig.pictures(device)[sent:] if p.number < asked]:
        raise Failed(
            expected="An inactive node publishes nothing.",
            actual=f"It published {len(old)} pictures between deactivate and activate.",
        )


def require_refused(rig: CameraRig, node: Managed, what: str, rate: float, kind: str) -> None:
    """Fail unless the node stays unconfigured, and closes the camera of that ``kind``."""
    device = rig.device(kind)
    if not node.set(device=device, rate=rate):
        return  # refused even earlier: a parameter callback is as good
    if (state := node.attempt("configure")) != "unconfigured":
        raise Failed(
            expected=f"Configured with {what}, your node stays unconfigured.",
            actual=f"It is {state}.",
        )
    require_closed(rig, device, f"After a “configure” with {what}")


def require_nothing_held(rig: CameraRig, device: str, when: str) -> None:
    """Fail if a managed node holds a camera or a publisher."""
    require_closed(rig, device, when)
    if not rig.wait(lambda: not rig.publishers()):
        raise Failed(
            expected=f"{when} there is no publisher on {IMAGE}.",
            actual=f"{SETTLE:.0f} s later there were {rig.publishers()}.",
        )


def require_one_publisher(rig: CameraRig) -> None:
    """Fail unless a node that is configured has exactly one publisher on the image topic."""
    if not rig.wait(lambda: rig.publishers() == 1):
        raise Failed(
            expected=f"A configured node has one publisher on {IMAGE}.",
            actual=f"It had {rig.publishers()}.",
        )


def require_no_publisher_yet(rig: CameraRig) -> None:
    """Fail if a node that has never been configured has a publisher on the image topic."""
    rig.catch_up()
    if rig.publishers():
        raise Failed(
            expected=f"Before the first “configure” there is no publisher on {IMAGE}.",
            actual="There was one: your node makes it in its constructor.",
        )


def require_configuration(
    rig: CameraRig, node: Managed, rate: float, *, seconds: int = 1, later: float = 0.0
) -> None:
    """Fail unless a node that is configured with ``rate`` works by it, and gives everything back.

    ``later`` is a rate that is set once it is configured: good for the next time, or refused.
    """
    device = rig.device()
    node.require(device=device, rate=rate)
    node.go("configure")
    require_open(rig, device)
    require_one_publisher(rig)
    when = "" if seconds == 1 else f" with a rate of {rate:g} Hz"
    if later and node.set(rate=later):
        when = f": {rate:g} Hz was set at “configure”, the {later:g} Hz set since are for the next"
    node.go("activate")
    require_picture(rig, device)
    require_rate(rig, device, rate, when, seconds)
    node.go("deactivate", "cleanup")
    require_nothing_held(rig, device, "After “cleanup”")


def require_flat_rounds(rig: CameraRig, node: Managed) -> None:
    """Fail if rounds through the states leave threads or files in the process."""
    device = rig.device()
    node.require(device=device, rate=10.0)
    before = rig.process.usage()
    for _ in range(ROUNDS):
        node.go("configure", "activate")
        rig.advance(0.3)
        node.go("deactivate", "cleanup")
    expected = f"{ROUNDS} rounds from “configure” to “cleanup” leave nothing behind,"
    require_flat(rig, before, ROUNDS, expected, "rounds")


def require_off_graph(rig: CameraRig, node: str, when: str) -> None:
    """Fail if the ``node`` itself is on the graph."""
    name = f"the node {node}"
    if not rig.wait(lambda: name not in rig.endpoints(node)):
        raise Failed(
            expected=f"{when} the node is off the graph.",
            actual=f"{SETTLE:.0f} s later {name} was still there: only the inherited "
            "destroy_node() takes it down.",
        )
