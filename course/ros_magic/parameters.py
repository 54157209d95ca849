"""Parameters: list a node's, read one, change one."""

from __future__ import annotations

from rcl_interfaces.msg import ParameterDescriptor

from course.errors import CourseError, SessionError
from course.graph import reader
from course.learner_session import default_session
from course.messages import yaml_text
from course.ros_magic.options import Add
from course.runtime.requests.graph_queries import full_node
from course.watch.parameter_values import TYPES, RefusedError
from course.watch.parameters import ParameterSheet

NOUN = "param"


def list_(node: str = "") -> str:
    """List the parameters of a node, or of all."""
    if node:
        return "\n".join([f"{full_node(node)}:", *(f"  {name}" for name in names_of(node))])
    lines = []
    for name in reader.read_graph(default_session.session().observer).nodes:
        lines.append(f"{name}:")
        try:
            lines += [f"  {parameter}" for parameter in names_of(name, 1.0)]
        except CourseError:  # one that is stuck, or has none, must not hide the others
            lines.append("  (its parameter services do not answer, or it has none)")
    return "\n".join(lines) or "No nodes."


def names_of(node: str, timeout: float = 5.0) -> list[str]:
    """Return the names of a node's parameters, sorted.

    Raises:
        SessionError: there is no such node, or it has no parameter services.
        WaitTimeout: it does not answer.
    """
    return _parameter_sheet(node).list_names(timeout)


def describe(node: str, names: list[str]) -> str:
    """Show what parameters are for, their type and range."""
    sheet = _parameter_sheet(node)
    return "\n".join(
        line for name in names for line in _description_lines(name, sheet.describe(name))
    )


def _description_lines(name: str, found: ParameterDescriptor) -> list[str]:
    kind = TYPES.get(found.type, (0, "any type, or none yet"))[1]
    lines = [f"Parameter name: {name}", f"  Type: {kind}"]
    if found.description:
        lines.append(f"  Description: {found.description}")
    lines.append("  Constraints: read only" if found.read_only else "  Constraints:")
    for span in [*found.integer_range, *found.floating_point_range]:
        lines += [f"    Min value: {span.from_value}", f"    Max value: {span.to_value}"]
        lines += [f"    Step: {span.step}"] if span.step else []
    if found.additional_constraints:
        lines.append(f"    {found.additional_constraints}")
    return lines if lines[-1] != "  Constraints:" else lines[:-1]


def get(node: str, name: str, hide_type: bool = True) -> str:
    """Show a parameter's value."""
    value = _parameter_sheet(node).get(name)
    if value is None:
        return f"{name} of {full_node(node)} has no value yet."
    return value if isinstance(value, str) else yaml_text.one_line(value)


def set_(node: str, name: str, value: str) -> str:
    """Change a parameter; a value that the node refuses comes back with its reason."""
    sheet = _parameter_sheet(node)
    try:
        sheet.set(name, _strip_quotes(value))
    except RefusedError as refusal:
        return str(refusal)
    return f"{sheet.node}: {name} is now {get(node, name)}"


def _strip_quotes(value: str) -> str:
    """Return a text without quotes of its own: to YAML '"5"' is the text 5, not a number."""
    if value[:1] in ("'", '"'):
        try:
            return str(yaml_text.parse_yaml(value))
        except ValueError:
            pass
    return value


def _parameter_sheet(node: str) -> ParameterSheet:
    session, name = default_session.session(), full_node(node)
    if name not in reader.read_graph(session.observer, everything=True).nodes:
        shown = ", ".join(reader.read_graph(session.observer).nodes)
        raise SessionError(f"There is no node {name}: there are {shown or 'none'}.")
    if not session.observer.count_services(f"{name}/list_parameters"):
        raise SessionError(
            f"{name} has no parameter services: it was made with start_parameter_services=False."
        )
    return ParameterSheet(session, name)


def _declare_list(add: Add) -> None:
    add("node", metavar="NODE", nargs="?", default="")


def _declare_name(add: Add) -> None:
    add("node", metavar="NODE")
    add("name", metavar="NAME")


def _declare_describe(add: Add) -> None:
    add("node", metavar="NODE")
    add("names", metavar="NAME", nargs="+")


def _declare_get(add: Add) -> None:
    _declare_name(add)
    add("--hide-type", action="store_true", help="the value alone, which is what is shown anyway")


def _declare_set(add: Add) -> None:
    _declare_name(add)
    add("value", metavar="VALUE", help="as YAML: true, 0.5, fast, [1, 2]")


VERBS = {
    "list": (list_, _declare_list),
    "get": (get, _declare_get),
    "set": (set_, _declare_set),
    "describe": (describe, _declare_describe),
}
