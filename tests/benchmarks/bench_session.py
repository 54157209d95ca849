"""What a Session costs against plain rclpy: latency, throughput, leaks.

Run it as ``python tests/benchmarks/bench_session.py``; ``--json`` prints the figures for machines.
Session and plain rclpy (an executor of rclpy's own, spinning in a thread) take many short turns in
one run, so that a busy machine is busy for both. Nothing here is a test: timing is shown,
never asserted.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import statistics
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String

import course
from course.runtime.domains.leases import lease_domain

Run = Callable[[Callable[[], Node]], Node]
MESSAGES = 250  # in each part of a turn: short, so that both sides see the same load
KEEP_ALL_OF_A_BURST = QoSProfile(depth=2000)


@contextlib.contextmanager
def plain(threads: int) -> Iterator[Run]:
    """Run nodes as a careful rclpy user does: own context, own executor, own thread."""
    lease = lease_domain()
    context = rclpy.Context()
    context.init(
        ["--ros-args", "--disable-stdout-logs", "--disable-external-lib-logs"],
        domain_id=lease.domain_id,
    )
    executor = (
        SingleThreadedExecutor(context=context)
        if threads == 1
        else MultiThreadedExecutor(threads, context=context)
    )

    def spin() -> None:
        with contextlib.suppress(ExternalShutdownException):
            executor.spin()

    nodes: list[Node] = []

    def run(factory: Callable[[], Node]) -> Node:
        rclpy.utilities.g_default_context = context  # as rclpy.init() would
        nodes.append(factory())
        executor.add_node(nodes[-1])
        return nodes[-1]

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        yield run
    finally:
        context.shutdown()
        thread.join()
        for node in nodes:
            node.destroy_node()
        executor.shutdown()
        context.destroy()
        rclpy.utilities.g_default_context = None
        lease.release()


@contextlib.contextmanager
def session(threads: int) -> Iterator[Run]:
    """Run nodes in a course.Session."""
    with course.Session(threads=threads) as opened:
        yield opened.run


class Echo(Node):
    """Receives on one topic; `arrived` is set when as many messages came as were expected."""

    def __init__(self) -> None:
        """Subscribe, and publish to oneself."""
        super().__init__("echo")
        self.expected, self.count, self.stamp = 1, 0, 0
        self.arrived = threading.Event()
        self.publisher = self.create_publisher(String, "bench", KEEP_ALL_OF_A_BURST)
        self.create_subscription(String, "bench", self.hear, KEEP_ALL_OF_A_BURST)

    def hear(self, _: String) -> None:
        """Count a message, and note when it came."""
        self.count += 1
        if self.count == self.expected:
            self.stamp = time.perf_counter_ns()
            self.arrived.set()

    def expect(self, count: int) -> None:
        """Begin to count."""
        self.expected, self.count = count, 0
        self.arrived.clear()


def latencies(echo: Echo, count: int) -> list[float]:
    """Return `count` times from publish() to the callback, in us."""
    message, times = String(data="x"), []
    for _ in range(count):
        echo.expect(1)
        start = time.perf_counter_ns()
        echo.publisher.publish(message)
        if not echo.arrived.wait(5.0):
            raise TimeoutError("a message was lost")
        times.append((echo.stamp - start) / 1e3)
    return times


def throughput(echo: Echo, count: int) -> float:
    """Return how many messages a second are published and received, in one burst."""
    message = String(data="x")
    echo.expect(count)
    start = time.perf_counter_ns()
    for _ in range(count):
        echo.publisher.publish(message)
    if not echo.arrived.wait(30.0):
        raise TimeoutError(f"{count - echo.count} of {count} messages were lost")
    return count / ((echo.stamp - start) / 1e9)


class Side:
    """Plain rclpy or a session, open for the whole measurement, and what it took so far."""

    def __init__(self, run: Run) -> None:
        """Start the node that echoes, and warm up."""
        echo = run(Echo)
        assert isinstance(echo, Echo)
        self.echo = echo
        self.times: list[float] = []
        latencies(echo, 200)

    def turn(self) -> dict[str, float]:
        """Return the figures of one short turn."""
        times = latencies(self.echo, MESSAGES)
        self.times += times
        before = time.process_time_ns()
        rate = throughput(self.echo, MESSAGES)
        cpu = (time.process_time_ns() - before) / MESSAGES / 1e3
        return {"latency": statistics.median(times), "throughput": rate, "cpu": cpu}


def compare(threads: int, rounds: int) -> dict[str, float]:
    """Return the figures of both, measured in short turns, and the ratios of neighbouring turns.

    A busy machine is busy for both turns of a pair, more or less: the median of the pairs' ratios
    is steadier than the ratio of two medians. "cpu" is processor time of the whole process for a
    message of a burst, which others' load hardly changes.
    """
    pairs = []
    with plain(threads) as run_plain, session(threads) as run_session:
        sides = {"plain": Side(run_plain), "session": Side(run_session)}
        for number in range(rounds):
            order = list(sides) if number % 2 else list(reversed(sides))
            pairs.append({name: sides[name].turn() for name in order})
    figures = {}
    for name, side in sides.items():
        cuts = statistics.quantiles(side.times, n=100)
        figures[f"{name} latency p50 (us)"] = cuts[49]
        figures[f"{name} latency p99 (us)"] = cuts[98]
        for what, unit in (("throughput", "1/s"), ("cpu", "us")):
            middle = statistics.median(pair[name][what] for pair in pairs)
            figures[f"{name} {what} ({unit})"] = middle
    for what in ("latency", "throughput", "cpu"):
        low, middle, high = statistics.quantiles(
            [pair["session"][what] / pair["plain"][what] for pair in pairs], n=4
        )
        figures[f"{what} ratio"] = middle
        figures[f"{what} ratio, lower quartile"] = low
        figures[f"{what} ratio, upper quartile"] = high
    return figures


def leaks(nodes: int) -> dict[str, float]:
    """Return what is left after starting and stopping `nodes` nodes, each on the graph."""

    def count() -> tuple[int, int]:
        return threading.active_count(), len(list(Path("/proc/self/fd").iterdir()))

    with course.Session() as opened:
        for _ in range(3):  # what DDS allocates once is no leak
            opened.run(Echo)
        opened.stop()
        watcher = opened.run(Node, "watcher")
        threads_before, files_before = count()
        start = time.perf_counter()
        for number in range(nodes):
            opened.run(Node, f"node_{number}")
        opened.stop(*(name for name in opened.nodes if name != "/watcher"))
        seconds = time.perf_counter() - start
        opened.until(lambda: len(watcher.get_node_names()) == 1, timeout=10.0, what="the graph")
        threads_after, files_after = count()
        left = len(watcher.get_node_names()) - 1
    return {
        "nodes started and stopped": nodes,
        "ms each": 1e3 * seconds / nodes,
        "threads leaked": threads_after - threads_before,
        "files leaked": files_after - files_before,
        "nodes left on the graph": left,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--rounds", type=int, default=40, help="turns of each side")
    options = parser.parse_args()
    # On one core: whether a message crosses to another changes from turn to turn, and costs double.
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    measurements: dict[str, Callable[[], dict[str, float]]] = {
        "one thread": lambda: compare(1, options.rounds),
        # rclpy's own pool misses wake-ups and then waits for a third of a second: fewer turns.
        "four threads": lambda: compare(4, max(2, options.rounds // 5)),
        "100 nodes": lambda: leaks(100),
        "machine": lambda: {"cores": float(os.cpu_count() or 0), "load": os.getloadavg()[0]},
    }
    results = {}
    for title, measure in measurements.items():
        results[title] = measure()
        if not options.json:
            lines = [f"  {name:34} {value:12.2f}\n" for name, value in results[title].items()]
            sys.stdout.write("".join([f"\n{title}\n", *lines]))
            sys.stdout.flush()
    if options.json:
        sys.stdout.write(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
