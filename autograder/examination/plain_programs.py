"""Plain programs of the subject's nodes, as the examiner sees them: from outside, and only so.

What a student's process says of itself, or does when its subject server asks it to, can be made up
there. A further process runs the notebook's cells and then its nodes, as `python program.py` would
(`autograder.examination.subject.plain_program`), and nobody asks it for anything.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import Any, NamedTuple, TextIO

from autograder.processes.outside.asking import Outside
from autograder.processes.outside.warden_requests import RequestError
from course.errors import CourseError, WaitTimeout
from course.runtime.core_session import CoreSession
from course.runtime.domains.leases import MAX_DOMAIN

DOMAINS = 100
"""Domains that programs take turns in: what one that was killed leaves is on the graph for long."""

Nodes = Sequence[tuple[str, Sequence[str]]]
"""Classes, and what their constructors are given."""


class Life(NamedTuple):
    """What a program is from one interrupt to the next but one.

    Beside its ``nodes`` others are ``tried``: the program goes on with what their making raises.
    """

    nodes: Nodes
    tried: Nodes = ()


class ProgramError(CourseError):
    """The engine did not start a program; the message says why."""


class SlowProgramError(Exception):
    """Programs have taken so long to make their nodes that no more are started; it says so."""


@dataclass(frozen=True)
class Program:
    """A plain program. ``up`` is whether it has made its nodes; ``session`` is in its network."""

    session: CoreSession
    up: bool
    domain_id: int
    _ask: Callable[..., dict[str, Any]]
    _outside: Outside

    def interrupt(self) -> None:
        """Have its nodes ended, or made again if they are ended."""
        self._ask(wants="interrupt")

    def has_ended(self) -> bool:
        """Whether its process has gone, with all that it started."""
        try:
            return not self._outside.ask("threads")
        except RequestError:
            return True

    def wait(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Wait until ``condition`` holds, for so long; return whether it does."""
        with suppress(WaitTimeout):
            self.session.until(condition, timeout=seconds, what="an observation")
            return True
        return False


class Programs:
    """Asks the engine for programs over the examiner's own streams."""

    def __init__(self, replies: TextIO, requests: TextIO, outside: Outside) -> None:
        """Ask on ``requests``, hear on ``replies``; ``outside`` sees the program while it runs."""
        self._replies, self._requests, self._outside = replies, requests, outside
        self._count = 0

    def _ask_engine(self, **request: Any) -> dict[str, Any]:
        self._requests.write(json.dumps(request) + "\n")
        self._requests.flush()
        reply: dict[str, Any] = json.loads(self._replies.readline())
        if "error" in reply:
            raise ProgramError(f"There is no plain program: {reply['error']}.")
        if "slow" in reply:
            raise SlowProgramError(
                "Your notebook was run several times as a program of its own, and its cells took "
                "so long each time that it was not run once more. After a hand-in a person looks "
                "at it."
            )
        return reply

    @contextmanager
    def program(
        self,
        nodes: Nodes,
        *,
        then: Sequence[Life] = (),
        threads: int = 1,
        sim_time: bool = False,
        apart: bool = False,
        twice: bool = False,
        shut_down: bool = False,
        goes_on: bool = False,
    ) -> Iterator[Program]:
        """Run nodes of the notebook's classes for the length of the block.

        Interrupted twice, a program makes them again, or what its life is ``then``, life by life;
        the last one is repeated. Where they are ``apart``, each has an executor of its own, with
        so many threads, and what leaves a callback ends its node alone. ``twice``: at the end of
        the first life of its kind each node is destroyed twice. ``shut_down``: at a first
        interrupt their ``shutdown()`` is called, and they spin on until the next. It ``goes_on``
        whatever leaves a callback, as a session does, unless they are apart. Whatever looks at the
        subject's processes meanwhile looks at the program's.

        Raises:
            ProgramError: the engine did not start it; that is never the student's fault.
            SlowProgramError: those before took so long that it is not started any more.
        """
        self._count += 1
        domain = MAX_DOMAIN - 1 - self._count % DOMAINS
        with ExitStack() as leaving:
            session = leaving.enter_context(CoreSession(domain_id=domain))
            session.explains = False
            # The program ends before the session closes: where an endpoint of others is discovered
            # just as a participant is destroyed, Fast DDS 2.14 hangs for ever (`set_listener` waits
            # for the callback's end with a lock that the callback needs).
            leaving.callback(self._ask_engine, wants="end")
            reply = self._ask_engine(
                wants="program", nodes=_nodes_as_data(nodes), then=[
                    {"nodes": _nodes_as_data(life.nodes), "tried": _nodes_as_data(life.tried)}
                    for life in then
                ],
                threads=threads, sim_time=sim_time, apart=apart, twice=twice, shut_down=shut_down,
                goes_on=goes_on, domain=domain,
            )  # fmt: skip
            yield Program(session, bool(reply["up"]), domain, self._ask_engine, self._outside)


def _nodes_as_data(nodes: Nodes) -> list[list[Any]]:
    return [[name, [*given]] for name, given in nodes]
