"""``python -m autograder.observe``: the reference for authors, made from the docstrings."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from typing import Any

from autograder import observe
from autograder.observe.observed_node import Change
from autograder.observe.span import Span

DESCRIBED: tuple[Any, ...] = (
    observe.one_node, observe.Topic, observe.Service, observe.Action, observe.Parameter,
    observe.ObservedNode, Span, Change,
    observe.several_nodes, observe.Nodes, observe.Task, observe.ClockBoundNode,
    observe.ServiceServer, observe.Request, observe.ActionServerEnd,
    observe.ObservedGoal, observe.SentGoal, observe.require_heartbeat, observe.longest_silence,
    observe.ObservedProgram, observe.NodeTrials, observe.Bounds, observe.served,
)  # fmt: skip


def reference() -> str:
    """Return the page in Markdown."""
    return "\n".join(_lines()).rstrip() + "\n"


def _lines() -> Iterator[str]:
    yield "# What an exam looks and provokes with"
    yield ""
    yield "Made by `python -m autograder.observe` from the docstrings; a test keeps it in step."
    for described in DESCRIBED:
        yield from _section(described, 2, described.__name__)
        if inspect.isclass(described):
            for name, member in vars(described).items():
                if not name.startswith("_") and inspect.getdoc(member):
                    function = member.fget if isinstance(member, property) else member
                    if inspect.isfunction(function) and function.__name__ == name:
                        yield from _section(function, 3, name, is_property=function is not member)


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
    return str(found.replace(parameters=kept, return_annotation=inspect.Signature.empty))


if __name__ == "__main__":
    sys.stdout.write(reference())
