"""Why does nothing arrive? Findings about a session's nodes, in plain words, with the mend."""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from typing import overload

from course.diagnosis import domains, graph, lifecycle, nodes
from course.doctor.finding import HealthFinding
from course.runtime.core_session import CoreSession

__all__ = ["Diagnosis", "diagnose", "find_quickly", "likely_reasons"]


class Diagnosis(Sequence[HealthFinding]):
    """Findings, those that keep something from working first; prints as a list."""

    def __init__(self, findings: Sequence[HealthFinding]) -> None:
        """Show ``findings``."""
        self.findings = sorted(findings, key=lambda finding: finding.status != "problem")

    def __len__(self) -> int:
        """Return the number of findings."""
        return len(self.findings)

    @overload
    def __getitem__(self, index: int) -> HealthFinding: ...
    @overload
    def __getitem__(self, index: slice) -> list[HealthFinding]: ...
    def __getitem__(self, index: int | slice) -> HealthFinding | list[HealthFinding]:
        """Return a finding, or several."""
        return self.findings[index]

    def __iter__(self) -> Iterator[HealthFinding]:
        """Iterate over the findings."""
        return iter(self.findings)

    def __repr__(self) -> str:
        """Return the findings as text."""
        if not self.findings:
            return "Nothing is wrong that can be seen from here."
        return "\n".join(finding.as_text() for finding in self.findings)

    def _repr_html_(self) -> str:
        if not self.findings:
            return f"<p>{html.escape(repr(self))}</p>"
        items = "".join(
            f"<li><b>{html.escape(f.name)}</b>: {html.escape(f.message)}<br>"
            f"<i>{html.escape(f.mend)}</i></li>"
            for f in self.findings
        )
        return f"<ul>{items}</ul>"


def diagnose(session: CoreSession) -> Diagnosis:
    """Return what is wrong, or may be, with a session's nodes and what they talk to.

    Nodes of other processes are asked whether they answer, and other notebooks' sessions whether
    they have what is missed here; it takes up to three seconds.
    """
    asked = (domains.next_door, nodes.find_silent, lifecycle.check_other_nodes)
    return Diagnosis(
        [*find_quickly(session), *(found for check in asked for found in check(session))]
    )


def find_quickly(session: CoreSession) -> list[HealthFinding]:
    """Return what can be found without waiting for anybody."""
    return [*nodes.find_stuck(session), *nodes.find_moved(session), *_further_findings(session)]


def likely_reasons(session: CoreSession, *, vague: bool, sought: str = "") -> list[HealthFinding]:
    """Return what may be why a wait of the session was in vain, the likeliest first.

    Stuck callbacks and nodes in other executors are left out: a wait tells of them by itself. Nodes
    of other processes are asked whether they answer, all at once, if nothing else explains it.

    Args:
        session: whose wait it was.
        vague: nobody knows what was waited for; so an endpoint without anybody on the other side
            may be the reason.
        sought: the topic or service that was waited for, as the graph spells it, or "".
    """
    found = [f for f in _further_findings(session) if vague or f.name not in _LONELY]
    if vague or sought:
        found += domains.next_door(session, sought)
    if not any(finding.status == "problem" for finding in found):
        found += [*nodes.find_silent(session), *lifecycle.check_other_nodes(session)]
    return sorted(found, key=_rank_finding)


_LONELY = ("topic", "service", "action")


def _further_findings(session: CoreSession) -> list[HealthFinding]:
    checks = (
        nodes.find_stolen, nodes.find_paused, nodes.half_made, nodes.find_unspun,
        lifecycle.check_own_nodes, domains.on_another_domain, graph.check_graph,
    )  # fmt: skip
    return [finding for check in checks for finding in check(session)]


def _rank_finding(finding: HealthFinding) -> int:
    if finding.status == "problem":
        return 0
    if finding.name == "pause" or graph.NEARLY in finding.message:
        return 1
    return 3 if finding.name == "domain" and "ROS_DOMAIN_ID" in finding.message else 2
