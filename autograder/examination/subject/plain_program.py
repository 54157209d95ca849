"""A notebook's nodes as a plain program of rclpy: no session, no subject server, no requests.

What an exam learns of it, it sees from outside. A callback that raises ends the program; where each
node has its own executor, it ends that node. SIGINT destroys the nodes, as Ctrl-C does. The program
then keeps running, with whatever they did not release; the next SIGINT creates new nodes, so that
one life can be compared with the next. Programs destroy a node twice now and then, in a handler and
at their end, say: one can be had that does so at the end of its first life. Lives may differ, and
nodes may be tried in one, as a supervisor does: it goes on with what they raise.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import chain, repeat
from threading import Thread
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import Executor, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import get_default_context

from course.runtime.context.context import set_default_context

SIMULATED = ["--ros-args", "-p", "use_sim_time:=true"]
SWITCH_S = 0.0002
"""Seconds after which a thread of Python's must let another one run. With the usual 5 ms rclpy's
MultiThreadedExecutor computes as long for each callback: it gives a task to its pool again and
again until a thread of the pool has begun it (https://github.com/ros2/rclpy/issues/1452)."""


def run(
    namespace: Mapping[str, Any], wanted: Mapping[str, Any], domain_id: int, up: Callable[[], None]
) -> None:
    """Make nodes and spin them, life after life; never returns by itself.

    Args:
        namespace: the notebook's globals.
        wanted: ``"nodes"``, a list of [class, arguments] for the first life, ``"then"``, the same
            for each life after, with ``"tried"`` nodes, whose making may raise; the last of these
            is repeated. ``"threads"``, ``"sim_time"``, ``"twice"``, whether each node of the first
            life of its kind is destroyed twice, ``"apart"``, whether each node has an executor of
            its own, with so many threads, ``"shut_down"``, whether at a first SIGINT the
            ``shutdown()`` of those that have one is called, and they spin on until the next, and
            ``"goes_on"``, whether what leaves a callback ends nothing.
        domain_id: of the examiner who looks on.
        up: called once, when the first nodes are there.
    """
    interrupts = _Interrupts()
    sys.setswitchinterval(SWITCH_S)
    if get_default_context().ok():  # a cell has opened it, for nodes of its own
        set_default_context(Context())
    rclpy.init(
        args=SIMULATED if wanted["sim_time"] else [],
        domain_id=domain_id,
        # A node that is ended still sends its last words.
        signal_handler_options=SignalHandlerOptions.NO,
    )
    raised: list[BaseException] = []
    before: list[Any] = []
    for life in _iter_lives(wanted):
        times = 2 if wanted["twice"] and life["nodes"] not in before else 1
        before.append(life["nodes"])
        of_life = {**wanted, "nodes": life["nodes"], "times": times}
        _run_life(
            namespace,
            of_life,
            interrupts,
            partial(_try_nodes, namespace, life["tried"], raised, up),
        )
        interrupts.wait()
        up = _do_nothing


def _iter_lives(wanted: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    first = {"nodes": wanted["nodes"], "tried": []}
    lives = [first, *wanted["then"]]
    return chain(lives, repeat(lives[-1]))


def _try_nodes(
    namespace: Mapping[str, Any],
    tried: Sequence[Any],
    raised: list[BaseException],
    up: Callable[[], None],
) -> None:
    """Make nodes that may raise, beside those that are there; then say that all are.

    What they raise is kept, as a notebook keeps it: what its frames refer to does not go by chance.
    """
    for name, arguments in tried:
        try:
            namespace[name](*arguments)
        except (Exception, SystemExit) as error:  # noqa: BLE001 - of the student's code
            raised.append(error)
    up()


def _run_life(
    namespace: Mapping[str, Any],
    wanted: Mapping[str, Any],
    interrupts: _Interrupts,
    up: Callable[[], None],
) -> None:
    """Run the nodes until SIGINT, then destroy them so many ``"times"``."""
    threads, times = int(wanted["threads"]), int(wanted["times"])
    if wanted["apart"]:
        nodes = []
        for name, arguments in wanted["nodes"]:
            with suppress(Exception):  # one that cannot be made is nothing to the others
                nodes.append(namespace[name](*arguments))
        interrupt = interrupts.next_interrupt()
        alone = [
            Thread(target=_spin_alone, args=(node, threads, interrupt, times)) for node in nodes
        ]
        up()
        for thread in alone:
            thread.start()
        for thread in alone:
            thread.join()
    else:
        nodes = [namespace[name](*arguments) for name, arguments in wanted["nodes"]]
        up()
        first = interrupts.next_interrupt()
        shut_down_until = interrupts.next_interrupt if wanted["shut_down"] else None
        _spin_nodes(nodes, threads, first, times, shut_down_until, goes_on=wanted["goes_on"])


def _spin_alone(node: Any, threads: int, until: Future, times: int) -> None:
    """Spin a node, which is destroyed when something leaves one of its callbacks, too."""
    try:
        _spin_nodes([node], threads, until, times)
    except BaseException:
        node.destroy_node()
        raise


def _spin_nodes(
    nodes: Sequence[Any],
    threads: int,
    until: Future,
    times: int,
    shut_down_until: Callable[[], Future] | None = None,
    *,
    goes_on: bool = False,
) -> None:
    executor = SingleThreadedExecutor() if threads == 1 else MultiThreadedExecutor(threads)
    for node in nodes:
        executor.add_node(node)
    try:
        _spin_until(executor, until, goes_on=goes_on)
        if shut_down_until is not None:
            for node in nodes:
                if callable(shutdown := getattr(node, "shutdown", None)):
                    shutdown()
            executor.spin_until_future_complete(shut_down_until())
        for node in [*nodes] * times:
            node.destroy_node()
    finally:
        # Left by an exception it holds what was ready with it, and so the endpoints of its node.
        executor.shutdown(timeout_sec=0.0)


def _spin_until(executor: Executor, until: Future, *, goes_on: bool) -> None:
    while True:
        try:
            executor.spin_until_future_complete(until)
        except Exception:
            if not goes_on:
                raise
        else:
            return


class _Interrupts:
    """SIGINT, each counted once. None of them cuts a callback short, which could hold a lock.

    A handler of Python's runs in the main thread, which may wait for messages in C. So a thread
    reads what Python writes to a pipe at each signal.
    """

    def __init__(self) -> None:
        self._read, write = os.pipe()
        os.set_blocking(write, False)
        signal.signal(signal.SIGINT, lambda *_: None)
        signal.set_wakeup_fd(write)

    def next_interrupt(self) -> Future:
        """Return what is done at the next one."""
        come = Future()

        def finish() -> None:
            self.wait()
            come.set_result(None)

        Thread(target=finish, daemon=True).start()
        return come

    def wait(self) -> None:
        """Wait for the next."""
        while os.read(self._read, 1) != bytes([signal.SIGINT]):
            pass


def _do_nothing() -> None:
    pass
