"""A consumer at the far end of a radio link that breaks down for a moment: real packet loss.

The far end is a DDS participant of its own. To break the link, every UDP packet is dropped that is
sent to this participant's ports, in the network namespace that examiner and subject have to
themselves (`autograder.processes.outside`). Everything is lost for as long as the gap lasts, and
nothing outside of it: so a design that recovers always does, one that does not never does, and
chance has no part in it.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import NotExaminable
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.processes.outside.warden_requests import CannotLoseError
from course.runtime.core_session import CoreSession

NOT_HERE = (
    "What becomes of lost packets could not be examined on this machine, which cannot make a "
    "network that loses them{why}. After a hand-in a person looks at it."
)


class RadioLink:
    """A radio link to a node of the examiner's that is far away.

    Attributes:
        node: the far one, for subscriptions and publishers.
    """

    def __init__(self, bench: CheckContext) -> None:
        """Bring up the far end, in the domain of the examiner's session."""
        self._outside = bench.outside
        before = _own_ports()
        self._session = CoreSession(domain_id=bench.session.domain_id)
        self.node = self._session.run(QuietNode, f"examiner_{secrets.token_hex(4)}_far")
        # What it shares with the near end is the multicast port, which only announces.
        self._ports = sorted(_own_ports() - before)
        if not self._ports:
            raise RuntimeError("the far end of the radio link has no UDP port of its own")

    @contextmanager
    def lose_packets(self) -> Iterator[None]:
        """Lose every packet to the far end for as long as the block lasts.

        Raises:
            NotExaminable: this machine cannot.
        """
        try:
            self._outside.ask("lose", ports=self._ports)
        except CannotLoseError as error:
            why = f" ({error})" if str(error) else ""
            raise NotExaminable(NOT_HERE.format(why=why)) from None
        try:
            yield
        finally:
            self._outside.ask("deliver")

    def close(self) -> None:
        """Take the far end down."""
        self._session.close()


@contextmanager
def open_radio_link(bench: CheckContext) -> Iterator[RadioLink]:
    """Give a radio link from the student's nodes to a node of the examiner's far away.

    Example, in a check of an `autograder.observe.relays.observed_process.ObservedProcess`::

        with open_radio_link(process.bench) as link:
            link.node.create_subscription(String, "emergency/stop", heard.append, reliable)
            with link.lose_packets():
                ...  # what is published now reaches the far end only if it is sent again

    Raises:
        NotExaminable: the network is not the subject's own: others' packets must not get lost.
    """
    if not bench.outside.own_network:
        raise NotExaminable(NOT_HERE.format(why=""))
    link = RadioLink(bench)
    try:
        yield link
    finally:
        link.close()


def _own_ports() -> set[int]:
    """Return the UDP ports that this process has bound, by IPv4."""
    inodes = set()
    for descriptor in Path("/proc/self/fd").iterdir():
        with suppress(OSError):  # the descriptor of this very listing
            inodes.add(str(descriptor.readlink()))
    lines = Path("/proc/self/net/udp").read_text().splitlines()[1:]
    rows = (line.split() for line in lines)
    return {int(row[1].rpartition(":")[2], 16) for row in rows if f"socket:[{row[9]}]" in inodes}
