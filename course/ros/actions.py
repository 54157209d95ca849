"""Actions: list them, and send a goal."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from course import ambient, plain, values
from course.errors import SessionError
from course.graph import reader
from course.ros.arguments import timeout as add_timeout
from course.runtime.offers import load_type

NOUN = "action"


def list_(show_types: bool = False) -> str:
    """List the actions."""
    actions = reader.read(ambient.session().observer).actions
    return (
        "\n".join(
            f"{action.name} [{action.type}]" if show_types else action.name
            for action in actions
            if action.servers
        )
        or "No actions."
    )


def send_goal(action: str, goal: str = "{}", feedback: bool = False, timeout: float = 30.0) -> str:
    """Send a goal, wait for its result, and show it; -f with the feedback on the way."""
    action_type = load_type(_type_of(action), kind="action")
    run = ambient.send_goal(
        action_type, action, values.from_text(action_type.Goal, goal), timeout=timeout
    )
    if not run.accepted:
        return "The goal was rejected."
    result = run.wait(timeout)
    lines = [f"feedback: {values.to_data(message)}" for message in run.feedback] if feedback else []
    text = plain.lines(values.to_data(result)).strip()
    return "\n".join([*lines, f"result:\n{text}", f"state: {run.status.name}"])


def _type_of(action: str) -> str:
    name = action if action.startswith("/") else f"/{action}"
    actions = reader.read(ambient.session().observer, everything=True).actions
    for known in actions:
        if known.name == name:
            return known.type
    shown = ", ".join(known.name for known in actions)
    raise SessionError(f"There is no action {name}: there are {shown or 'none'}.")


def _declare_list(add: Callable[..., Any]) -> None:
    add("-t", "--show-types", action="store_true", help="with their types")


def _declare_send_goal(add: Callable[..., Any]) -> None:
    add("action")
    add("goal", nargs="?", default="{}", help="its fields as YAML, as in '{order: 5}'")
    add("-f", "--feedback", action="store_true", help="show the feedback, too")
    add_timeout(add, 30.0)


VERBS = {"list": (list_, _declare_list), "send_goal": (send_goal, _declare_send_goal)}
