"""What can be seen of nodes themselves: stuck, stolen, paused, never spun, or silent."""

from __future__ import annotations

import gc
from collections.abc import Iterator

from rcl_interfaces.srv import ListParameters
from rclpy.node import Node

from course.doctor.finding import HealthFinding, make_problem, make_warning
from course.graph import reader
from course.runtime.core_session import CoreSession
from course.runtime.ros_names import node_name

ANSWER_TIMEOUT_S = 1.0
"""Seconds within which a node answers to a parameter service, unless it is stuck."""

MOST_ASKED = 8


def find_stuck(session: CoreSession) -> Iterator[HealthFinding]:
    """Find callbacks that do not return, deadlocks among them."""
    for blocked in session.blocked_callbacks():
        held = " No other callback can run meanwhile." if blocked.holds_up else ""
        reason = f" {blocked.reason}" if blocked.reason else ""
        message = f"{blocked.what} has been running for {blocked.seconds:.0f} s.{reason}{held}"
        yield make_problem("callback", message, blocked.advice)


def find_stolen(session: CoreSession) -> Iterator[HealthFinding]:
    """Find nodes that another executor took away, and take back those that it has dropped."""
    told = len(session.notices)
    session.take_back_stolen_nodes()
    for notice in session.notices[told:]:
        yield make_problem("executor", notice, "Leave rclpy.spin_once and its relatives out.")


def find_moved(session: CoreSession) -> Iterator[HealthFinding]:
    """Find nodes that an executor of the learner's own holds."""
    for name in session.moved_nodes():
        yield make_problem(
            "executor", f"{name} is in an executor of your own, so its callbacks run only while "
            "that one spins.", "executor.remove_node(node) gives it back to the session.",
        )  # fmt: skip


def find_paused(session: CoreSession) -> Iterator[HealthFinding]:
    """Find nodes that were paused and forgotten."""
    for name in session.paused_nodes():
        yield make_warning(
            "pause", f"{name} is paused: its callbacks do not run.", "course.resume(…)."
        )


def find_unspun(session: CoreSession) -> Iterator[HealthFinding]:
    """Find nodes of this process that were made and never given to an executor."""
    known = [*session.nodes.values(), *(remains.node for remains in session.half_made())]
    own = {id(node) for node in known}
    alive = set(reader.read_graph(session.observer).nodes)
    for thing in gc.get_objects():
        # By its own type: isinstance asks what a weak proxy stands for, which may be gone.
        if not issubclass(type(thing), Node) or id(thing) in own or thing is session.observer:
            continue
        name = _safe_name(thing)
        if thing.executor is None and thing.context is session.context and name in alive:
            yield make_problem(
                "executor", f"{name} was made, and nobody spins it: none of its callbacks will "
                "ever run.", "Run it with course.run(YourNode) in place of making it yourself.",
            )  # fmt: skip


def half_made(session: CoreSession) -> Iterator[HealthFinding]:
    """Find what constructors that raised have left behind."""
    for remains in session.half_made():
        yield make_problem(
            "constructor", f"{remains} Nobody calls destroy_node() of a node that was never made.",
            "Let the constructor give back what it has made before it raises. Running the cell "
            "again replaces the node, and course.stop() takes it away.",
        )  # fmt: skip


def find_silent(session: CoreSession) -> Iterator[HealthFinding]:
    """Find nodes of other processes that are on the graph and do not answer: all asked at once."""
    services = dict(session.observer.get_service_names_and_types())
    known = {*session.nodes, *(remains.name for remains in session.half_made())}
    others = {
        f"{name}/list_parameters": name
        for name in reader.read_graph(session.observer).nodes
        if name not in known and f"{name}/list_parameters" in services
    }
    asked = list(others)[:MOST_ASKED]
    answered = session.answers(ListParameters, asked, ANSWER_TIMEOUT_S)
    for service in (service for service in asked if service not in answered):
        yield make_problem(
            "node", f"{others[service]} is on the graph, but did not answer within "
            f"{ANSWER_TIMEOUT_S:g} s: its services are dead. Its program hangs, is stopped, or "
            "does not spin it; or it has died, and DDS has not noticed yet (that takes up to 20 "
            "s).",
            "Look at the program that runs it, or restart it.",
        )  # fmt: skip


def _safe_name(node: Node) -> str:
    try:
        return node_name(node)
    except Exception:  # noqa: BLE001 - destroyed, or half made: rclpy has no one error for it
        return ""
