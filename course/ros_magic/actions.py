"""Actions: list them, and send a goal."""

from __future__ import annotations

from course.errors import SessionError
from course.graph import reader
from course.graph.model import Exchange
from course.learner_session import default_session
from course.messages import values, yaml_text
from course.ros_magic.options import Add, split_operands, type_and_values
from course.ros_magic.options import declare_timeout as add_timeout
from course.ros_magic.topic_types import agreed_type, build_message
from course.runtime.requests.graph_queries import full_action

NOUN = "action"


def list_(show_types: bool = False, count: bool = False) -> str:
    """List the actions."""
    actions = [action for action in _read_actions(everything=False) if action.servers]
    if count:
        return str(len(actions))
    return (
        "\n".join(
            f"{action.name} [{action.type}]" if show_types else action.name for action in actions
        )
        or "No actions."
    )


def info(action: str, show_types: bool = False, count: bool = False) -> str:
    """Show which nodes serve an action, and which send it goals."""
    found = _find_action(action)
    lines = [f"Action: {found.name}"]
    for what, names in (("clients", found.clients), ("servers", found.servers)):
        lines.append(f"Action {what}: {len(names)}")
        kind = f" [{found.type}]" if show_types else ""
        lines += [] if count else [f"    {name}{kind}" for name in names]
    return "\n".join(lines)


def show_type(action: str) -> str:
    """Show an action's type."""
    return _find_action(action).type


def send_goal(
    action: str, asked: str, text: str, named: str, feedback: bool, timeout: float
) -> str:
    """Send a goal, wait for its result, and show it; -f with the feedback on the way."""
    asked, text = split_operands(asked, text, named)
    session = default_session.session()
    name = full_action(session.observer, action)
    on_graph = [known.type for known in _read_actions(everything=True) if known.name == name]
    if not (asked or on_graph):
        raise _no_action(name)
    action_type = agreed_type("action", name, asked, on_graph)
    goal = build_message(action_type.Goal, text, session)
    run = session.send_goal(action_type, name, goal, timeout=timeout)
    if not run.accepted:
        return "The goal was rejected."
    result = run.wait(timeout)
    lines = [f"feedback: {values.to_data(one)}" for one in run.feedback] if feedback else []
    shown = yaml_text.to_lines(values.to_data(result)).strip()
    return "\n".join([*lines, f"result:\n{shown}", f"state: {run.status.name}"])


def _find_action(action: str) -> Exchange:
    name = full_action(default_session.session().observer, action)
    for known in _read_actions(everything=True):
        if known.name == name:
            return known
    raise _no_action(name)


def _read_actions(everything: bool) -> tuple[Exchange, ...]:
    return reader.read_graph(default_session.session().observer, everything=everything).actions


def _no_action(name: str) -> SessionError:
    shown = ", ".join(known.name for known in _read_actions(everything=True))
    return SessionError(f"There is no action {name}: there are {shown or 'none'}.")


def _declare_list(add: Add) -> None:
    add("-t", "--show-types", action="store_true", help="with their types")
    add("-c", "--count-actions", dest="count", action="store_true", help="only how many there are")


def _declare_action(add: Add) -> None:
    add("action", metavar="ACTION")


def _declare_info(add: Add) -> None:
    _declare_action(add)
    add("-t", "--show-types", action="store_true", help="with the type")
    add("-c", "--count", action="store_true", help="only how many there are")


def _declare_send_goal(add: Add) -> None:
    _declare_action(add)
    type_and_values(add, "example_interfaces/action/Fibonacci", "'{order: 5}'")
    add("-f", "--feedback", action="store_true", help="show the feedback, too")
    add_timeout(add, 30.0)


VERBS = {
    "list": (list_, _declare_list),
    "info": (info, _declare_info),
    "type": (show_type, _declare_action),
    "send_goal": (send_goal, _declare_send_goal),
}
