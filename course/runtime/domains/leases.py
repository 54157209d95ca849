"""ROS domain ids: check one, or lease a free one for as long as this process lives.

Two kernels on one machine must never share a domain by accident. A lease is a claim that the kernel
drops when its process ends, however it ends, and that is scoped to the network namespace, exactly
as the UDP ports of DDS are.
"""

from __future__ import annotations

import os
import random
import socket
import weakref
from collections.abc import Iterable

from course.errors import DomainError
from course.runtime.domains import port_bases, port_files
from course.runtime.domains.rtps_ports import (
    LEASE_PORT,
    USUAL_BASE,
    domain_ports,
    domains_in_use,
    safe_domains,
)
from course.util.operating_system import Claim, claimed_names

MIN_DOMAIN, MAX_DOMAIN = 0, 101
"""Domain ids that any program may use, whatever ports a system hands out by default."""

_leases: weakref.WeakSet[DomainLease] = weakref.WeakSet()


def check_domain_id(domain_id: object) -> int:
    """Return `domain_id` if it is safe to use.

    Raises:
        DomainError: it is not a whole number, or its ports may be handed out to other programs.
    """
    if isinstance(domain_id, bool) or not isinstance(domain_id, int):
        raise DomainError(
            f"A ROS domain id is a whole number, not {domain_id!r}: "
            f"choose one from {describe_domains()}."
        )
    if domain_id not in usable_domains():
        raise DomainError(
            f"ROS domain {domain_id} is out of range: choose one from {describe_domains()}."
        )
    return domain_id


def usable_domains() -> list[int]:
    """Return the domain ids that a session may be on, ascending."""
    return sorted({*range(MIN_DOMAIN, MAX_DOMAIN + 1), *safe_domains()})


def describe_domains() -> str:
    """Return the domain ids that a session may be on, in words: "0 to 101 or 215 to 232"."""
    domains = usable_domains()
    starts = [n for n in domains if n - 1 not in domains]
    ends = [n for n in domains if n + 1 not in domains]
    return " or ".join(f"{start} to {end}" for start, end in zip(starts, ends, strict=True))


def require_reachable(domain_id: int) -> None:
    """Return if programs on this domain can hear this process.

    Raises:
        DomainError: this process has left the ports of plain ROS 2, and no lease of another one
            shows that it is there, too.
    """
    base = port_bases.current_base()
    if base != USUAL_BASE and not _is_leased(domain_id, base):
        raise DomainError(
            f"This notebook has ports beside the usual ones, as many sessions run on this machine, "
            f"and cannot join ROS domain {domain_id}: restart its kernel, and open "
            f"Session(domain_id={domain_id}) before any other session."
        )


class DomainLease:
    """One domain id that no other session on this machine can lease; released by `release()`."""

    def __init__(self, domain_id: int, sock: socket.socket) -> None:
        """Hold `domain_id` for as long as `sock` is open; others may send to it meanwhile."""
        self.domain_id = domain_id
        self.socket = sock
        _leases.add(self)

    def release(self) -> None:
        """Give the domain id back. Idempotent."""
        self.socket.close()


def lease_claim(domain_id: int, base: int = USUAL_BASE) -> Claim:
    """Return the claim that is the lease of this domain at this port base."""
    name = f"ros2-course/domain/{domain_id}"
    port = domain_ports(domain_id).start + LEASE_PORT
    return Claim(name if base == USUAL_BASE else f"{name}/{base}", port)


def lease_domain() -> DomainLease:
    """Lease a domain id that nobody on this machine uses.

    Domain 0 is left out: it is everyone's default. A domain whose RTPS ports are open belongs to
    some other ROS program, leased or not, and is passed over. What a killed program has left on a
    domain so that DDS would hang there is removed first. The first lease of a process also decides
    on its port base (`port_bases`), which all its domains have from then on.

    Raises:
        DomainError: every domain is taken.
    """
    left = {base: free_domains(base) for base in port_bases.known_bases()}
    shares = {base: len(left[base]) / len(leasable_domains(base)) for base in left}
    bases = port_bases.possible_bases(shares)
    for base in bases:
        # A random order: a class of kernels that start at once must not race for the same first id.
        random.SystemRandom().shuffle(left[base])
        for domain_id in left[base]:
            if (sock := lease_claim(domain_id, base).take()) is not None:
                port_bases.settle(base)
                port_files.remove_abandoned(domain_id)
                return DomainLease(domain_id, sock)
    count = sum(len(leasable_domains(base)) for base in bases)
    raise DomainError(
        f"All {count} ROS domains that this notebook can have on this machine are taken: "
        "shut down notebooks that you no longer use, or choose one with Session(domain_id=...)."
    )


def reserve_domain(domain_id: int) -> DomainLease | None:
    """Lease this one domain id, so that `lease_domain` gives it to nobody; None if it is leased."""
    sock = lease_claim(check_domain_id(domain_id), port_bases.current_base()).take()
    return None if sock is None else DomainLease(domain_id, sock)


def leasable_domains(base: int = USUAL_BASE) -> list[int]:
    """Return the domain ids that are leased at a port base: the safe ones, but for 0."""
    domains: Iterable[int] = safe_domains(base)
    if base == USUAL_BASE and not domains:  # the system may hand out every port that there is
        domains = range(MIN_DOMAIN, MAX_DOMAIN + 1)
    return [domain_id for domain_id in domains if domain_id]


def free_domains(base: int = USUAL_BASE) -> list[int]:
    """Return the domain ids that nobody uses, nor has leased, at a port base."""
    taken, names = domains_in_use(base), claimed_names()
    return [
        domain_id
        for domain_id in leasable_domains(base)
        if domain_id not in taken and lease_claim(domain_id, base).name not in names
    ]


def _is_leased(domain_id: int, base: int) -> bool:
    return lease_claim(domain_id, base).name in claimed_names()


def _release_in_child() -> None:
    # A forked child shares the socket: it would keep the lease alive after its parent has gone.
    for lease in list(_leases):
        lease.release()


os.register_at_fork(after_in_child=_release_in_child)
