"""The port base of this process: where a class fills the usual domains, others go beside them.

Fast DDS reads its profiles once, when a process makes its first participant. So the base is chosen
with the first domain that is leased, for the life of the process, and the processes that it starts
inherit it by two environment variables.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from course.runtime.domains.rtps_ports import BASES, USUAL_BASE
from course.util import operating_system

PORT_BASE = "COURSE_PORT_BASE"
"""Environment variable with the port base, if it is not the usual one."""

PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
"""Environment variable with the profiles that Fast DDS 2 reads."""

PROFILES_OF_3 = "FASTDDS_DEFAULT_PROFILES_FILE"
PROFILE = Path(__file__).with_name("port_profile.xml")

_settled = False


def current_base() -> int:
    """Return the port base of this process."""
    return int(os.environ[PORT_BASE]) if is_beside() else USUAL_BASE


def is_beside() -> bool:
    """Return whether this process has another port base than plain ROS 2."""
    return os.environ.get(PROFILES) == str(PROFILE) and PORT_BASE in os.environ


def possible_bases(free: Mapping[int, float]) -> list[int]:
    """Return the bases that a domain may be leased at, the best first.

    That is the first with half of its domains left, so that those who came early find a second one
    when they need it; then those with most left.

    Args:
        free: what share of its domains is left at each base, from 0 to 1.
    """
    if _settled or is_beside() or not _may_move():
        return [current_base()]
    roomy = [base for base in free if free[base] >= 0.5][:1]
    return roomy + sorted((base for base in free if base not in roomy), key=lambda b: -free[b])


def settle(base: int) -> None:
    """Stay at this base for the life of the process, and of those that it starts."""
    global _settled
    if not _settled and base != current_base():
        os.environ[PORT_BASE] = str(base)
        os.environ[PROFILES] = os.environ[PROFILES_OF_3] = str(PROFILE)
    _settled = True


def known_bases() -> tuple[int, ...]:
    """Return the bases that sessions on this machine may have."""
    return BASES if operating_system.is_linux() else (USUAL_BASE,)


def _may_move() -> bool:
    """Return whether profiles are still read, and are not somebody else's."""
    import rclpy.context

    chosen = any(os.environ.get(name) for name in (PROFILES, PROFILES_OF_3))
    started = rclpy.context.g_logging_ref_count > 0  # rclpy.init() came before the first session
    return operating_system.is_linux() and not chosen and not started
