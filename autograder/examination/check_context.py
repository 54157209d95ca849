"""What a check works with: the examiner's own session, and its grip on the subject."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from autograder.examination.draws import USUAL_SEED, Draws
from autograder.examination.plain_programs import Programs
from autograder.examination.verdict import Progress
from autograder.processes.channel import Channel, ChannelBroken, ChannelClosed, ChannelTimeout
from autograder.processes.fair_deadline import FairDeadline, RunDelay, of_process
from autograder.processes.outside.asking import Outside
from course.runtime.core_session import CoreSession

REPLY_TIMEOUT_S = 10.0
"""Seconds a subject may take over one request (making a node, say) before it counts as hung."""

ALL_REPLIES_TIMEOUT_S = 150.0
"""Seconds that all replies of an examination may take together: the slowest right driver that is
known, which needs a second to start and another one to end, comes to 85 s; most come to 10 s."""

QUICK_REPLY_S = 0.5
"""Seconds in which most replies come: of such a reply, the whole time counts."""

MAX_REPLY_BYTES = 512 * 1024
"""Bytes of a reply that are received; the subject server cuts values and errors well below it."""

MAX_NOTES = 200
"""Nodes, errors and waits that a reply may list."""

MAX_ERROR, MAX_TRACE, MAX_NAME = 2000, 4000, 500
"""Characters of an error, of where it came from, and of a node's or a label's name."""
NODE_NAME = re.compile(r"(?=.{2,200}$)(/[A-Za-z_][A-Za-z0-9_]*)+", re.ASCII)
"""What a node can be called (ROS 2 design, "Topic and Service name mapping"), if not longer."""

MAX_STEPS, MAX_STEP_CHARS = 40, 300
"""Steps of a check that are kept for its author, and characters of each."""

PATIENCE_S = 3.0
"""Seconds of wall time that a callback of a subject's may hold up a step of simulated time."""

Endpoints = Mapping[str, Sequence[str]]
"""Names of topics and services by kind: "publishers", "subscribers", "services", "clients"."""


T = TypeVar("T")


class SubjectGone(Exception):  # noqa: N818 - it is a finding, not a fault of ours
    """The subject's process ended, or does not answer any more; the message says how."""


class StudentError(Exception):
    """The student's code raised while carrying out a request; the message is its error.

    Or there is nothing that could carry it out: then the message is a sentence that says so.
    """

    def __init__(self, error: str, trace: str = "", *, missing: bool = False) -> None:
        """Keep the student's error and where in their code it came from."""
        super().__init__(error)
        self.trace = trace
        self.missing = missing

    @property
    def feedback_text(self) -> str:
        """Return what was raised, and where in the student's own lines, as feedback tells it."""
        if self.missing:
            return str(self)
        where = f" It happened here:\n{self.trace}" if self.trace else ""
        return f"It raised {str(self).rstrip('.')}.{where}"


class Subject:
    """The examiner's end of the control channel. It asks; it does not believe.

    What is no answer to what was asked comes from the student's code, not from the subject server:
    it ends the examination like a process that ended.

    ``name`` is always a name of the notebook's: of a class, or of anything that makes a node.
    ``hangs`` says in a sentence that the subject did not answer in time, once it did not.
    """

    def __init__(self, channel: Channel) -> None:
        """Talk to the subject server over ``channel``."""
        self._channel = channel
        self._gone: str | None = None
        self._left = ALL_REPLIES_TIMEOUT_S
        self.hangs = ""
        self.delay: RunDelay = of_process(0)  # by which its deadlines are put off

    def open(self, *, threads: int = 1, sim_time: bool = False) -> None:
        """Begin a new session on the subject's side; nodes of an earlier one are stopped.

        These are collected as garbage, too, as `collect` does.

        Without it, the first `start` begins one with a single thread and wall-clock time.

        Args:
            threads: how many threads run the nodes' callbacks.
            sim_time: the nodes follow simulated time, which only `advance` moves.
        """
        self._ask_harness("open", "a session", threads=threads, sim_time=sim_time)

    def start(self, name: str, *args: Any) -> str:
        """Make a node of a class of the notebook and spin it; return its fully qualified name.

        Args:
            name: the class.
            args: what its constructor is given, as JSON. Nobody tidies up after one that raises:
                what is then left is the class's own doing.

        Raises:
            StudentError: the class is missing or its constructor raised.
            SubjectGone: the process ended or hangs.
        """
        reply = self._ask_harness("start", name, args=args)
        return self._node_name(reply)

    def start_all(self, name: str) -> dict[str, str]:
        """Make every node that an object of the notebook declares; return {label: node name}.

        The object has ``node_factories()``, which gives {label: factory}. Each node is afterwards
        known as ``"<name>.<label>"`` to the other requests.

        Raises:
            StudentError: the object is missing or declares nothing, or a node could not be made.
        """
        reply = self._ask_harness("declare", name, doing=f"bring up the nodes of `{name}`")
        labels = self._read_reply(lambda: _bounded_texts(reply["labels"], MAX_NAME))
        if not labels:
            raise StudentError(
                f"`{name}` declares no nodes: its node_factories() gave none.", missing=True
            )
        # One by one: if a constructor does not return, it is known whose.
        return {label: self._start_declared(name, label) for label in labels}

    def _start_declared(self, name: str, label: str) -> str:
        doing = f"bring up the nodes of `{name}`, and {label[:60]} did not come up"
        reply = self._ask_harness("start_declared", name, label=label, doing=doing)
        return self._node_name(reply)

    def _node_name(self, reply: dict[str, Any]) -> str:
        """Return the name of the node in a reply, of which names of its services are made.

        Raises:
            StudentError: it is none that a node can have: a class may override how it is asked.
        """
        name = self._read_reply(lambda: _bounded_text(reply["node"], MAX_NAME))
        if not NODE_NAME.fullmatch(name):
            raise StudentError(f"A node cannot be called {name[:60]!r}.", missing=True)
        return name

    def mark(self, name: str) -> None:
        """Make a node called ``name`` with one publisher and one subscription on topic ``name``.

        DDS announces a process's endpoints in order: once both are on the graph, so is everything
        that the subject's nodes had before. So what is missing then is missing, not late.
        """
        self._ask_harness("mark", name, doing="make a small node beside yours")

    def stop(self, name: str, *, bare: bool = False) -> None:
        """Destroy the node made of a class, as a session does: its ``destroy_node`` is called.

        Args:
            name: the class.
            bare: nobody tidies up after ``destroy_node``, as in a program without a session, and
                the program still refers to the node, until it is stopped once more.
        """
        self._ask_harness("stop", name, bare=bare)

    def collect(self) -> None:
        """Have Python free what nobody refers to any more.

        A node and its callbacks refer to each other: without it a destroyed node stays in memory,
        and a lifecycle node's own services on the graph, until Python happens to look.
        """
        self._ask_harness("collect", "garbage")

    def pause(self, name: str) -> None:
        """Stop executing the node's callbacks while its endpoints go on receiving."""
        self._ask_harness("pause", name)

    def resume(self, name: str) -> None:
        """Execute the node's callbacks again, beginning with what queued up."""
        self._ask_harness("resume", name)

    def advance(self, seconds: float, step: float = 0.01) -> bool:
        """Move simulated time on (see `course.Session.sim`); needs `open` with ``sim_time``.

        Returns:
            Whether some callback has begun, and not ended by now.

        Raises:
            StudentError: a callback held up a step for longer than PATIENCE_S.
            SubjectGone: it does not answer at all.
        """
        reply = self._ask_harness(
            "advance", f"{seconds:g} s of simulated time", REPLY_TIMEOUT_S + PATIENCE_S,
            seconds=seconds, step=step, patience=PATIENCE_S,
        )  # fmt: skip
        return self._read_reply(lambda: bool(reply["goes_on"]))

    def nudge(self) -> None:
        """Tell its nodes that a nanosecond of simulated time has passed; wait for no callback."""
        self._ask_harness("nudge", "", doing="tell its nodes that time goes on")

    def call(self, name: str, method: str, *args: Any, timeout: float = REPLY_TIMEOUT_S) -> Any:
        """Call a method of the node made of a class, in the main thread, while the node spins.

        Args:
            name: the class.
            method: its method; ``args`` are passed on and must be JSON.
            timeout: seconds until it counts as hung.

        Returns:
            What the method returned, if that is JSON; else its ``repr``. It is no evidence.

        Raises:
            StudentError: there is no such method, or it raised.
            SubjectGone: the process ended or the method hangs.
        """
        reply = self._ask_harness(
            "call", f"{name}.{method}()", timeout, node=name, method=method, args=args
        )
        return reply.get("value")

    def value(self, name: str) -> Any:
        """Return a variable of the notebook as JSON data: numbers, strings, lists and dicts.

        Raises:
            StudentError: there is no such variable, or it is made of something else.
        """
        reply = self._ask_harness("value", name, doing=f"read the variable `{name}`")
        return self._read_reply(lambda: reply["value"])

    def sees(self, name: str, endpoints: Endpoints) -> dict[str, dict[str, int]]:
        """Return how many endpoints of a kind and name the node made of a class has discovered.

        For waiting, never as evidence: DDS discovers in both directions, each in its own time, and
        what is sent before the other side knows of it is lost.

        Args:
            name: the class.
            endpoints: names of topics and services by kind: "publishers", "subscribers",
                "services", "clients".
        """
        wanted = {kind: list(names) for kind, names in endpoints.items()}
        reply = self._ask_harness(
            "sees", name, endpoints=wanted, doing=f"say what the node of `{name}` has discovered"
        )
        return self._read_reply(
            lambda: {
                kind: {n: int(reply["counts"][kind][n]) for n in names}
                for kind, names in wanted.items()
            }
        )

    def wall_waits(self) -> list[str]:
        """Return which callbacks wait by the wall clock now, and where, a phrase each.

        Each is like ``wait_for_service: Asker.ask of /asker (at line 7: ...)``, where the method is
        rclpy's, or without it: see `autograder.examination.subject.wall_waits`.
        """
        reply = self._ask_harness("wall_waits", "", doing="say what its callbacks wait for")
        return self._read_reply(lambda: _bounded_texts(reply["waits"], MAX_ERROR))

    def errors(self) -> list[str]:
        """Return what the student's callbacks raised: for an explanation, never as evidence."""
        reply = self._ask_harness("errors", "", doing="list its errors")
        return self._read_reply(lambda: _bounded_texts(reply["errors"], MAX_ERROR))

    def thread_errors(self) -> list[str]:
        """Return what ended threads of the student's: for an explanation, never as evidence."""
        reply = self._ask_harness("errors", "", doing="list its errors")
        return self._read_reply(lambda: _bounded_texts(reply["of_threads"], MAX_ERROR))

    def own_errors(self) -> dict[str, int]:
        """Return what left the student's callbacks and was raised by a line of theirs, how often.

        What rclpy raised, in a call of theirs or elsewhere, is not among it: that may be a race of
        its own.
        """
        reply = self._ask_harness("own_errors", "", doing="list its errors")
        return self._read_reply(
            lambda: {
                _bounded_text(error["told"], MAX_ERROR): int(error["count"])
                for error in reply["errors"][:MAX_NOTES]
            }
        )

    def show(self, progress: Progress) -> None:
        """Have a notebook show how far its examination is."""
        doing = "show how far its examination is"
        self._ask_harness("show", "", progress=progress.as_data(), doing=doing)

    def _ask_harness(
        self,
        operation: str,
        what: str,
        timeout: float = REPLY_TIMEOUT_S,
        *,
        doing: str = "",
        **more: Any,
    ) -> dict[str, Any]:
        if self._gone:
            raise SubjectGone(self._gone)
        doing = doing or f"{operation.replace('_', ' ')} {what}"
        try:
            self._channel.send({"op": operation, "name": what, **more})
            with self._count_time():
                reply = self._channel.receive_fairly(min(timeout, self._left), self.delay)
        except ChannelBroken as error:
            raise self._channel_error(str(error)) from None
        except ChannelClosed:
            self._gone = f"Your program ended while it was asked to {doing}."
            raise SubjectGone(self._gone) from None
        except ChannelTimeout:
            self._gone = (
                f"Your program did not answer within {timeout:.0f} s when it was asked to "
                f"{doing}: does a constructor, a callback or a cleanup wait for ever?"
                if self._left
                else f"Your program took {ALL_REPLIES_TIMEOUT_S:.0f} s in all for what it was "
                f"asked to do, the last of which was to {doing}: which constructor, callback or "
                "cleanup takes so long each time?"
            )
            self.hangs = self._gone
            raise SubjectGone(self._gone) from None
        if "missing" in reply:
            missing = self._read_reply(lambda: _bounded_text(reply["missing"], MAX_ERROR))
            raise StudentError(missing, missing=True)
        if not reply.get("ok"):
            raised = self._read_reply(lambda: _bounded_text(reply["error"], MAX_ERROR))
            raise StudentError(
                raised, self._read_reply(lambda: _bounded_text(reply.get("trace", ""), MAX_TRACE))
            )
        return reply

    @contextmanager
    def _count_time(self) -> Iterator[None]:
        """Count the time of the block, as far as the subject was not kept from running by others.

        At least a third of it counts: a reply can be put off no further. Of a quick one all counts,
        because asking how much to leave out would take as long.
        """
        began, mark = time.monotonic(), self.delay.mark()
        try:
            yield
        finally:
            took = time.monotonic() - began
            if took > QUICK_REPLY_S:
                took = max(took / 3, took - self.delay.delay_since(mark))
            self._left = max(0.0, self._left - took)

    def _read_reply(self, found: Callable[[], T]) -> T:
        """Return what is found in a reply, if it is one of the subject server's.

        Raises:
            SubjectGone: it is not.
        """
        try:
            return found()
        except (LookupError, TypeError, ValueError, ArithmeticError):
            raise self._channel_error("it is no answer to what was asked") from None

    def _channel_error(self, how: str) -> SubjectGone:
        self._gone = f"Something in the notebook wrote to the grader's own channel: {how}."
        return SubjectGone(self._gone)

    def release(self) -> None:
        """Let the subject server go: it stops its nodes and returns to the code that started it."""
        try:
            self._channel.send({"op": "done"})
        except ChannelClosed:
            self._gone = self._gone or "Your program ended."


def _bounded_text(found: Any, most: int) -> str:
    if not isinstance(found, str):
        raise TypeError("no text")
    return found[:most]


def _bounded_texts(found: Any, most: int) -> list[str]:
    if not isinstance(found, list):
        raise TypeError("no list")
    return [_bounded_text(line, most) for line in found[:MAX_NOTES]]


class CheckContext:
    """The examiner's session on the subject's domain, and the subject."""

    def __init__(
        self,
        session: CoreSession,
        subject: Subject,
        outside: Outside,
        seed: int = USUAL_SEED,
        programs: Programs | None = None,
        ends: bool = False,
    ) -> None:
        """Put both within a check's reach.

        ``outside`` looks at the subject's processes. ``seed`` is what the numbers of the exam are
        drawn from. ``programs`` runs the notebook's nodes in programs of their own, for a
        submission in a sandbox. ``ends`` says that all processes end with this exam: what is left
        up is not taken down.

        Attributes:
            memory: what checks found that others need.
            key: the answer key of the part that is examined; the subject never sees it.
            steps: what the present check has done and seen so far.
        """
        self.ends = ends
        self.programs = programs
        self.session = session
        self.subject = subject
        self.memory: dict[str, Any] = {}
        self.key: Mapping[str, Any] = {}
        self.outside = outside
        self.draws = Draws(seed)
        self.steps: list[str] = []

    def note_step(self, step: str) -> None:
        """Note what was done and seen, for the author of the exam (`autograder try`)."""
        if len(self.steps) < MAX_STEPS:
            self.steps.append(step[:MAX_STEP_CHARS])

    def deadline(self, seconds: float) -> FairDeadline:
        """Begin a time that is put off while others keep the subject from running."""
        return FairDeadline(seconds, self.outside.delay)
