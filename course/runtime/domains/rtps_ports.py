"""The UDP ports of a ROS domain: which a domain has, which are safe, and which are taken.

A domain is nothing but its ports. DDSI-RTPS 2.2, section 9.6.1.1, gives each 250 of them from 7400
on, and ROS 2 looks for 32 participants on the first 74. In the other 176 there is room for four
more domains of the same number, each with a port base of its own (`port_profile.xml`), at ports
where none of the others looks or listens. Ten participants fit: numbered within a process, so ten
open sessions in one kernel. An eleventh takes ports of the next domain, which then counts as taken.

Linux hands out some ports to whoever asks for any, by default 32768 to 60999. That leaves the
domains 0 to 101 and 215 to 232 (ROS 2 docs, "The ROS_DOMAIN_ID").
"""

from __future__ import annotations

from collections.abc import Set
from functools import cache

from course.util import operating_system

LAST_DOMAIN = 232
"""From 233 on the ports lie above 65535, and Fast DDS ends the process."""

USUAL_BASE = 7400
"""The port base of plain ROS 2 (PB in DDSI-RTPS)."""

DOMAIN_GAIN = 250  # ports (DG)
USUAL_PORTS = 74  # 10 + 2 * 32: what rmw_fastrtps 8.4 looks at on its own host
BESIDE_PORTS = 44  # 2 for multicast, 32 where participants are looked for, 10 for their data
BASES = (USUAL_BASE, *(USUAL_BASE + USUAL_PORTS + BESIDE_PORTS * n for n in range(4)))
"""All port bases, the usual one first."""

LEASE_PORT = 9  # in each domain: no participant has it, as theirs begin at 10
_HIGHEST_PORT = 65535


def domain_ports(domain_id: int, base: int = USUAL_BASE) -> range:
    """Return the ports that participants of a domain have, or are looked for at."""
    first = base + DOMAIN_GAIN * domain_id
    return range(first, first + (USUAL_PORTS if base == USUAL_BASE else BESIDE_PORTS))


def safe_domains(base: int = USUAL_BASE) -> list[int]:
    """Return the domain ids whose ports the system hands out to nobody else."""
    return list(_find_safe(base, operating_system.ephemeral_ports()))


@cache
def _find_safe(base: int, ephemeral: range) -> tuple[int, ...]:
    return tuple(
        domain_id
        for domain_id in range(LAST_DOMAIN + 1)
        if (ports := domain_ports(domain_id, base))[-1] <= _HIGHEST_PORT
        and not _overlap(ports, ephemeral)
    )


def domains_in_use(base: int = USUAL_BASE) -> set[int]:
    """Return the domain ids whose RTPS ports are open in this network namespace."""
    ports = operating_system.open_udp_ports()
    if ports is None:
        return {domain_id for domain_id in safe_domains(base) if _answers_to_a_knock(domain_id)}
    return _domains_of(ports, base)


def _domains_of(ports: Set[int], base: int) -> set[int]:
    width = len(domain_ports(0, base))
    return {(p - base) // DOMAIN_GAIN for p in ports if 0 <= (p - base) % DOMAIN_GAIN < width}


def _answers_to_a_knock(domain_id: int) -> bool:
    """Return whether one of the first participants of a domain is there."""
    return any(
        operating_system.is_port_open(port) for port in domain_ports(domain_id)[10:16:2]
    )  # every metatraffic unicast port is even


def _overlap(one: range, other: range) -> bool:
    return one.start < other.stop and other.start < one.stop
