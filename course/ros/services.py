"""Services: list them, and call one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from course import ambient, plain, values
from course.errors import SessionError
from course.graph import reader
from course.ros.arguments import timeout as add_timeout
from course.runtime.offers import load_type

NOUN = "service"


def list_(show_types: bool = False, everything: bool = False) -> str:
    """List the services."""
    services = reader.read(ambient.session().observer, everything=everything).services
    return (
        "\n".join(
            f"{service.name} [{service.type}]" if show_types else service.name
            for service in services
            if service.servers
        )
        or "No services."
    )


def call(service: str, request: str = "{}", type: str = "", timeout: float = 5.0) -> str:  # noqa: A002
    """Call a service and show its response."""
    srv_type = load_type(type or type_of(service), kind="srv")
    response = ambient.call(srv_type, service, values.from_text(srv_type.Request, request), timeout)
    return plain.lines(values.to_data(response)).strip()


def type_of(service: str) -> str:
    """Return the type of a service that somebody offers or uses.

    Raises:
        SessionError: nobody does; the message names the services there are.
    """
    name = service if service.startswith("/") else f"/{service}"
    services = reader.read(ambient.session().observer, everything=True).services
    for known in services:
        if known.name == name:
            return known.type
    shown = ", ".join(s.name for s in reader.read(ambient.session().observer).services)
    raise SessionError(f"There is no service {name}: there are {shown or 'none'}.")


def _declare_list(add: Callable[..., Any]) -> None:
    add("-t", "--show-types", action="store_true", help="with their types")
    add("-a", "--all", dest="everything", action="store_true", help="those that ROS hides, too")


def _declare_call(add: Callable[..., Any]) -> None:
    add("service")
    add("request", nargs="?", default="{}", help="its fields as YAML, as in '{data: true}'")
    add("--type", default="", help="its type, if it is not to be taken from the graph")
    add_timeout(add)


VERBS = {"list": (list_, _declare_list), "call": (call, _declare_call)}
