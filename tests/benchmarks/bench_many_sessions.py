"""Whether many sessions on one machine hear each other: nobody may hear another's number.

Run it as ``python -m tests.benchmarks.bench_many_sessions --processes 30 --sessions 10``. Each
session leases a domain and runs a node that publishes its own number on ``/number``, a name that
all share, and notes what it hears there. The processes stand for kernels; several sessions in each
spare memory. The result is printed as JSON: heard of one's own, of others, where the sessions were,
and what they took.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rclpy.node import Node
from std_msgs.msg import Int64

from course.runtime.core_session import CoreSession
from course.runtime.domains import port_bases
from course.runtime.domains.rtps_ports import USUAL_BASE

PERIOD_S = 0.5  # between two numbers of one session
ROUNDS = 10  # times that a session must have heard itself
DEADLINE_S = 240.0  # for all of that


class Number(Node):
    """Says its number again and again, and notes all that it hears."""

    def __init__(self, number: int) -> None:
        """Begin."""
        super().__init__("number")
        self.heard: Counter[int] = Counter()
        publisher = self.create_publisher(Int64, "number", 10)
        self.create_subscription(Int64, "number", self._hear, 10)
        self.create_timer(PERIOD_S, lambda: publisher.publish(Int64(data=number)))

    def _hear(self, message: Int64) -> None:
        self.heard[message.data] += 1


def work(first: int, count: int, domains: Sequence[int]) -> None:
    """Be one process: open the sessions, say where, speak until stdin says so, tell what came.

    Args:
        first: the number of the first session.
        count: how many there are.
        domains: the domains to join; empty: each leases one.
    """
    with ExitStack() as stack:
        sessions, nodes = [], []
        for place in range(count):
            domain = domains[place] if domains else None
            sessions.append(stack.enter_context(CoreSession(domain_id=domain)))
            nodes.append(sessions[-1].run(Number, first + place))
        base = port_bases.current_base()
        _say({"places": [[base, session.domain_id] for session in sessions]})
        sys.stdin.readline()  # all are there
        for node in nodes:
            node.heard.clear()
        for number, (session, node) in enumerate(zip(sessions, nodes, strict=True), first):
            session.until(lambda n=number, o=node: o.heard[n] >= ROUNDS, DEADLINE_S, "oneself")
        _say({"heard": [dict(node.heard) for node in nodes], **_used()})
        sys.stdin.readline()  # all have heard what they were to hear


def _say(what: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def _used() -> dict[str, float]:
    rows = Path("/proc/self/smaps_rollup").read_text(encoding="ascii").splitlines()[1:]
    memory = {row.split()[0]: int(row.split()[1]) for row in rows}
    return {"pss_mb": memory["Pss:"] / 1024, "cpu_s": time.process_time()}


class Worker:
    """One process with some sessions."""

    def __init__(self, first: int, count: int, *, base: int = 0, domains: Sequence[int] = ()):
        """Start it; ``base`` and ``domains`` are chosen by itself if left out."""
        environment = dict(os.environ)
        environment.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)  # it prepares its own
        for name in (port_bases.PORT_BASE, port_bases.PROFILES, port_bases.PROFILES_OF_3):
            environment.pop(name, None)
        if base not in (0, USUAL_BASE):
            environment[port_bases.PORT_BASE] = str(base)
            environment[port_bases.PROFILES] = str(port_bases.PROFILE)
        self.first = first
        command = [sys.executable, "-m", __spec__.name, "--worker", str(first)]
        command += ["--sessions", str(count), "--domains", *map(str, domains)]
        self.process = subprocess.Popen(
            command, env=environment, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def read_report(self) -> dict[str, Any]:
        """Return what it says next."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("{"):
                report: dict[str, Any] = json.loads(line)
                return report
            sys.stderr.write(f"{self.first}: {line}")  # Fast DDS complains on stdout
        raise RuntimeError(f"A process with sessions ended with code {self.process.wait()}.")

    def go_on(self) -> None:
        """Let it go on."""
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def end(self) -> None:
        """Kill it if it has not ended."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()


def listen(starting: Iterable[Worker]) -> dict[str, Any]:
    """Let all sessions speak at once, and return who heard whom.

    Args:
        starting: makes the processes. Each has all its sessions before the next one starts: a
            kernel has one or two, and would not find out after ten that its ports are full.

    Returns:
        "places" by number (port base, domain), "heard" by number (a list of numbers), and what the
        processes used.
    """
    places: dict[int, tuple[int, int]] = {}
    heard: dict[int, list[int]] = {}
    workers: list[Worker] = []
    try:
        for worker in starting:
            workers.append(worker)
            found = worker.read_report()["places"]
            places |= {worker.first + n: tuple(place) for n, place in enumerate(found)}
        for worker in workers:
            worker.go_on()
        ends = [worker.read_report() for worker in workers]
        for worker, end in zip(workers, ends, strict=True):
            counts = enumerate(end["heard"], worker.first)
            heard |= {number: sorted(map(int, count)) for number, count in counts}
            worker.go_on()
        for worker in workers:
            worker.process.wait(DEADLINE_S)
    finally:
        for worker in workers:
            worker.end()
    used = {name: sum(end[name] for end in ends) for name in ("pss_mb", "cpu_s")}
    return {"places": places, "heard": heard, **used}


def count_crosstalk(heard: dict[int, list[int]]) -> int:
    """Return how many numbers were heard by somebody whose number it is not."""
    return sum(other != number for number, others in heard.items() for other in others)


def first_numbers(processes: int, sessions: int) -> Iterable[int]:
    """Return the number of each process's first session."""
    return range(1, processes * sessions + 1, sessions)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--processes", type=int, default=30)
    parser.add_argument("--sessions", type=int, default=10, help="in each process, 10 at most")
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--domains", type=int, nargs="*", default=[], help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker is not None:
        work(options.worker, options.sessions, options.domains)
        return
    start = time.monotonic()
    firsts = first_numbers(options.processes, options.sessions)
    found = listen(Worker(first, options.sessions) for first in firsts)
    bases = Counter(base for base, _ in found["places"].values())
    result = {
        "sessions": len(found["places"]),
        "places": len(set(found["places"].values())),
        "heard themselves": sum(n in others for n, others in found["heard"].items()),
        "heard others": count_crosstalk(found["heard"]),
        "by port base": dict(sorted(bases.items())),
        "memory (MB)": round(found["pss_mb"]),
        "processor (s)": round(found["cpu_s"]),
        "took (s)": round(time.monotonic() - start),
    }
    sys.stdout.write(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
