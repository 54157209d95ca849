"""Domains that differ: what is missed here may be next door, where DDS never looks."""

from __future__ import annotations

import os
from collections.abc import Iterator

from course.diagnosis.graph import unoffered_names
from course.doctor.finding import HealthFinding, make_problem, make_warning
from course.graph import reader
from course.runtime.context import close_order
from course.runtime.core_session import CoreSession
from course.runtime.domains import domain_discovery, port_bases
from course.runtime.requests.actions import SEND_GOAL


def on_another_domain(session: CoreSession) -> Iterator[HealthFinding]:
    """Find sessions of this process that cannot hear each other, and a domain set in vain."""
    others = [
        other
        for other in close_order.known_sessions()
        if isinstance(other, CoreSession) and not other.closed and other.nodes
    ]
    for other in others:
        if other.domain_id != session.domain_id:
            yield make_warning(
                "domain", f"This session is on domain {session.domain_id}; another one of this "
                f"kernel, with {', '.join(other.nodes)}, is on {other.domain_id}, and DDS domains "
                "never hear each other.",
                f"Open one of them with course.Session(domain_id={session.domain_id}).",
            )  # fmt: skip
    asked = os.environ.get("ROS_DOMAIN_ID", "")
    if asked and asked != str(session.domain_id):
        yield make_warning(
            "domain", f"ROS_DOMAIN_ID is {asked}, but a session leases a domain of its own: this "
            f"one is on {session.domain_id}, so it does not hear nodes on {asked}.",
            f"Join that domain with course.session(domain_id={asked}).",
        )  # fmt: skip


def next_door(session: CoreSession, sought: str = "") -> Iterator[HealthFinding]:
    """Find what nobody offers here in a session of another notebook on this machine.

    Args:
        session: whose nodes miss something.
        sought: a topic or service that the session itself has waited for, or "".
    """
    own = session.nodes
    graph = reader.read_graph(session.observer, own=list(own.values()))
    learners = set(own).difference(session.nodes_apart())
    missed = [*unoffered_names(graph, learners), *([sought] if sought else [])]
    here = session.offered(missed)
    missed = [name for name in missed if name not in here]
    for other in domain_discovery.ask_other_sessions(missed) if missed else []:
        for name, nodes in other.offers.items():
            action = name.removesuffix(SEND_GOAL)
            yield make_problem(
                "domain", f"{action} is offered by {', '.join(nodes)} on domain "
                f"{other.domain_id}, in {other.program}; this session is on domain "
                f"{session.domain_id}, and DDS domains never hear each other.",
                _how_to_join(other),
            )  # fmt: skip


def _how_to_join(other: domain_discovery.OtherSession) -> str:
    if other.port_base != port_bases.current_base():  # as many sessions run on this machine
        return "They have ports of their own, too: put the nodes of both into one notebook."
    return f"Join that domain: course.close(), then course.session(domain_id={other.domain_id})."
