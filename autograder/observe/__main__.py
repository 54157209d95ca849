"""``python -m autograder.observe``: the reference for authors, made from the docstrings."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator
from typing import Any

from autograder import observe
from autograder.examination.pictures.picture import Lane, Series, Timeline
from autograder.observe.choices import Choices, Question
from autograder.observe.examiner.actions import ActionServerEnd, SentGoal
from autograder.observe.examiner.lossless_listener import LosslessListener
from autograder.observe.examiner.merged_subscriptions import MergedSubscription
from autograder.observe.examiner.radio_link import open_radio_link
from autograder.observe.examiner.services import Request, ServiceServer
from autograder.observe.findings import handled_picture, in_context, rate_picture, with_picture
from autograder.observe.graph.graph_reader import GraphReader
from autograder.observe.graph.link_faults import find_link_faults
from autograder.observe.graph.node_graph import NodeGraph
from autograder.observe.graph.ros_graph import GraphService, GraphTopic, RosGraph
from autograder.observe.lifecycle.flat_rounds import require_flat, require_flat_lives
from autograder.observe.lifecycle.lifecycle_leaks import LifecycleLeaks
from autograder.observe.lifecycle.lifecycle_manager import LifecycleManager
from autograder.observe.lifecycle.node_lives import NodeLives
from autograder.observe.lifecycle.observer import Observer
from autograder.observe.lifecycle.process_holdings import ProcessHoldings
from autograder.observe.lifecycle.stepped_rate import MessageCounter
from autograder.observe.marks.mark_trace import Trace
from autograder.observe.marks.mark_tracer import MarkTracer
from autograder.observe.marks.marked_goals import MarkedGoals
from autograder.observe.marks.observed_design import ObservedDesign, declared_nodes
from autograder.observe.programs.program_observer import ProgramObserver
from autograder.observe.programs.stepped_trials import SteppedTrials
from autograder.observe.relays.late_joiner import hear_past
from autograder.observe.relays.observed_relays import ObservedRelays, relays_of
from autograder.observe.several_nodes.clock_bound_node import ClockBoundNode
from autograder.observe.several_nodes.heartbeats import longest_silence, require_heartbeat
from autograder.observe.several_nodes.multi_node_rig import Nodes, several_nodes
from autograder.observe.several_nodes.observed_goal import ObservedGoal
from autograder.observe.several_nodes.plain_programs import ObservedProgram
from autograder.observe.several_nodes.program_trials import Bounds, NodeTrials, served
from autograder.observe.stepped_time.stepped_goal import SteppedGoal
from autograder.observe.stepped_time.stepped_observer import SteppedObserver
from autograder.observe.stepped_time.stream_rate import StreamRate, require_stream

DESCRIBED: dict[str, tuple[Any, ...]] = {
    "One node": (
        observe.one_node, observe.Topic, observe.Service, observe.Action, observe.Parameter,
        observe.ObservedNode, observe.Span, observe.Change, observe.Draws,
    ),
    "Several nodes, one at a time, and the servers that they call": (
        several_nodes, Nodes, observe.Task, ClockBoundNode, ServiceServer, Request,
        ActionServerEnd, ObservedGoal, SentGoal, require_heartbeat, longest_silence,
    ),
    "The ROS graph, and what travels over it": (
        declared_nodes, ObservedDesign, RosGraph, GraphTopic, GraphService, GraphReader,
        find_link_faults, MarkTracer, MarkedGoals, Trace,
    ),
    "Nodes that hand on what they receive": (relays_of, ObservedRelays, hear_past, open_radio_link),
    "Plain programs, and what a process holds": (
        ObservedProgram, NodeTrials, Bounds, served, ProgramObserver, ProcessHoldings,
        require_flat, require_flat_lives,
    ),
    "Lives and states of a node": (
        Observer, NodeLives, NodeGraph, MessageCounter, LosslessListener, LifecycleManager,
        LifecycleLeaks,
    ),
    "Streams and goals, step by step": (
        SteppedObserver, SteppedGoal, MergedSubscription, require_stream, StreamRate,
        SteppedTrials,
    ),
    "What a student chose, and findings": (
        Choices, Question, in_context, with_picture, rate_picture, handled_picture, Timeline, Lane,
        Series,
    ),
}  # fmt: skip


def reference() -> str:
    """Return the page in Markdown."""
    return "\n".join(_lines()).rstrip() + "\n"


def _lines() -> Iterator[str]:
    yield "# What an exam looks and provokes with"
    yield ""
    yield "Made by `python -m autograder.observe` from the docstrings; a test keeps it in step."
    for title, nouns in DESCRIBED.items():
        yield from ("", f"## {title}")
        for described in nouns:
            yield ""
            yield f"From `{described.__module__}`:"
            yield from _section(described, 3, described.__name__)
            if inspect.isclass(described):
                yield from _members(described)


def _members(described: type) -> Iterator[str]:
    for name, member in vars(described).items():
        if not name.startswith("_") and inspect.getdoc(member):
            function = member.fget if isinstance(member, property) else member
            if inspect.isfunction(function) and function.__name__ == name:
                yield from _section(function, 4, name, is_property=function is not member)


def _section(described: Any, level: int, name: str, *, is_property: bool = False) -> Iterator[str]:
    signature = "" if is_property or inspect.isclass(described) else _signature(described)
    yield ""
    yield f"{'#' * level} `{name}{signature}`"
    yield ""
    yield "```text"
    yield from (inspect.getdoc(described) or "").splitlines()
    yield "```"


def _signature(function: Any) -> str:
    found = inspect.signature(function)
    kept = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for parameter in found.parameters.values()
        if parameter.name != "self"
    ]
    shown = str(found.replace(parameters=kept, return_annotation=inspect.Signature.empty))
    return re.sub(r"<function (\S+) at 0x\w+>", r"\1", shown)


if __name__ == "__main__":
    sys.stdout.write(reference())
