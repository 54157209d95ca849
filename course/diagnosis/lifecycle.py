"""Managed nodes: one that is not active does nothing, and says so to nobody."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence

from lifecycle_msgs.srv import GetState
from rclpy.exceptions import InvalidHandle
from rclpy.lifecycle import LifecycleNodeMixin, LifecyclePublisher
from rclpy.node import Node

from course.diagnosis.graph import unoffered_names
from course.diagnosis.nodes import ANSWER_TIMEOUT_S, MOST_ASKED
from course.doctor.finding import HealthFinding, make_problem, make_warning
from course.graph import reader
from course.runtime.callbacks import transitions
from course.runtime.core_session import CoreSession

_GET_STATE = "/get_state"
_LEADS_ON = {"unconfigured": (1, "configure"), "inactive": (3, "activate")}
_MENDS = {
    "raised": "Mend that line and run the cell again.",
    "returned": "Return TransitionCallbackReturn.SUCCESS, unless that is meant.",
    "stuck": "End the method with `return TransitionCallbackReturn.SUCCESS`; run the cell again.",
    "refused": "Make the transition that is missing first.",
}  # fmt: skip


def check_own_nodes(session: CoreSession) -> Iterator[HealthFinding]:
    """Find what keeps managed nodes of the session from working."""
    for name, node in session.nodes.items():
        if not isinstance(node, LifecycleNodeMixin):
            continue
        with contextlib.suppress(InvalidHandle):  # destroyed just now
            told = transitions.failed_transitions(node)
            for failure in told:
                made = make_warning if failure.kind in ("returned", "refused") else make_problem
                state = f" It is {transitions.state_of(node)} now."
                yield made("lifecycle", failure.what + state, _MENDS[failure.kind])
            yield from _check_state(session, name, node)


def check_other_nodes(session: CoreSession) -> Iterator[HealthFinding]:
    """Find managed nodes of other programs that are not active: all are asked at once."""
    services = [
        name
        for name, types in session.observer.get_service_names_and_types()
        if name.endswith(_GET_STATE) and "lifecycle_msgs/srv/GetState" in types
    ]
    asked = [name for name in services if name.removesuffix(_GET_STATE) not in session.nodes]
    for service, answer in session.answers(GetState, asked[:MOST_ASKED], ANSWER_TIMEOUT_S).items():
        name, state = service.removesuffix(_GET_STATE), answer.current_state.label
        if state == "unconfigured":
            yield make_warning(
                "lifecycle", _describe_unconfigured(session, name), _by_service(name, state)
            )
        elif state == "inactive":
            yield make_warning(
                "lifecycle", f"{name} is inactive: a managed node publishes nothing until it is "
                "active.", _by_service(name, state),
            )  # fmt: skip
        elif state == "finalized":
            yield make_warning(
                "lifecycle", f"{name} is finalized: no transition leads out of it.",
                "Start its program again.",
            )  # fmt: skip


def _check_state(session: CoreSession, name: str, node: Node) -> Iterator[HealthFinding]:
    assert isinstance(node, LifecycleNodeMixin)
    state = transitions.state_of(node)
    if state == "unconfigured":
        yield make_warning(
            "lifecycle", _describe_unconfigured(session, name),
            "Configure and activate it: node.trigger_configure(), then node.trigger_activate().",
        )  # fmt: skip
    elif state == "inactive":
        topics = _topic_names(node)
        what = f"what it publishes on {topics} goes nowhere" if topics else "it publishes nothing"
        yield make_warning(
            "lifecycle", f"{name} is inactive: {what}, without a word, and what its on_activate() "
            "starts does not run.", "Activate it: node.trigger_activate().",
        )  # fmt: skip
    elif state == "active":
        yield from _check_active(name, node)
    elif state == "finalized":
        yield make_problem(
            "lifecycle", f"{name} is finalized: no transition leads out of it.",
            "Run its cell again, which makes a new node.",
        )  # fmt: skip


def _check_active(name: str, node: Node) -> Iterator[HealthFinding]:
    """Find what is off in a node that is active."""
    assert isinstance(node, LifecycleNodeMixin)
    off = [one for one in node._managed_entities if getattr(one, "is_activated", True) is False]
    if off:
        topics = _topic_names(node, only=off)
        what = (
            f"its publisher on {topics} is not and publishes" if topics else "a part of it is not"
        )
        yield make_problem(
            "lifecycle", f"{name} is active, but {what}{' nothing' if topics else ''}: its "
            "on_activate() does not call super().on_activate(state), or that part was made later.",
            "End on_activate() with `return super().on_activate(state)`, and make publishers in "
            "on_configure().",
        )  # fmt: skip
    for timer in node.timers:
        if timer.is_canceled():
            callback = getattr(timer.callback, "__qualname__", "its callback")
            period = f"{timer.timer_period_ns / 1e9:g} s"
            yield make_warning(
                "lifecycle", f"{name} is active, but its timer of {period} is cancelled: "
                f"{callback.replace('<locals>.', '')} is never called.",
                "Call timer.reset() in on_activate(), if cancel() in on_deactivate() stopped it.",
            )  # fmt: skip


def _topic_names(node: Node, only: Sequence[object] | None = None) -> str:
    names = [
        publisher.topic_name
        for publisher in node.publishers
        if isinstance(publisher, LifecyclePublisher) and (only is None or publisher in only)
    ]
    return ", ".join(sorted(names))


def _describe_unconfigured(session: CoreSession, name: str) -> str:
    graph = reader.read_graph(session.observer, own=list(session.nodes.values()))
    missed = unoffered_names(graph, set(session.nodes).difference(session.nodes_apart()))
    may_be = f", {', '.join(missed)} perhaps, which nobody offers" if missed else ""
    return f"{name} is unconfigured: what its on_configure() makes is not there yet{may_be}."


def _by_service(name: str, state: str) -> str:
    number, verb = _LEADS_ON[state]
    return (
        f"{verb.capitalize()} it: %ros service call {name}/change_state "
        f'lifecycle_msgs/srv/ChangeState "{{transition: {{id: {number}}}}}".'
    )
