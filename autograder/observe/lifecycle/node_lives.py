"""Lives of the student's nodes: made, looked at, and ended, one after the other in one process.

Time is simulated, and only the examiner moves it. What a wrong design has left behind in one check
is not held against it in the next.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, Self

from rclpy.node import Node

from autograder.examination.check_context import (
    PATIENCE_S,
    REPLY_TIMEOUT_S,
    CheckContext,
    StudentError,
    SubjectGone,
)
from autograder.examination.exam import Failed
from autograder.observe.graph.node_graph import NODE, NodeGraph
from autograder.observe.lifecycle.observer import ENDED_S, Observer
from autograder.observe.nouns import Service, Topic
from autograder.observe.patience import SETTLE_S
from autograder.observe.phrases import as_phrase, capitalize_first
from course.runtime.waiting import Deadline

GHOSTS_S = 1.0
"""Seconds that endpoints of an earlier life are given to go off the graph."""
WAKES_S = 3.0
"""Seconds of wall time in which a thread does something that it has been given."""


class NodeLives(Observer):
    """Makes nodes of the notebook's classes and ends them, in every way in which a program may.

    Attributes:
        subject: the student's process.
        graph: the endpoints that its nodes have.
        draws: the numbers of this examination.
        memory: what checks found that others need.
        provoked: whether callbacks were made to raise in this session: the next life has a new one,
            in which that explains nothing.

    Example::

        with lives.life("Talker") as node:
            lives.require_endpoints(node)
            lives.stop("Talker", bare=True)
            lives.require_gone(node, "After destroy_node()")
    """

    def __init__(
        self,
        bench: CheckContext,
        node: Callable[[], Node],
        *,
        publishes: Sequence[Topic] = (),
        subscribes: Sequence[Topic] = (),
        serves: Sequence[Service] = (),
    ) -> None:
        """Bring up the examiner's node; the student's come with `life`.

        Args:
            bench: what a check works with.
            node: makes the examiner's node.
            publishes: topics that the student's nodes publish on.
            subscribes: topics that they listen to.
            serves: their services.
        """
        super().__init__(bench.session, bench.outside, bench.session.run(node))
        self.subject, self.programs = bench.subject, bench.programs
        self.draws, self.memory = bench.draws, bench.memory
        self.graph = NodeGraph(self.node, publishes=publishes, subscribes=subscribes, serves=serves)
        self.provoked = False
        self._clean = False
        self._leaves_ghosts = False

    def __enter__(self) -> Self:
        """Give itself to the checks of an exam."""
        return self

    def __exit__(self, *error: object) -> None:
        """Leave the examiner's node to its session, which takes it down."""

    # A life.

    @contextmanager
    def life(self, name: str, *args: Any) -> Iterator[str]:
        """Give the full name of a node of the class ``name`` for one life.

        It is stopped at the end, unless it is destroyed by then. What its cleanup raises then is
        for another check to find.
        """
        with self.clean_session():
            node = self.start(name, *args)
            yield node
        try:
            self.subject.stop(name)
            self._clean = self._has_vanished(node)
        except StudentError:
            self._clean = False

    def _has_vanished(self, node: str) -> bool:
        """Whether a node that was stopped goes off the graph.

        rclpy 7.1 leaves the services of a destroyed lifecycle node there until it is collected; the
        next node of that name must not be taken for it.
        """
        service = f"{node}/get_state"
        if self.node.count_services(service):
            self.subject.collect()
        return self.wait(lambda: not self.node.count_services(service))

    @contextmanager
    def clean_session(self) -> Iterator[None]:
        """Begin with a clean session, and leave none to the next check if this one fails."""
        if not self._clean or self.provoked:
            self.subject.open(sim_time=True)
            self.provoked = False
        # A design that has left some once leaves them each time, and they are told from new ones.
        if not self._leaves_ghosts:
            self._leaves_ghosts = not self.wait(lambda: not self.graph.list_endpoints(), GHOSTS_S)
        self.graph.ignore_present()
        self._clean = False
        yield
        self._clean = True

    # The beginning and the end of a node.

    def start(self, name: str, *args: Any) -> str:
        """Make a node; return its full name.

        Raises:
            Failed: its constructor raised.
        """
        try:
            node = self.subject.start(name, *args)
        except StudentError as error:
            shown = ", ".join(repr(arg) for arg in args)
            raise Failed(
                expected=f"{name}({shown}) makes a node without an error.",
                actual=error.feedback_text,
            ) from None
        self.graph.note_started(node)
        return node

    def stop(self, name: str, *, bare: bool = False) -> None:
        """Have a node taken out of its executor and destroyed.

        A session tidies up after its ``destroy_node()``; ``bare``: nobody does.

        Raises:
            Failed: it raised.
        """
        with _without_error(name):
            self.subject.stop(name, bare=bare)

    def destroy(self, name: str) -> None:
        """Have ``destroy_node()`` called while the node spins.

        Raises:
            Failed: it raised.
        """
        with _without_error(name):
            self.subject.call(name, "destroy_node")

    def destroy_again(self, name: str) -> None:
        """Have ``destroy_node()`` called a second time, which must return as well.

        Raises:
            Failed: it raised, or did not return.
        """
        try:
            self.destroy(name)
        except SubjectGone as gone:
            if not self.subject.hangs:
                raise
            raise Failed(
                expected="destroy_node() can be called a second time.",
                actual=f"The second call did not return within {REPLY_TIMEOUT_S:.0f} s.",
            ) from gone

    def drop_node(self, name: str) -> None:
        """Have the session let go of a node that is destroyed; it destroys it once more."""
        with suppress(StudentError):
            self.subject.stop(name)

    # Time.

    def advance(self, seconds: float) -> None:
        """Move simulated time on.

        Raises:
            Failed: a callback held it up.
        """
        try:
            self.subject.advance(seconds)
        except StudentError as error:
            raise Failed(
                expected="Your callbacks return, and your node follows the robot's time.",
                actual=f"{_what_held_up(str(error))}{self.error_note()}.",
            ) from None

    def pass_time(self, condition: Callable[[], object], step_s: float) -> bool:
        """Let simulated time pass step by step until a condition holds; return whether it does.

        Each step is given as much wall time: endpoints find each other in their own time, and what
        is sent before is lost.

        Args:
            condition: is looked at after each step.
            step_s: seconds of a step.

        Raises:
            Failed: a callback held time up.
        """
        patience = self.start_patience()
        for _ in range(int(SETTLE_S / step_s)):
            self.advance(step_s)
            if self.wait(condition, step_s if patience.has_time_left() else 0.0):
                return True
        return False

    def nudge(self) -> None:
        """Give the subject's executors something to do, and no timer a reason to fire.

        rclpy 7.1 resumes a callback that awaits something when its executor has something else to
        do: on a robot, at the next tick. Here it learns that a nanosecond has passed.
        """
        self.subject.nudge()

    # What is seen.

    def error_note(self) -> str:
        """Return what the student's callbacks raised, as the end of a sentence."""
        raised, ended = self.subject.errors(), self.subject.thread_errors()
        told = [f"a callback raised: {raised[-1].rstrip('.')}"] if raised else []
        told += [f"a thread of yours ended with {ended[-1].rstrip('.')}"] if ended else []
        return f" ({as_phrase(told)})" if told else ""

    def catch_up(self) -> None:
        """Wait until every endpoint that the subject has by now is known here.

        A participant's endpoints are told in order: those of a mark that is made now come last.
        """
        mark = f"mark_{secrets.token_hex(4)}"
        self.graph.note_mark(mark)
        self.subject.mark(mark)
        self.wait(lambda: self.node.count_publishers(mark) and self.node.count_subscribers(mark))

    def require_endpoints(self, node: str) -> None:
        """Require that the endpoints are all on the graph, with their types, and ``node`` itself.

        Only what was seen to be there can be seen to go.

        Raises:
            Failed: one is missing, or of another type.
        """
        if not self.wait(lambda: not self.graph.list_missing(node)):
            raise Failed(
                expected="The node has the endpoints of the task.",
                actual=" ".join(self.graph.list_missing(node)),
            )

    def require_gone(
        self,
        node: str,
        when: str,
        count: Callable[[], int] | None = None,
        what: str = "messages",
    ) -> None:
        """Require that no endpoint of a node is on the graph, nor a node that it made.

        Args:
            node: its full name.
            when: what has ended it, to begin a sentence with.
            count: returns how many messages it has sent, if that is known.
            what: what they are called.

        Raises:
            Failed: one is; it is also told how much it goes on to send.
        """
        if self.wait(lambda: not self.graph.list_leftovers(node), idle=ENDED_S):
            return
        when_seen = self.end_of_wait
        self.catch_up()  # what was said of an end by then may have been lost, and is said again
        if not (left := self.graph.list_leftovers(node)):
            return
        before = count() if count else 0
        self.advance(1.0)
        sent = count() - before if count else 0
        more = f" In one more second {sent} {what} came." if sent else ""
        if f"{NODE}{node}" in left:
            more += " Only the inherited destroy_node() takes a node down."
        raise Failed(
            expected=f"{when} no endpoint of the node is on the graph.",
            actual=f"{capitalize_first(when_seen)} there still was {as_phrase(left)}.{more}",
        )

    def list_made(self) -> list[str]:
        """Return the nodes of the student's that there are by now, in whichever context."""
        self.catch_up()
        # The mark is in one context; what others have told is here when all is at rest.
        self.wait_for_rest()
        return self.graph.list_nodes(process=True)

    def require_callbacks_ended(self, among: set[int], usual: int, when: str) -> None:
        """Require that no callback of a node that was taken down goes on for ever.

        A session gives such a callback's thread up and goes on with a new one, which works when the
        session has something to do. A thread that does not was left by the node.

        Args:
            among: the threads that there were before.
            usual: how many threads there are without the node.
            when: what has ended it, to begin a sentence with.

        Raises:
            Failed: one does.
        """

        def new_threads() -> set[int]:
            now = self.process.thread_ids()
            return now - among if len(now) > usual else set()

        if self.wait(lambda: not new_threads()):
            return
        when_seen, naps = self.end_of_wait, self.process.count_naps(new_threads())
        self.catch_up()

        def is_working() -> bool:
            now = self.process.count_naps(naps)
            return any(number > naps[thread] for thread, number in now.items())

        if self.wait(is_working, WAKES_S):
            raise Failed(
                expected=f"{when} every callback of the node comes to its end.",
                actual=f"One was still waiting {when_seen}. The thread that runs it is lost: a "
                "program with that one thread takes up no callback ever again.",
            )

    def require_threads_ended(self, among: set[int], when: str) -> None:
        """Require that no thread goes on that is here now and is not ``among`` those of before.

        Raises:
            Failed: one does, although it had as long as a busy machine needs.
        """
        new = self.process.thread_ids() - among

        def is_over() -> bool:
            return not new & self.process.thread_ids()

        deadline = Deadline(SETTLE_S)
        if self.wait_for_end(is_over, among=new):
            return
        # A busy machine may not have come to it yet. But when all is at rest, who is left waits.
        self.wait(lambda: is_over() or self.wait_for_rest(), deadline.seconds_left)
        if left := len(new & self.process.thread_ids()):
            raise Failed(
                expected=f"{when} every thread of your node has ended, within a second.",
                actual=f"{SETTLE_S - deadline.seconds_left:.1f} s later {left} of the threads that "
                "it had started were still there. If you start a thread, tell it to end, and wake "
                "it if it sleeps; if you make a thread pool, shut it down."
                f"{self.process.others_note()}",
            )


@contextmanager
def _without_error(name: str) -> Iterator[None]:
    try:
        yield
    except StudentError as error:
        raise Failed(
            expected=f"destroy_node() of {name} ends without an error.",
            actual=error.feedback_text,
        ) from None


def _what_held_up(error: str) -> str:
    """Return why simulated time could not be moved on, from the session's error."""
    found = re.fullmatch(r"\w+: (.+) did not follow simulated time to ([\d.]+) s: .*", error, re.S)
    if found is None:
        return error.rstrip(".")
    if found[1] == "the session":  # all nodes know the time: something goes on without end
        return (
            f"At {found[2]} s of the robot's time your program did not come to rest: for "
            f"{PATIENCE_S:.0f} s there always was a callback running, or the next one ready"
        )
    return (
        f"At {found[2]} s of the robot's time a callback of {found[1]} had been running for "
        f"{PATIENCE_S:.0f} s"
    )
