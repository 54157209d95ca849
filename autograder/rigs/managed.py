"""Drives a lifecycle node through its states, over the services that every lifecycle node has.

Sources: the ROS 2 design article "Managed nodes", and the interfaces of ``lifecycle_msgs``.
"""

from __future__ import annotations

from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters

from autograder.exam import Failed
from autograder.rigs.camera import SETTLE, CameraRig
from course import WaitTimeout

TRANSITIONS = {
    "configure": (Transition.TRANSITION_CONFIGURE, "inactive"),
    "activate": (Transition.TRANSITION_ACTIVATE, "active"),
    "deactivate": (Transition.TRANSITION_DEACTIVATE, "inactive"),
    "cleanup": (Transition.TRANSITION_CLEANUP, "unconfigured"),
}
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

    def set(self, **values: str | float) -> bool:
        """Set parameters; return whether the node took them all."""
        parameters = [Parameter(name=name, value=_value(value)) for name, value in values.items()]
        request = SetParameters.Request(parameters=parameters)
        reply = self._call(SetParameters, "set_parameters", request)
        return all(result.successful for result in reply.results)

    def require(self, **values: str | float) -> None:
        """Set parameters that the node must take."""
        if not self.set(**values):
            shown = ", ".join(f"{name}={value!r}" for name, value in values.items())
            raise Failed(
                expected=f"The parameters {shown} can be set.", actual="The node refused them."
            )

    def state(self) -> str:
        """Return the label of the node's state."""
        return str(self._call(GetState, "get_state", GetState.Request()).current_state.label)

    def attempt(self, transition: str) -> str:
        """Ask for a transition; return the state that came of it."""
        number = TRANSITIONS[transition][0] if transition in TRANSITIONS else None
        if number is None:
            number = SHUTDOWNS[self.state()]
        request = ChangeState.Request(transition=Transition(id=number))
        self._call(ChangeState, "change_state", request)
        return self.state()

    def go(self, *transitions: str) -> None:
        """Make transitions that must all succeed."""
        for transition in transitions:
            goal = TRANSITIONS[transition][1] if transition in TRANSITIONS else "finalized"
            if (state := self.attempt(transition)) != goal:
                raise Failed(
                    expected=f"After “{transition}” your node is {goal}.",
                    actual=f"It is {state}{self._rig.raised()}.",
                )

    def _call(self, service: Any, name: str, request: Any) -> Any:
        try:
            reply = self._rig.session.call(service, f"{self._node}/{name}", request, SETTLE)
        except WaitTimeout:
            raise Failed(
                expected=f"Your node answers its service {self._node}/{name}.",
                actual=f"No answer came within {SETTLE:.0f} s{self._rig.raised()}. Each of your "
                "on_…() methods must return, and return a TransitionCallbackReturn.",
            ) from None
        return reply


def _value(value: str | float) -> ParameterValue:
    if isinstance(value, str):
        return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value)
    return ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
