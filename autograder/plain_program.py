"""A notebook's nodes as a plain program of rclpy: no session, no harness, nobody who asks.

What an exam learns of it, it sees from outside. A callback that raises ends the program. SIGINT
ends its nodes, as Ctrl-C does; with what they have not given back the program goes on until the
next SIGINT, which makes them anew, so that lives can be compared.
"""

# mypy: allow-untyped-calls
# rclpy leaves most of its functions untyped.

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from queue import SimpleQueue
from typing import Any

import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import get_default_context

SIMULATED = ["--ros-args", "-p", "use_sim_time:=true"]


def run(
    namespace: Mapping[str, Any], wanted: Mapping[str, Any], domain_id: int, up: Callable[[], None]
) -> None:
    """Make nodes and spin them, life after life; never returns by itself.

    Args:
        namespace: the notebook's globals.
        wanted: ``"nodes"``, a list of [class, arguments], ``"threads"`` and ``"sim_time"``.
        domain_id: of the examiner who looks on.
        up: called once, when the first nodes are there.
    """
    interrupts = _Interrupts()
    if not get_default_context().ok():  # else a cell has done so
        rclpy.init(
            args=SIMULATED if wanted["sim_time"] else [],
            domain_id=domain_id,
            # A node that is ended still sends its last words.
            signal_handler_options=SignalHandlerOptions.NO,
        )
    while True:
        _live(namespace, wanted, interrupts, up)
        interrupts.wait()
        up = _nothing


def _live(
    namespace: Mapping[str, Any],
    wanted: Mapping[str, Any],
    interrupts: _Interrupts,
    up: Callable[[], None],
) -> None:
    """Run the nodes until SIGINT, then destroy them."""
    nodes = [namespace[name](*arguments) for name, arguments in wanted["nodes"]]
    threads = int(wanted["threads"])
    executor = SingleThreadedExecutor() if threads == 1 else MultiThreadedExecutor(threads)
    for node in nodes:
        executor.add_node(node)
    up()
    with interrupts.raised():
        executor.spin()
    for node in nodes:
        node.destroy_node()
    executor.shutdown(timeout_sec=0.0)


class _Interrupts:
    """SIGINT raises KeyboardInterrupt while nodes spin; one that comes at another time is kept."""

    def __init__(self) -> None:
        self._kept: SimpleQueue[int] = SimpleQueue()  # its put is safe in a signal handler
        self._raises = False
        signal.signal(signal.SIGINT, self._note)

    def _note(self, number: int, _frame: object) -> None:
        if not self._raises:
            self._kept.put(number)
            return
        self._raises = False
        raise KeyboardInterrupt

    @contextmanager
    def raised(self) -> Iterator[None]:
        """Run the block until SIGINT, which ends it and goes no further."""
        with suppress(KeyboardInterrupt):
            self._raises = True
            yield
        self._raises = False

    def wait(self) -> None:
        """Wait for SIGINT."""
        self._kept.get()


def _nothing() -> None:
    pass
