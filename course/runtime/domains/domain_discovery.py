"""What sessions of other notebooks on this machine offer, asked beside DDS.

Each notebook has a ROS domain of its own, and domains never hear each other. A topic or a service
that is missing in one notebook may be offered in another one. So the socket that is the lease of a
domain (see `leases`) answers which names are offered there, and by which nodes.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from course.runtime.domains import port_bases
from course.runtime.domains.leases import DomainLease, leasable_domains, lease_claim
from course.util.operating_system import Claim, bind_anywhere, new_socket

ANSWER_TIMEOUT_S = 0.5
"""Seconds within which a session answers, unless its process is stopped."""

MOST_NAMES = 100
_MOST_BYTES = 64 * 1024

Offers = Callable[[list[str]], Mapping[str, list[str]]]
"""Returns who offers each of these names, as far as anybody does: fully qualified node names."""


class OtherSession(NamedTuple):
    """A session of another program: its domain, the program's name, and what it offers of it.

    With another port base than this process's it cannot be joined (`port_bases`).
    """

    domain_id: int
    program: str
    offers: dict[str, list[str]]
    port_base: int


class Answering:
    """Answers the questions of others on the socket of a lease, in a thread of its own."""

    def __init__(self, lease: DomainLease, offers: Offers) -> None:
        """Answer until `stop`, which comes before the lease is released."""
        self._lease = lease
        self._offers = offers
        self._stopping = False
        name = f"ROS neighbours of domain {lease.domain_id}"
        self._thread = threading.Thread(target=self._answer_questions, name=name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Answer no more. Idempotent."""
        self._stopping = True
        sock = self._lease.socket
        with suppress(OSError):  # it is closed, or has questions left to wake up for
            sock.sendto(b"", socket.MSG_DONTWAIT, sock.getsockname())
        self._thread.join(1.0)

    def _answer_questions(self) -> None:
        sock = self._lease.socket
        while not self._stopping:
            try:
                question, sender = sock.recvfrom(_MOST_BYTES)
            except OSError:
                return
            with suppress(Exception):  # no question, an asker that has gone, nodes that go
                sock.sendto(self._make_reply(question), socket.MSG_DONTWAIT, sender)

    def _make_reply(self, question: bytes) -> bytes:
        names = [name for name in json.loads(question) if isinstance(name, str)]
        found = OtherSession(
            self._lease.domain_id,
            _program_name(),
            dict(self._offers(names[:MOST_NAMES])),
            port_bases.current_base(),
        )
        return json.dumps({**found._asdict(), "pid": os.getpid()}).encode()[:_MOST_BYTES]


def ask_other_sessions(
    names: Iterable[str], timeout: float = ANSWER_TIMEOUT_S
) -> list[OtherSession]:
    """Return the sessions of other processes that offer any of ``names``, by domain."""
    wanted = sorted(set(names))[:MOST_NAMES]
    found = []
    with new_socket() as sock:
        bind_anywhere(sock)
        question = json.dumps(wanted).encode()
        waiting = sum(claim.send(sock, question) for claim in all_claims())
        deadline = time.monotonic() + timeout
        while waiting and (left := deadline - time.monotonic()) > 0:
            sock.settimeout(left)
            try:
                answer = sock.recv(_MOST_BYTES)
            except TimeoutError:
                break
            waiting -= 1
            with suppress(ValueError, TypeError, KeyError, AttributeError):  # somebody else's bytes
                found += _parse_answer(json.loads(answer), wanted)
    return sorted(found)


def all_claims() -> list[Claim]:
    """Return the claims of all sessions that there may be on this machine."""
    bases = port_bases.known_bases()
    return [lease_claim(domain, base) for base in bases for domain in leasable_domains(base)]


def _parse_answer(answer: dict[str, Any], wanted: list[str]) -> list[OtherSession]:
    offers = {
        name: [str(node) for node in answer["offers"][name]]
        for name in wanted
        if name in answer["offers"]
    }
    if not offers or answer["pid"] == os.getpid():
        return []
    domain, base = int(answer["domain_id"]), int(answer["port_base"])
    return [OtherSession(domain, str(answer["program"]), offers, base)]


def _program_name() -> str:
    """Return what people know this program by: its notebook, or its file."""
    notebook = os.environ.get("JPY_SESSION_NAME", "")  # as Jupyter's server tells its kernels
    return Path(notebook or sys.argv[0] or "Python").name
