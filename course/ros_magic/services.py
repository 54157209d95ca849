"""Services: list them, and call one."""

from __future__ import annotations

import contextlib

from course.errors import SessionError
from course.graph import reader
from course.graph.model import Exchange
from course.learner_session import default_session
from course.messages import values, yaml_text
from course.messages.types import load_type, type_name
from course.ros_magic.options import Add, split_operands, type_and_values
from course.ros_magic.options import declare_timeout as add_timeout
from course.ros_magic.repetitions import declare_rate, parse_repetitions
from course.ros_magic.topic_types import agreed_type, build_message
from course.runtime.requests.graph_queries import full_service

NOUN = "service"


def list_(show_types: bool = False, everything: bool = False, count: bool = False) -> str:
    """List the services."""
    services = [service for service in _read_services(everything) if service.servers]
    if count:
        return str(len(services))
    return (
        "\n".join(
            f"{service.name} [{service.type}]" if show_types else service.name
            for service in services
        )
        or "No services."
    )


def call(
    service: str, asked: str, text: str, named: str, rate: float | None, timeout: float
) -> str:
    """Call a service and show its response; -r to call it more than once."""
    asked, text = split_operands(asked, text, named)
    name = full_service(default_session.session().observer, service)
    on_graph = [known.type for known in _read_services(everything=True) if known.name == name]
    if not (asked or on_graph):
        raise _no_service(name)
    srv_type = agreed_type("srv", name, asked, on_graph)
    number, rate = parse_repetitions(False, None, rate)
    answers: list[str] = []
    session = default_session.session()
    with contextlib.suppress(KeyboardInterrupt) if number > 1 else contextlib.nullcontext():
        for _ in session.paced(number, rate):
            request = build_message(srv_type.Request, text, session)
            response = session.call(srv_type, name, request, timeout)
            answers.append(yaml_text.to_lines(values.to_data(response)).strip())
    return "\n---\n".join(answers)


def show_type(service: str) -> str:
    """Show a service's type."""
    return type_of(service)


def info(service: str) -> str:
    """Show a service's type, and how many nodes serve and use it."""
    found = _find_service(service)
    return (
        f"Type: {found.type}\nClients count: {len(found.clients)}\n"
        f"Services count: {len(found.servers)}"
    )


def find(asked: str) -> str:
    """List the services of a type."""
    wanted = type_name(load_type(asked, kind="srv"))
    found = [service.name for service in _read_services(everything=True) if service.type == wanted]
    return "\n".join(found) or f"No service is of type {wanted}."


def type_of(service: str) -> str:
    """Return the type of a service that somebody offers or uses.

    Raises:
        SessionError: nobody does; the message names the services there are.
    """
    return _find_service(service).type


def _find_service(service: str) -> Exchange:
    name = full_service(default_session.session().observer, service)
    for known in _read_services(everything=True):
        if known.name == name:
            return known
    raise _no_service(name)


def _read_services(everything: bool) -> tuple[Exchange, ...]:
    return reader.read_graph(default_session.session().observer, everything=everything).services


def _no_service(name: str) -> SessionError:
    shown = ", ".join(service.name for service in _read_services(everything=False))
    return SessionError(f"There is no service {name}: there are {shown or 'none'}.")


def _declare_list(add: Add) -> None:
    add("-t", "--show-types", action="store_true", help="with their types")
    add("-c", "--count-services", dest="count", action="store_true", help="only how many there are")
    add("-a", "--all", "--include-hidden-services", dest="everything", action="store_true",
        help="those that ROS hides, too")  # fmt: skip


def _declare_service(add: Add) -> None:
    add("service", metavar="SERVICE")


def _declare_call(add: Add) -> None:
    _declare_service(add)
    type_and_values(add, "std_srvs/srv/SetBool", "'{data: true}'")
    declare_rate(add, "call it")
    add_timeout(add)


def _declare_find(add: Add) -> None:
    add("asked", metavar="TYPE", help="as in std_srvs/srv/SetBool")


VERBS = {
    "list": (list_, _declare_list),
    "call": (call, _declare_call),
    "type": (show_type, _declare_service),
    "info": (info, _declare_service),
    "find": (find, _declare_find),
}
