"""Drives a lifecycle node through its states, over the services that every lifecycle node has.

Sources: the ROS 2 design article "Managed nodes", and the interfaces of ``lifecycle_msgs``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python

from autograder.examination.exam import Failed
from autograder.observe.lifecycle.observer import RESEND_S, Observer
from autograder.observe.nouns import Parameter
from autograder.observe.phrases import as_phrase

TRANSITIONS = {
    "configure": (Transition.TRANSITION_CONFIGURE, "inactive"),
    "activate": (Transition.TRANSITION_ACTIVATE, "active"),
    "deactivate": (Transition.TRANSITION_DEACTIVATE, "inactive"),
    "cleanup": (Transition.TRANSITION_CLEANUP, "unconfigured"),
}
"""The number of each transition, and the state that a node is in when it has succeeded."""
SHUTDOWNS = {
    "unconfigured": Transition.TRANSITION_UNCONFIGURED_SHUTDOWN,
    "inactive": Transition.TRANSITION_INACTIVE_SHUTDOWN,
    "active": Transition.TRANSITION_ACTIVE_SHUTDOWN,
}
"""The number of a shutdown, by the state that a node is in."""
STATES = (*SHUTDOWNS, "finalized")
KINDS = {str: "a string", float: "a double", int: "an integer", bool: "a bool"}
CHANGE_STATE = "/change_state"
"""What is added to the name of a lifecycle node for that of a service which each has."""


class LifecycleManager:
    """Drives one lifecycle node of the student's, as a robot's lifecycle manager does.

    Example::

        manager = LifecycleManager(observer, "/camera", "ManagedCamera")
        manager.require_parameters(rate=20.0)
        manager.make_transitions("configure", "activate")
        assert manager.attempt_transition("shutdown") == "finalized"
    """

    def __init__(self, observer: Observer, node: str, class_name: str) -> None:
        """Drive ``node``, its full name; it is an object of the notebook's class ``class_name``."""
        self._observer, self._node, self._class_name = observer, node, class_name
        self._configured = ""

    # Its parameters.

    def set_parameters(self, **values: str | float) -> bool:
        """Set parameters; return whether the node took them all."""
        return not self._refused_parameters(values)

    def require_parameters(self, **values: str | float) -> None:
        """Set parameters that the node must take.

        Raises:
            Failed: it refused one.
        """
        if refused := self._refused_parameters(values):
            shown = ", ".join(f"{name}={value!r}" for name, value in values.items())
            raise Failed(
                expected=f"The parameters {shown} can be set.",
                actual=f"The node refused {as_phrase(refused)}.",
            )

    def _refused_parameters(self, values: dict[str, str | float]) -> list[str]:
        """Set parameters; return what the node refused, and why."""
        numbers = [f"{n}={v:g}" for n, v in values.items() if not isinstance(v, str)]
        self._configured = f" with {as_phrase(numbers)}" if numbers else ""
        messages = [RosParameter(name, value=v).to_parameter_msg() for name, v in values.items()]
        request = SetParameters.Request(parameters=messages)
        results = self._ask(SetParameters, "set_parameters", request).results
        if len(results) != len(messages):
            raise Failed(
                expected=f"A request to set {len(messages)} parameters gets a result for each.",
                actual=f"{self._node}/set_parameters gave {len(results)}.",
            )
        return [
            f"{name}={value!r}" + (f" ({result.reason.rstrip('.')})" if result.reason else "")
            for (name, value), result in zip(values.items(), results, strict=True)
            if not result.successful
        ]

    def require_defaults(self, *parameters: Parameter) -> None:
        """Require that parameters, which nobody has set yet, have their defaults and types.

        Raises:
            Failed: one has not.
        """
        request = GetParameters.Request(names=[parameter.name for parameter in parameters])
        values = self._ask(GetParameters, "get_parameters", request).values
        found = [parameter_value_to_python(value) for value in values]
        found += [None] * (len(parameters) - len(found))
        pairs = list(zip(parameters, found, strict=False))
        if any(not _is_same(value, parameter.default) for parameter, value in pairs):
            wanted = [
                f"{p} ({KINDS[type(p.default)]}, by default {p.default!r})" for p in parameters
            ]
            shown = [f"{parameter} was {_shown(value)}" for parameter, value in pairs]
            raise Failed(
                expected=f"Your node has the parameters {as_phrase(wanted)}.",
                actual=f"When it had just been made, {as_phrase(shown)}.",
            )

    # Its states.

    def get_state(self) -> str:
        """Return the label of the node's state."""
        return str(self._ask(GetState, "get_state", GetState.Request()).current_state.label)

    def attempt_transition(self, transition: str) -> str:
        """Ask for a transition; return the state that came of it.

        Args:
            transition: a key of `TRANSITIONS`, or "shutdown", from whichever state it is in.

        Raises:
            Failed: the node does not come to a state.
        """
        observer = self._observer
        number = (
            TRANSITIONS[transition][0] if transition in TRANSITIONS else self._shutdown_number()
        )
        client = observer.client_of(ChangeState, f"{self._node}{CHANGE_STATE}")
        observer.wait(client.service_is_ready)
        reply = client.call_async(ChangeState.Request(transition=Transition(id=number)))
        # The state says what came of it, even if the response is lost.
        observer.wait(reply.done, RESEND_S)
        state = ""

        def has_state() -> bool:
            nonlocal state
            state = self.get_state()
            return state in STATES

        if not observer.wait(has_state):
            raise Failed(
                expected=f"A “{transition}” comes to its end.",
                actual=f"Your node is stuck in “{state}”{observer.error_note()}. Each on_…() "
                "method must return, and return a TransitionCallbackReturn.",
            )
        return state

    def make_transitions(self, *transitions: str) -> None:
        """Make transitions that must all succeed.

        Raises:
            Failed: the node is in another state after one.
        """
        for transition in transitions:
            goal = TRANSITIONS[transition][1] if transition in TRANSITIONS else "finalized"
            if (state := self.attempt_transition(transition)) != goal:
                how = self._configured if transition == "configure" else ""
                # rclpy says nothing: it catches what on_…() raises.
                raise Failed(
                    expected=f"After “{transition}”{how} your node is {goal}.",
                    actual=f"It is {state}{self._observer.error_note()}. Your on_{transition}() "
                    "did not return SUCCESS, or it raised. rclpy keeps such an exception to "
                    "itself. To see it, call your methods one after the other in a cell of your "
                    f"own: `node = course.run({self._class_name})`, then "
                    "`node.on_configure(None)` …",
                )

    def _shutdown_number(self) -> int:
        """Return the number of the shutdown from the state that the node says it is in."""
        if (state := self.get_state()) not in SHUTDOWNS:
            raise Failed(
                expected=f"Before it is shut down your node is {' or '.join(SHUTDOWNS)}.",
                actual=f"It says that its state is “{state}”.",
            )
        return int(SHUTDOWNS[state])

    def _ask(self, service: Any, name: str, request: Any) -> Any:
        reply = self._observer.ask(service, f"{self._node}/{name}", request)
        if reply is None:
            raise Failed(
                expected=f"Your node answers its service {self._node}/{name}.",
                actual=f"No answer came{self._observer.error_note()}.",
            )
        return reply


def find_lifecycle_node(
    observer: Observer, node: str, list_nodes: Callable[[], Iterable[str]]
) -> str:
    """Wait for a lifecycle node, and return its full name; empty if it is not known which it is.

    Of one that was destroyed rclpy 7.1 leaves the services there until Python collects it: so it
    must be a node that is there.

    Args:
        observer: someone in its network.
        node: the name that it is expected to have; else it is the only lifecycle node.
        list_nodes: returns the names of the nodes that are there.
    """

    def find() -> list[str]:
        services = {name for name, _ in observer.node.get_service_names_and_types()}
        return [name for name in {*list_nodes()} if f"{name}{CHANGE_STATE}" in services]

    observer.wait(lambda: node in find())
    found = find()
    if node in found:
        return node
    return found[0] if len(found) == 1 else ""


def _is_same(present: Any, value: Any) -> bool:
    return type(present) is type(value) and bool(present == value)


def _shown(value: Any) -> str:
    if value is None:
        return "not there"
    return f"the whole number {value}" if type(value) is int else repr(value)
