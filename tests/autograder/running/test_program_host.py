"""Plain programs: what an examiner may ask for, and what nodes do in one, seen from outside."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from autograder.processes.channel import Channel
from autograder.running import program_host
from autograder.running.program_host import ProgramHost
from autograder.sandbox import RunningSubject

LIVES = """
import os, sys, rclpy
from rclpy.node import Node
from autograder.examination.subject import plain_program

def say(what):
    os.write(1, what.encode() + b"\\n")  # in one piece: several threads do

class Works(Node):
    def __init__(self, name):
        super().__init__(name)
        say("made")
        self.create_timer(0.01, self.tick)
        self.told = False
    def tick(self):
        if not self.told:
            self.told = True
            say("spins")
    def destroy_node(self):
        super().destroy_node()
        say("destroyed")

    def shutdown(self):
        say("shut down")

class Raises(Works):
    def tick(self):
        raise RuntimeError("out of a callback")

class Refuses(Node):
    def __init__(self, name):
        say("refuses")
        raise RuntimeError("not made")

nodes, threads = [[name, [name]] for name in sys.argv[1].split()], int(sys.argv[2])
wanted = {"nodes": nodes, "threads": threads, "sim_time": False, "apart": len(nodes) > 1}
wanted |= {how: how == sys.argv[4] for how in ("twice", "shut_down", "goes_on")}
wanted["then"] = [{"nodes": nodes, "tried": []}]
if sys.argv[4] == "then":
    refused = [["Refuses", ["none"]], ["Missing", []]]
    wanted["then"] = [{"nodes": [["Works", ["next"]]], "tried": refused}]
    wanted["then"] += [{"nodes": [["Refuses", ["none"]]], "tried": []}]
plain_program.run(globals(), wanted, int(sys.argv[3]), lambda: say("up"))
"""


def start(name: str, threads: int, how: str = "") -> subprocess.Popen[str]:
    command = [sys.executable, "-c", LIVES, name, str(threads), "91", how]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


def reads(program: subprocess.Popen[str], *lines: str) -> None:
    assert program.stdout is not None
    assert [program.stdout.readline().strip() for _ in lines] == list(lines)


def live(threads: int, how: str, *lives: list[list[str]]) -> None:
    """Interrupt a program for what it is to say in each life, and once more for the next life."""
    with start("Works", threads, how) as program:
        try:
            reads(program, "made", "up", "spins")
            for said in lives:
                for lines in said:
                    os.kill(program.pid, signal.SIGINT)
                    reads(program, *lines)
                os.kill(program.pid, signal.SIGINT)
                reads(program, "made", "spins")
        finally:
            program.kill()


@pytest.mark.parametrize("threads", [1, 4])
def test_each_interrupt_ends_the_nodes_or_makes_them_anew(threads: int) -> None:
    live(threads, "", [["destroyed"]], [["destroyed"]])


def test_where_it_is_asked_for_the_nodes_of_the_first_life_are_destroyed_twice() -> None:
    live(1, "twice", [["destroyed", "destroyed"]], [["destroyed"]])


def test_lives_may_differ_and_only_what_is_tried_may_fail() -> None:
    with start("Works", 1, "then") as program:
        try:
            reads(program, "made", "up", "spins")
            for lines in (["destroyed"], ["made", "refuses", "spins"], ["destroyed"], ["refuses"]):
                os.kill(program.pid, signal.SIGINT)
                reads(program, *lines)
            assert program.wait(timeout=60) == 1
        finally:
            program.kill()


@pytest.mark.parametrize("threads", [1, 4])
def test_where_it_is_asked_for_the_nodes_are_shut_down_and_spin_on(threads: int) -> None:
    life = [["shut down"], ["destroyed"]]
    live(threads, "shut_down", life, life)


@pytest.mark.parametrize("threads", [1, 4])
def test_a_callback_that_raises_ends_the_program(threads: int) -> None:
    with start("Raises", threads) as program:
        reads(program, "made", "up")
        assert program.wait(timeout=60) == 1


def test_apart_a_callback_that_raises_ends_its_node_alone_and_one_not_made_is_left_out() -> None:
    with start("Raises Missing Works", 4) as program:
        try:
            reads(program, "made", "made", "up")
            assert program.stdout is not None
            said = {program.stdout.readline().strip() for _ in range(2)}
            assert said == {"destroyed", "spins"}
            os.kill(program.pid, signal.SIGINT)
            reads(program, "destroyed")
        finally:
            program.kill()


@pytest.mark.parametrize(
    "request_",
    [
        {"wants": "anything"},
        {"wants": "interrupt"},
        {"wants": "program"},
        {"wants": "program", "nodes": [["os.system", []]], "threads": 1, "then": [], "domain": 1},
        {
            "wants": "program",
            "nodes": [["Node", ["x" * 1000]]],
            "threads": 1,
            "then": [],
            "domain": 1,
        },
        {"wants": "program", "nodes": [[["Node"], []]], "threads": 1, "then": [], "domain": 1},
        {"wants": "program", "nodes": [["Node", []]], "threads": 1000, "then": [], "domain": 1},
        {"wants": "program", "nodes": [["Node", []]], "threads": 1, "then": [], "domain": 10**6},
        {"wants": "program", "nodes": {"Node": []}, "threads": 1, "then": [], "domain": 1},
        {"wants": "program", "nodes": [["Node", 1]], "threads": 1, "then": [], "domain": 1},
        {
            "wants": "program",
            "nodes": [["Node", []]],
            "threads": float("inf"),
            "then": [],
            "domain": 1,
        },
        {
            "wants": "program",
            "nodes": [["Node", []]],
            "threads": 1,
            "then": [],
            "domain": float("nan"),
        },
        {"wants": "program", "nodes": [["Node", []]], "threads": 1, "then": [], "domain": None},
        {"wants": ["program"]},
        {"wants": "program", "nodes": [], "threads": 1, "then": ["Node"], "domain": 1},
    ],
)
def test_what_is_no_request_is_refused_and_starts_nothing(request_: dict[str, Any]) -> None:
    def start_subject(*_: object) -> RunningSubject:
        raise AssertionError("started")

    subject: Any = None
    with ProgramHost(start_subject, subject, []) as host:
        assert "error" in host.answer_request(request_)


def test_programs_that_take_long_to_come_up_are_not_started_without_end() -> None:
    """Some time for all of them: that the next one is not started is then left to a person."""
    started = []

    @contextmanager
    def program(command: Sequence[str], fds: Sequence[int]) -> Iterator[Any]:
        started.append(command)
        channel = Channel(socket.socket(fileno=os.dup(fds[0])))
        channel.send({"ready": True})
        yield SimpleNamespace(pid=0, ready=lambda: None)
        channel.close()

    request = {
        "wants": "program", "nodes": [["Node", []]], "threads": 1, "domain": 1, "sim_time": False,
        "apart": False, "twice": False, "shut_down": False, "goes_on": False, "then": [],
    }  # fmt: skip
    subject: Any = SimpleNamespace(tell_warden=lambda: None)
    start_program: Any = program
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(program_host, "UP_TIMEOUT_S", 0.3)
        patched.setattr(program_host, "ALL_UP_S", 0.5)
        with ProgramHost(start_program, subject, []) as host:
            answers = [host.answer_request(request) for _ in range(4)]
    assert answers == [{"up": False}] * 2 + [{"slow": True}] * 2
    assert len(started) == 2
