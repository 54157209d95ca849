"""The rig of the error-handling exam: one of the student's nodes at a time, and its counterpart."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from rclpy.node import Node

from autograder.examination.check_context import CheckContext, Endpoints
from autograder.exercises.safety import plain_program_shutdown, plain_program_survival
from autograder.exercises.safety.counterpart import Player
from autograder.exercises.safety.node_under_test import Robot
from autograder.observe.stillness import Stillness

THREADS = 4

PlayerT = TypeVar("PlayerT", bound=Player)


class RobotRig:
    """Gives each check the node that it examines, and its counterpart."""

    def __init__(self, bench: CheckContext) -> None:
        """Nothing runs yet, but the examiner takes part in DDS from now on.

        Counterparts come and go. Each would otherwise bring a participant of its own, from which
        it has to find the subject, and taking that down again is what Fast DDS can hang in.
        """
        bench.session.participate()
        self.bench = bench
        self._robot: Robot | None = None
        self._player: Player | None = None
        self._fresh = False
        self._still = Stillness(bench.outside)

    @contextmanager
    def run_robot(self, name: str, player: type[PlayerT]) -> Iterator[tuple[Robot, PlayerT]]:
        """Give the node of a class and its counterpart; after a failed check, fresh ones.

        A check that passed leaves a subject that can go on: another session would have to be
        discovered first. One that failed may have left callbacks that never end.
        """
        try:
            if self._robot is None or self._robot.name != name:
                self._change_to(name, player)
            assert self._robot is not None
            assert isinstance(self._player, player)
            yield self._robot, self._player
        except BaseException:
            self._robot, self._fresh = None, False
            raise

    def _change_to(self, name: str, player: type[Player]) -> None:
        self.renew_node()
        if not self._fresh:
            self.bench.subject.open(threads=THREADS, sim_time=True)
            self.bench.subject.mark("beside")  # the executor starts its threads with the first node
            self._fresh = True
        made = self.bench.session.run(player)
        assert isinstance(made, player)
        self._player = made
        self._robot = Robot(self.bench, name, made, self._still, self._ended_by)

    def _ended_by(self, name: str, trial: str) -> bool:
        return plain_program_survival.ended_by(name, trial, self.bench, self._still)

    def require_times_unasked(self, name: str, *times: str) -> None:
        """Fail if something takes a node far too long, or far too short, in a plain program, too.

        ``times`` are names in `plain_program_times.TIMES`.
        """
        for what in times:
            plain_program_survival.require_time(name, what, self.bench, self._still)

    def require_shutdown_unasked(self) -> None:
        """Fail unless the drive's server in a program of its own stops at a shutdown, too."""
        seen = plain_program_survival.shutdowns_seen(self.bench)
        plain_program_shutdown.require_shutdown(self.bench, self._still, seen)

    def renew_node(self) -> None:
        """Have the next check begin with a fresh node, in the same session."""
        if self._robot is not None:
            self.bench.subject.stop(self._robot.name)
        self.take_down()

    def begin_anew(self) -> None:
        """Have the next check begin with a fresh node in a fresh session, whose time begins at 0.

        A constructor always finds the clock at 0. In a session where time has gone on, a thread
        that it starts has to catch up with it first.
        """
        self.take_down()
        self._fresh = False

    def run_once(self, trial: Callable[[RobotRig], None]) -> None:
        """Run a trial that others build on, unless an earlier part of the exam has passed it."""
        if trial.__name__ not in self.bench.memory:
            trial(self)
            self.bench.memory[trial.__name__] = True

    def take_down(self) -> None:
        """Take the examiner's end down."""
        self._robot = None
        if self._player is not None:
            self.bench.session.stop(self._player)
            self._player = None


@contextmanager
def run_server(
    rig: RobotRig, robot: Robot, make: Callable[[], Node], services: Endpoints
) -> Iterator[None]:
    """Run a server of the examiner's for the length of the block; the robot knows both ends."""
    server = rig.bench.session.run(make)
    try:
        robot.wait_for_discovery(services)
        robot.wait_for_rest()
        yield
    finally:
        rig.bench.session.stop(server)


@contextmanager
def robot_rig(bench: CheckContext) -> Iterator[RobotRig]:
    """Give a rig, and take the examiner's endpoints down afterwards."""
    rig = RobotRig(bench)
    try:
        yield rig
    finally:
        rig.take_down()
