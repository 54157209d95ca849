"""Looks at nodes in a plain program, where nobody but the machine tells what time it is."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node

from autograder.examination.exam import Failed, NotExaminable
from autograder.examination.plain_programs import Program, Programs
from autograder.observe.lifecycle.node_lives import NodeLives
from autograder.observe.lifecycle.observer import ENDED_S, Observer
from autograder.observe.lifecycle.process_holdings import Usage, kept_each, list_kept
from autograder.observe.participants import node_of, of_others
from autograder.observe.patience import SETTLE_S
from autograder.observe.phrases import capitalize_first
from autograder.observe.programs.wall_rate import find_wrong_rate
from autograder.processes.outside.asking import Outside


class ProgramObserver(Observer):
    """Someone in the network of a plain program; waits for nothing once the program has ended.

    Attributes:
        program: to be interrupted.
        faults: what was wrong so far.
        usages: what the program held after each round.

    Example::

        with rig.programs.program([("Talker", [])]) as program:
            seen = ProgramObserver(program, rig.outside, QuietNode)
            assert seen.wait(lambda: seen.node.count_publishers("chatter"))
            program.interrupt()  # Ctrl-C
            assert seen.wait_for_end(lambda: not seen.node.count_publishers("chatter"))
    """

    def __init__(self, program: Program, outside: Outside, node: Callable[[], Node]) -> None:
        """Bring up the examiner's ``node`` in the network of ``program``."""
        super().__init__(program.session, outside, program.session.run(node))
        self.program = program
        self.faults: Faults = {}
        self.usages: list[Usage] = []

    def is_gone(self) -> bool:
        """Whether the program has ended."""
        return self.program.has_ended()

    def find_nodes(self) -> dict[bytes, str]:
        """Return the program's nodes on the graph, by what each of them publishes on."""
        ends = of_others(self.node.get_publishers_info_by_topic("/parameter_events"))
        return {bytes(end.endpoint_gid): node_of(end) for end in ends}

    def rate_fault(self, count: Callable[[], int], hz: float, what: str = "messages") -> str:
        """Return how many messages come in what time, unless at about a rate; see `wall_rate`."""
        if (take := find_wrong_rate(self, count, hz)) is None:
            return ""
        number = "one" if take.came == 1 else str(take.came)
        return capitalize_first(f"{number} {what} came in {take.seconds:.1f} s.")

    # What it holds.

    def note_usage(self) -> None:
        """Note what the program holds after a round, once no more goes that is given a second.

        Where a round has left something, each may: that is waited for at the end of them.
        """
        self.wait_for_rest()  # a node may be off the graph, and its last threads go just now
        before = self.usages[-1] if self.usages else None
        if before is not None and not list_kept(before.growth_since(self.usages[-2:][0])):
            # Memory is not waited for: a thread that ends gives it back, or nobody.
            self.wait_for_end(lambda: not list_kept(self._grown_since(before)))
        self.usages.append(self.process.read_usage())

    def list_leaks(self, memory_kib: int) -> list[str]:
        """Return what each round has left behind, a phrase each, unless it goes by itself.

        A thread that looks every few seconds whether it is to end is too slow, and no leak. One
        that does not sleep for a time does not wake up by itself.

        Args:
            memory_kib: KiB a round from which on memory counts.
        """
        rounds, first = len(self.usages) - 1, self.usages[0]

        def list_left() -> list[str]:
            each = Usage(*(more // rounds for more in self._grown_since(first)))
            return list_kept(each, memory_kib)

        leaks = list_kept(kept_each(self.usages), memory_kib)
        if leaks and (wakes := self.process.wake_times()):
            late_s = min(SETTLE_S, max(wakes) + ENDED_S)
            return [] if self.wait(lambda: not list_left(), late_s) else leaks
        return leaks

    def _grown_since(self, before: Usage) -> Usage:
        return self.process.read_usage().growth_since(before)

    # What is wrong.

    def note_fault(self, check: str, expected: str, actual: str) -> None:
        """Note what is wrong, and in which check it counts; the first of each counts."""
        self.faults.setdefault(check, Failed(expected=expected, actual=actual))


Faults = dict[str, Failed | NotExaminable]
"""What is wrong in a plain program, by the name of the check in which it counts."""


def require_no_fault(lives: NodeLives, check: str, watch: Callable[[Programs], Faults]) -> None:
    """Require that a plain program has shown nothing against a check.

    Where there are no such programs, as in a student's own kernel, nothing is seen.

    Args:
        lives: of the same nodes in the subject.
        check: its name.
        watch: runs the program and returns what was wrong; it is called once a notebook.

    Raises:
        Failed: it has shown something.
        NotExaminable: a person has to look at it.
    """
    if lives.programs is not None:
        if watch.__qualname__ not in lives.memory:
            lives.memory[watch.__qualname__] = watch(lives.programs)
        if fault := lives.memory[watch.__qualname__].get(check):
            raise fault
