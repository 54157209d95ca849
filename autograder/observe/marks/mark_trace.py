"""What became of marks that were sent into a design: whether they arrived, or how far they got."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from autograder.examination.exam import Failed
from autograder.observe.phrases import as_phrase


@dataclass(frozen=True)
class Trace:
    """What became of marks.

    Attributes:
        wanted: names of topics: a mark has arrived that was seen on one of them.
        sent: the marks that were sent, and taken.
        arrived: those that arrived.
        is_enough: whether enough of them did.
        lost_on: topics on which marks were seen that did not arrive.
        remark: what else is to be said if it is not enough, as a clause that begins with "; ".

    Example:
        >>> trace = Trace(["/motors/command"], {1, 2}, set(), False, ["/velocity"])
        >>> trace.require_arrival("a scan on /scan")
        Traceback (most recent call last):
        autograder.examination.exam.Failed: expected: The mark of a scan on /scan is seen on \
/motors/command. observed: It was seen on /velocity, but never on /motors/command.
    """

    wanted: Collection[str]
    sent: Collection[int]
    arrived: Collection[int]
    is_enough: bool
    lost_on: Sequence[str] = ()
    remark: str = ""

    def require_arrival(self, of: str) -> None:
        """Require that enough marks have arrived.

        Args:
            of: what bore the mark, as a phrase: "a scan on /scan".

        Raises:
            Failed: it is not enough; says how far they got.
        """
        if not self.is_enough:
            raise self.finding(of)

    def finding(self, of: str) -> Failed:
        """Return the finding that too few marks have arrived, of what bore them."""
        there = as_phrase(self.wanted, "or")
        way = f"{as_phrase(self.lost_on)}, but" if self.lost_on else "no topic, and so"
        actual = f"It was seen on {way} never on {there}"
        if self.arrived:
            actual = (
                f"Of {len(self.sent)} marks {len(self.arrived)} was seen on {there}; the others "
                f"were seen on {way} never there"
            )
        return Failed(
            expected=f"The mark of {of} is seen on {there}.", actual=f"{actual}{self.remark}."
        )

    def joined_with(self, later: Trace) -> Trace:
        """Return what became of both, where enough of ``later`` must have arrived, too."""
        return replace(
            later,
            sent={*self.sent, *later.sent},
            arrived={*self.arrived, *later.arrived},
        )
