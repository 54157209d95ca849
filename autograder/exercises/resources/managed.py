"""Drives a lifecycle node through its states, over the services that every lifecycle node has.

Sources: the ROS 2 design article "Managed nodes", and the interfaces of ``lifecycle_msgs``.
"""

from __future__ import annotations

from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters

from autograder.examination.exam import Failed
from autograder.exercises.resources.observer import RESEND, Observer
from autograder.observe.phrases import as_phrase

TRANSITIONS = {
    "configure": (Transition.TRANSITION_CONFIGURE, "inactive"),
    "activate": (Transition.TRANSITION_ACTIVATE, "active"),
    "deactivate": (Transition.TRANSITION_DEACTIVATE, "inactive"),
    "cleanup": (Transition.TRANSITION_CLEANUP, "unconfigured"),
}
STATES = ("unconfigured", "inactive", "active", "finalized")
SHUTDOWNS = {
    "unconfigured": Transition.TRANSITION_UNCONFIGURED_SHUTDOWN,
    "inactive": Transition.TRANSITION_INACTIVE_SHUTDOWN,
    "active": Transition.TRANSITION_ACTIVE_SHUTDOWN,
}


class Managed:
    """One lifecycle node of the subject, by its fully qualified name."""

    def __init__(self, rig: Observer, node: str) -> None:
        """Drive ``node``; its services are looked for when they are needed."""
        self._rig = rig
        self._node = node
        self._rate = ""

    def set_parameters(self, **values: str | float) -> bool:
        """Set parameters; return whether the node took them all."""
        return not self._refused_parameters(values)

    def _refused_parameters(self, values: dict[str, str | float]) -> list[str]:
        """Set parameters; return what the node refused, and why."""
        self._rate = f" with a rate of {values['rate']:g} Hz" if "rate" in values else ""
        parameters = [
            Parameter(name=name, value=_parameter_value(value)) for name, value in values.items()
        ]
        request = SetParameters.Request(parameters=parameters)
        reply = self._ask_service(SetParameters, "set_parameters", request)
        if len(reply.results) != len(parameters):
            raise Failed(
                expected=f"A request to set {len(parameters)} parameters gets a result for each.",
                actual=f"{self._node}/set_parameters gave {len(reply.results)}.",
            )
        return [
            f"{name}={value!r}" + (f" ({result.reason.rstrip('.')})" if result.reason else "")
            for (name, value), result in zip(values.items(), reply.results, strict=True)
            if not result.successful
        ]

    def require_parameters(self, **values: str | float) -> None:
        """Set parameters that the node must take."""
        if refused := self._refused_parameters(values):
            shown = ", ".join(f"{name}={value!r}" for name, value in values.items())
            raise Failed(
                expected=f"The parameters {shown} can be set.",
                actual=f"The node refused {as_phrase(refused)}.",
            )

    def require_defaults(self) -> None:
        """Fail unless the parameters have their defaults; nobody has set any yet."""
        request = GetParameters.Request(names=["device", "rate"])
        values = list(self._ask_service(GetParameters, "get_parameters", request).values)
        device, rate = (*values, ParameterValue(), ParameterValue())[:2]
        text, double = ParameterType.PARAMETER_STRING, ParameterType.PARAMETER_DOUBLE
        if (device.type, device.string_value, rate.type, rate.double_value) != (
            text, "front", double, 10.0,
        ):  # fmt: skip
            raise Failed(
                expected="Your node has the parameters device (a string, by default 'front') and "
                "rate (a double, by default 10.0).",
                actual=f"When it had just been made, device was {_show_value(device)} and rate was "
                f"{_show_value(rate)}.",
            )

    def get_state(self) -> str:
        """Return the label of the node's state."""
        return str(self._ask_service(GetState, "get_state", GetState.Request()).current_state.label)

    def attempt_transition(self, transition: str) -> str:
        """Ask for a transition; return the state that came of it."""
        number = (
            TRANSITIONS[transition][0] if transition in TRANSITIONS else self._shutdown_number()
        )
        client = self._rig.get_client(ChangeState, f"{self._node}/change_state")
        self._rig.wait(client.service_is_ready)
        reply = client.call_async(ChangeState.Request(transition=Transition(id=number)))
        # The state says what came of it, even if the response is lost.
        self._rig.wait(reply.done, RESEND)
        states: list[str] = []
        if not self._rig.wait(lambda: states.append(self.get_state()) or states[-1] in STATES):  # type: ignore[func-returns-value]
            raise Failed(
                expected=f"A “{transition}” comes to its end.",
                actual=f"Your node is stuck in “{states[-1]}”{self._rig.error_note()}. Each on_…() "
                "method must return, and return a TransitionCallbackReturn.",
            )
        return states[-1]

    def _shutdown_number(self) -> int:
        """Return the number of the shutdown from the state that the node says it is in."""
        state = self.get_state()
        if state not in SHUTDOWNS:
            raise Failed(
                expected=f"Before it is shut down your node is {' or '.join(SHUTDOWNS)}.",
                actual=f"It says that its state is “{state}”.",
            )
        return int(SHUTDOWNS[state])

    def make_transitions(self, *transitions: str) -> None:
        """Make transitions that must all succeed."""
        for transition in transitions:
            goal = TRANSITIONS[transition][1] if transition in TRANSITIONS else "finalized"
            if (state := self.attempt_transition(transition)) != goal:
                how = self._rate if transition == "configure" else ""
                raise Failed(
                    expected=f"After “{transition}”{how} your node is {goal}.",
                    actual=f"It is {state}{self._rig.error_note()}. "
                    f"{self._transition_hint(transition)}",
                )

    @staticmethod
    def _transition_hint(transition: str) -> str:
        """Return why rclpy says nothing, and how to see it: it catches what on_…() raises."""
        return (
            f"Your on_{transition}() did not return SUCCESS, or it raised. rclpy keeps such an "
            "exception to itself. To see it, call your methods one after the other in a cell of "
            "your own: `node = course.run(ManagedCamera)`, then `node.on_configure(None)` …"
        )

    def _ask_service(self, service: Any, name: str, request: Any) -> Any:
        reply = self._rig.ask(service, f"{self._node}/{name}", request)
        if reply is None:
            raise Failed(
                expected=f"Your node answers its service {self._node}/{name}.",
                actual=f"No answer came{self._rig.error_note()}.",
            )
        return reply


def _parameter_value(value: str | float) -> ParameterValue:
    if isinstance(value, str):
        return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value)
    return ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)


def _show_value(value: ParameterValue) -> str:
    """Return a parameter's value for a reader."""
    kinds = {
        ParameterType.PARAMETER_NOT_SET: "not there",
        ParameterType.PARAMETER_STRING: repr(value.string_value),
        ParameterType.PARAMETER_DOUBLE: repr(value.double_value),
        ParameterType.PARAMETER_INTEGER: f"the whole number {value.integer_value}",
    }
    return kinds.get(value.type, "of another type")
