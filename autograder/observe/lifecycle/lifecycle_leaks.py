"""What a lifecycle node leaves behind when it leaves a state: threads, files, memory, nodes."""

from __future__ import annotations

from collections import Counter

from autograder.examination.exam import Failed
from autograder.observe.graph.node_graph import node_phrase
from autograder.observe.lifecycle.flat_rounds import require_flat
from autograder.observe.lifecycle.lifecycle_manager import LifecycleManager
from autograder.observe.lifecycle.node_lives import GHOSTS_S, NodeLives
from autograder.observe.lifecycle.observer import Observer
from autograder.observe.patience import SETTLE_S
from autograder.observe.phrases import as_phrase

ACTIVE_S = 0.3
"""Seconds of simulated time for which a node is active in a round."""
FOUND_S = 3.0
"""Seconds in which a node in another context is found, as a participant of its own."""
TIME_STEP_S = 0.1
"""Seconds of simulated time in a step while a node is waited for that ends late."""
FIRST_ROUNDS = 2
"""From “configure” to “cleanup”, before those that are measured."""
UP, DOWN = ("configure", "activate"), ("deactivate", "cleanup")


class LifecycleLeaks:
    """Has a lifecycle node, which is unconfigured, go through its states, and sees what is left.

    Example::

        leaks = LifecycleLeaks(lives, manager)
        leaks.require_flat_rounds(10, kib_each=1024)
        leaks.require_threads_ended_when_inactive()
    """

    def __init__(self, lives: NodeLives, manager: LifecycleManager) -> None:
        """Have ``manager`` drive the node, one of ``lives``."""
        self._lives, self._manager = lives, manager

    def require_flat_rounds(self, rounds: int, kib_each: int) -> None:
        """Require that rounds from "configure" to "cleanup" leave nothing behind.

        Args:
            rounds: how many.
            kib_each: KiB of memory that each may keep.

        Raises:
            Failed: they leave nodes, threads or files, or each time more memory.
        """
        lives = self._lives
        lives.subject.collect()
        nodes, before = len(lives.list_made()), lives.process.read_usage()
        along = [before]

        def make_rounds() -> None:
            for _ in range(rounds):
                self._manager.make_transitions(*UP)
                lives.advance(ACTIVE_S)
                self._manager.make_transitions(*DOWN)
                along.append(lives.process.read_usage())

        make_rounds()
        leave = f"{rounds} rounds from “configure” to “cleanup” leave"
        if (more := len(lives.list_made()) - nodes) >= rounds / 2:
            raise Failed(
                expected=f"{leave} no node on the graph.",
                actual=f"There were {more} more nodes than before: your node makes helpers, and "
                "does not destroy them.",
            )
        require_flat(
            lives, before, rounds, what="rounds", kib_each=kib_each, again=make_rounds,
            along=along,
            expected=f"{leave} no thread, no file, and less than {kib_each} KiB of memory each.",
        )  # fmt: skip

    def require_threads_ended_when_inactive(self) -> None:
        """Require that no thread which was started by "activate" goes on after "deactivate".

        Raises:
            Failed: one does.
        """
        self._manager.make_transitions("configure")
        threads = self._lives.process.thread_ids()
        self._manager.make_transitions("activate")
        self._lives.advance(ACTIVE_S)
        self._manager.make_transitions("deactivate")
        self._lives.advance(ACTIVE_S)  # one that waits for the node's clock gets to see it
        self._lives.require_threads_ended(threads, "After “deactivate”")
        self._manager.make_transitions("cleanup")

    def require_no_helper_finalized(self) -> None:
        """Require that a node which was made for a state, and goes with it, goes with a shutdown.

        One that is made once and for all is there in the state unconfigured, too: it may stay until
        ``destroy_node()``.

        Raises:
            Failed: one stays.
        """
        lives = self._lives
        lives.subject.collect()  # an earlier life may have left a node in a context that goes on
        at_first = len(lives.list_made())
        self._manager.make_transitions(*UP, *DOWN)
        # Nodes go off the graph in their own time.
        lives.wait(lambda: len(lives.graph.list_nodes(process=True)) <= at_first, GHOSTS_S)
        idle, threads = lives.list_made(), lives.process.thread_ids()
        self._manager.make_transitions(*UP)
        started = lives.process.thread_ids() - threads
        self._manager.make_transitions("shutdown")
        if left := self._list_helpers(idle, started):
            raise Failed(
                expected="After shutdown in the state active your node holds nothing, no other "
                "node that it has made for this state either.",
                actual=f"{SETTLE_S:.0f} s later there still was "
                f"{as_phrase([node_phrase(name) for name in left])}: "
                "on_shutdown() runs then, and neither on_deactivate() nor on_cleanup() before it.",
            )

    def _list_helpers(self, idle: list[str], started: set[int]) -> list[str]:
        """Return the nodes that came since there were the ``idle`` ones, and do not go.

        A node alone in another context has ``started`` threads, and they end with it: it need not
        be seen off.
        """
        lives = self._lives

        def list_left() -> list[str]:
            has_ended = bool(started) and not started & lives.process.thread_ids()
            now = lives.graph.list_nodes(process=not has_ended)
            return list((Counter(now) - Counter(idle)).elements()) if len(now) > len(idle) else []

        lives.list_made()
        # One with threads of its own may be found later than a mark.
        lives.wait(lambda: list_left() or not started & lives.process.thread_ids(), FOUND_S)
        if list_left():
            lives.subject.collect()  # who shuts a helper's context down leaves the rest to Python
            lives.pass_time(lambda: not list_left(), TIME_STEP_S)
        return list_left()


def memory_kept(observer: Observer, manager: LifecycleManager, rounds: int) -> int:
    """Return the KiB of memory that each round through the states keeps, of so many.

    Some rounds are made before that: they may cost what no later ones do.
    """
    for number in (FIRST_ROUNDS, rounds):
        before = observer.process.read_usage()
        for _ in range(number):
            manager.make_transitions(*UP, *DOWN)
    return observer.process.read_usage().growth_since(before).memory // rounds
