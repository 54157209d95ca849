"""Plain programs: what an examiner may ask for, and what nodes do in one, seen from outside."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import Any

import pytest

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

nodes, threads = [[name, [name]] for name in sys.argv[1].split()], int(sys.argv[2])
wanted = {"nodes": nodes, "threads": threads, "sim_time": False, "apart": len(nodes) > 1}
wanted |= {how: how == sys.argv[4] for how in ("twice", "shut_down", "goes_on")}
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
        {"wants": "program", "nodes": [["os.system", []]], "threads": 1, "domain": 1},
        {"wants": "program", "nodes": [["Node", ["x" * 1000]]], "threads": 1, "domain": 1},
        {"wants": "program", "nodes": [[["Node"], []]], "threads": 1, "domain": 1},
        {"wants": "program", "nodes": [["Node", []]], "threads": 1000, "domain": 1},
        {"wants": "program", "nodes": [["Node", []]], "threads": 1, "domain": 10**6},
        {"wants": "program", "nodes": {"Node": []}, "threads": 1, "domain": 1},
    ],
)
def test_what_is_no_request_is_refused_and_starts_nothing(request_: dict[str, Any]) -> None:
    def start_subject(*_: object) -> RunningSubject:
        raise AssertionError("started")

    subject: Any = None
    with ProgramHost(start_subject, subject, []) as host:
        assert "error" in host.answer(request_)
