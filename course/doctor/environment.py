"""Environment variables that change how ROS 2 behaves, and those that break it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from importlib import metadata
from pathlib import Path

from course.doctor import ros_origin
from course.doctor.finding import HealthFinding, make_ok, make_problem, make_warning
from course.runtime.domains import port_bases
from course.runtime.domains.leases import describe_domains, usable_domains
from course.runtime.domains.rtps_ports import LAST_DOMAIN

RMW = "rmw_fastrtps_cpp"
"""The one middleware that there are wheels of, and that the course is made for."""

_RANGES = {"SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT"}
_MARK = "_ROS_WHEELS_BOOTSTRAP_COMPLETE"
_PROFILES = (port_bases.PROFILES_OF_3, port_bases.PROFILES)

Environment = Mapping[str, str]


def examine_environment(environment: Environment, prefix: str) -> Iterator[HealthFinding]:
    """Yield what the variables of ``environment`` do to ROS 2.

    Args:
        environment: such as ``os.environ``.
        prefix: root of the Python environment (``sys.prefix``).
    """
    found = [finding for check in _CHECKS for finding in check(environment)]
    found += _check_bootstrap(environment, prefix)
    if found:
        yield from found
    else:
        yield make_ok("environment", "No variable is set that disturbs ROS 2.")


def _check_domain(environment: Environment) -> Iterator[HealthFinding]:
    name, text = "ROS_DOMAIN_ID", environment.get("ROS_DOMAIN_ID", "")
    if not text:
        return
    # A session leases a domain of its own, whatever stands here: only other programs follow it.
    note = "The course does not use it, but other ROS programs in this shell will not start well."
    mend = f"Run `unset {name}`, or set it to a number from {describe_domains()}."
    if not text.strip().isdecimal():
        yield make_warning(name, f"{text!r} is not a whole number. {note}", mend)
    elif int(text) > LAST_DOMAIN:
        yield make_warning(name, f"{text} is too large. {note}", mend)
    elif int(text) not in usable_domains():
        yield make_warning(name, f"{text} can collide with other programs' ports on Linux.", mend)


def _check_middleware(environment: Environment) -> Iterator[HealthFinding]:
    name, chosen = "RMW_IMPLEMENTATION", environment.get("RMW_IMPLEMENTATION", "")
    if chosen and chosen != RMW:
        yield make_problem(
            name,
            f"It asks for {chosen}, but the course runs on {RMW} only.",
            f"Run `unset {name}`.",
        )


def _check_discovery(environment: Environment) -> Iterator[HealthFinding]:
    name, chosen = (
        "ROS_AUTOMATIC_DISCOVERY_RANGE",
        environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", ""),
    )
    if chosen and chosen not in _RANGES:
        known = ", ".join(sorted(_RANGES))
        yield make_warning(name, f"{chosen!r} is none of {known}.", f"Run `unset {name}`.")
    elif chosen == "OFF":
        yield make_warning(
            name, "OFF keeps ROS programs outside of the course apart.", f"Run `unset {name}`."
        )
    if environment.get("ROS_LOCALHOST_ONLY", "0") not in ("", "0"):
        yield make_warning(
            "ROS_LOCALHOST_ONLY",
            "It is deprecated, and overrules how far a session looks for other nodes.",
            "Run `unset ROS_LOCALHOST_ONLY`.",
        )


def _check_security(environment: Environment) -> Iterator[HealthFinding]:
    if environment.get("ROS_SECURITY_ENABLE", "").lower() == "true":
        yield make_problem(
            "ROS_SECURITY_ENABLE",
            "ROS security is on, and nodes without a key of their own do not start.",
            "Run `unset ROS_SECURITY_ENABLE`.",
        )


def _check_profiles(environment: Environment) -> Iterator[HealthFinding]:
    for name in _PROFILES:
        path = environment.get(name, "")
        if path == str(port_bases.PROFILE):  # the shell of a notebook with ports of its own
            continue
        if path and not Path(path).is_file():
            yield make_problem(name, f"There is no file {path}.", f"Run `unset {name}`.")
        elif path:
            yield make_warning(
                name,
                f"DDS follows the profiles in {path}; checks and measurements may differ.",
                f"Run `unset {name}` unless you mean it.",
            )
    if transports := environment.get("FASTDDS_BUILTIN_TRANSPORTS", ""):
        yield make_warning(
            "FASTDDS_BUILTIN_TRANSPORTS",
            f"DDS uses {transports} in place of its usual transports.",
            "Run `unset FASTDDS_BUILTIN_TRANSPORTS` unless you mean it.",
        )


def _system_ros(environment: Environment) -> Iterator[HealthFinding]:
    places = [
        part
        for name in ("PYTHONPATH", "LD_LIBRARY_PATH", "AMENT_PREFIX_PATH")
        for part in environment.get(name, "").split(os.pathsep)
        if part.startswith("/opt/ros/")
    ]
    if places and _wheels_are_here():
        distribution = places[0].split("/")[3]
        yield make_warning(
            "sourced ROS",
            f"A ROS installation ({distribution}) is sourced in this shell, and its libraries can "
            "mix with the course's own.",
            "If the course fails to start, use a shell without `source /opt/ros/.../setup.bash`.",
        )


def _wheels_are_here() -> bool:
    return any(metadata.distributions(name=ros_origin.WHEEL))


def _check_bootstrap(environment: Environment, prefix: str) -> Iterator[HealthFinding]:
    """The wheels set `_MARK` when they have set LD_LIBRARY_PATH; alone it was inherited."""
    paths = environment.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    if environment.get(_MARK) and _wheels_are_here() and str(Path(prefix) / "lib") not in paths:
        yield make_problem(
            _MARK,
            "It was inherited from another Python environment, so the ROS 2 wheels do not find "
            "their libraries here.",
            f"Run `unset {_MARK}`, and start again.",
        )


_CHECKS: tuple[Callable[[Environment], Iterator[HealthFinding]], ...] = (
    _check_domain,
    _check_middleware,
    _check_discovery,
    _check_security,
    _check_profiles,
    _system_ros,
)
