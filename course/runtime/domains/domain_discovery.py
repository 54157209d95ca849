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
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from course.runtime.domains.leases import MAX_DOMAIN, MIN_DOMAIN, DomainLease, lease_address

ANSWER_TIMEOUT_S = 0.5
"""Seconds within which a session answers, unless its process is stopped."""

DOMAINS: Sequence[int] = range(MIN_DOMAIN, MAX_DOMAIN + 1)
"""The domains whose sessions are asked: all that a session can lease."""

MOST_NAMES = 100
_MOST_BYTES = 64 * 1024

Offers = Callable[[list[str]], Mapping[str, list[str]]]
"""Returns who offers each of these names, as far as anybody does: fully qualified node names."""


class OtherSession(NamedTuple):
    """A session of another program: its domain, the program's name, and what it offers of it."""

    domain_id: int
    program: str
    offers: dict[str, list[str]]


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
        with suppress(OSError):  # it is closed
            self._lease.socket.shutdown(socket.SHUT_RD)
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
            self._lease.domain_id, _program_name(), dict(self._offers(names[:MOST_NAMES]))
        )
        return json.dumps({**found._asdict(), "pid": os.getpid()}).encode()[:_MOST_BYTES]


def ask_other_sessions(
    names: Iterable[str], timeout: float = ANSWER_TIMEOUT_S
) -> list[OtherSession]:
    """Return the sessions of other processes that offer any of ``names``, by domain."""
    wanted = sorted(set(names))[:MOST_NAMES]
    found = []
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as sock:
        sock.bind("")  # the kernel chooses an address, for the answers
        waiting = sum(
            _send_question(sock, json.dumps(wanted).encode(), domain) for domain in DOMAINS
        )
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


def _send_question(sock: socket.socket, question: bytes, domain_id: int) -> bool:
    try:
        sock.sendto(question, socket.MSG_DONTWAIT, lease_address(domain_id))
    except OSError:  # nobody has leased it, or nobody reads there
        return False
    return True


def _parse_answer(answer: dict[str, Any], wanted: list[str]) -> list[OtherSession]:
    offers = {
        name: [str(node) for node in answer["offers"][name]]
        for name in wanted
        if name in answer["offers"]
    }
    if not offers or answer["pid"] == os.getpid():
        return []
    return [OtherSession(int(answer["domain_id"]), str(answer["program"]), offers)]


def _program_name() -> str:
    """Return what people know this program by: its notebook, or its file."""
    notebook = os.environ.get("JPY_SESSION_NAME", "")  # as Jupyter's server tells its kernels
    return Path(notebook or sys.argv[0] or "Python").name
