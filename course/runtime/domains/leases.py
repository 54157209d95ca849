"""ROS domain ids: check one, or lease a free one for as long as this process lives.

Two kernels on one machine must never share a domain by accident. A lease is an abstract Unix
socket: the kernel drops it when its process ends, however it ends, and it is scoped to the network
namespace, exactly as the UDP ports of DDS are.
"""

from __future__ import annotations

import os
import random
import socket
import weakref
from pathlib import Path

from course.errors import DomainError
from course.runtime.domains import port_files

MIN_DOMAIN, MAX_DOMAIN = 0, 101
"""Domain ids that are safe on Linux (ROS 2 docs, "The ROS_DOMAIN_ID": above 101 the ports of DDS
run into the ephemeral ports; from 233 on Fast DDS ends the process)."""

_leases: weakref.WeakSet[DomainLease] = weakref.WeakSet()


def check_domain_id(domain_id: object) -> int:
    """Return `domain_id` if it is safe to use.

    Raises:
        DomainError: it is not a whole number from 0 to 101.
    """
    if isinstance(domain_id, bool) or not isinstance(domain_id, int):
        raise DomainError(
            f"A ROS domain id is a whole number, not {domain_id!r}: "
            f"choose one from {MIN_DOMAIN} to {MAX_DOMAIN}."
        )
    if not MIN_DOMAIN <= domain_id <= MAX_DOMAIN:
        raise DomainError(
            f"ROS domain {domain_id} is out of range: choose one from {MIN_DOMAIN} to {MAX_DOMAIN}."
        )
    return domain_id


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


def lease_address(domain_id: int) -> str:
    """Return the address of the socket that is this domain's lease, while it is leased."""
    return f"\0ros2-course/domain/{domain_id}"


def lease_domain() -> DomainLease:
    """Lease a domain id from 1 to 101 that nobody on this machine uses.

    Domain 0 is left out: it is everyone's default. A domain whose RTPS ports are open belongs to
    some other ROS program, leased or not, and is passed over. What a killed program has left on a
    domain so that DDS would hang there is removed first.

    Raises:
        DomainError: every domain is taken.
    """
    in_use = domains_in_use()
    candidates = list(range(MIN_DOMAIN + 1, MAX_DOMAIN + 1))
    # A random order: a class of kernels that start at once must not race for the same first id.
    random.SystemRandom().shuffle(candidates)
    for domain_id in candidates:
        if domain_id not in in_use and (sock := _claim_domain(domain_id)) is not None:
            port_files.remove_abandoned(domain_id)
            return DomainLease(domain_id, sock)
    raise DomainError(
        f"All ROS domains from {MIN_DOMAIN + 1} to {MAX_DOMAIN} on this machine are taken: "
        "shut down notebooks that you no longer use, or choose one with Session(domain_id=...)."
    )


def reserve_domain(domain_id: int) -> DomainLease | None:
    """Lease this one domain id, so that `lease_domain` gives it to nobody; None if it is leased."""
    sock = _claim_domain(check_domain_id(domain_id))
    return None if sock is None else DomainLease(domain_id, sock)


def domains_in_use() -> set[int]:
    """Return the domain ids whose RTPS ports are open in this network namespace."""
    domains = set()
    for table in ("/proc/net/udp", "/proc/net/udp6"):
        try:
            lines = Path(table).read_text(encoding="ascii").splitlines()[1:]
        except OSError:  # no IPv6, or a hardened /proc: the lease itself still keeps us apart
            continue
        for line in lines:
            port = int(line.split()[1].rpartition(":")[2], 16)
            domains.add((port - port_files.FIRST_PORT) // port_files.DOMAIN_GAIN)
    return domains


def _claim_domain(domain_id: int) -> socket.socket | None:
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
    try:
        sock.bind(lease_address(domain_id))
    except OSError:
        sock.close()
        return None
    return sock


def _release_in_child() -> None:
    # A forked child shares the socket: it would keep the lease alive after its parent has gone.
    for lease in list(_leases):
        lease.release()


os.register_at_fork(after_in_child=_release_in_child)
