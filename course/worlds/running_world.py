"""A world that runs: a simulation, hosted as a ROS 2 node that follows a session's clock."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Sequence
from typing import Any

from course.errors import SessionError
from course.runtime.core_session import CoreSession
from course.runtime.teardown import is_alive
from course.util import argument_checks
from course.worlds.floor_plan import FloorPlan
from course.worlds.pacing import PacedSimulation
from course.worlds.simulation import Simulation
from course.worlds.world_node import WorldNode

EXECUTOR = "world"
"""What the executor is for that spins the node: a learner's callback that blocks cannot stop it."""


class RunningWorld:
    """A simulated world as a node of a session; safe to use from any thread.

    On simulated time it is exact: the same seed and the same commands at the same times give the
    same messages. On wall time it is alive: it goes on in the background.

    >>> world = RunningWorld(session, load_floor_plan("warehouse"))
    >>> world.drive(0.5, 0.0)
    >>> world.describe_moment()["robot"]["x"]
    """

    def __init__(self, session: CoreSession, plan: FloorPlan, seed: int = 0) -> None:
        """Run the world of a floor plan; its node is called as the plan is.

        Args:
            session: whose clock it follows, and with which it ends.
            plan: the floor plan.
            seed: decides on the noise of the sensors.

        Raises:
            SessionError: the session is closed, or the seed is no whole number.
        """
        argument_checks.check_whole_number(seed, "seed", least=0, example=1)
        exact = bool(session.options["sim_time"])
        self._session = session
        self._paced = PacedSimulation(Simulation(plan, seed), exact=exact)
        make_node = functools.partial(WorldNode, plan.name, self._paced)
        node = session.run_apart(make_node, EXECUTOR)
        assert isinstance(node, WorldNode)
        self._node = node
        with self._paced.lock:
            self._paced.start(node.now_ns)  # now: in its constructor a node's simulated time is 0

    # Looking.

    def describe_floor(self) -> dict[str, Any]:
        """Return what never changes; see `Simulation.describe_floor`."""
        return self._paced.simulation.describe_floor()

    def describe_moment(self) -> dict[str, Any]:
        """Return what is now, or was at the end; see `Simulation.describe_moment`."""
        with self._paced.lock:
            return self._paced.simulation.describe_moment()

    @property
    def topics(self) -> list[dict[str, Any]]:
        """What each topic carries: name, type, rate (Hz, 0 for events), and last (a short text)."""
        with self._paced.lock:
            return self._node.describe_topics()

    @property
    def time_s(self) -> float:
        """Simulated seconds since it began, or since the last reset."""
        with self._paced.lock:
            return self._paced.simulation.time_s

    @property
    def node(self) -> WorldNode:
        """The node that hosts it."""
        return self._node

    @property
    def closed(self) -> bool:
        """Whether it has ended: with its session, or because somebody stopped its node."""
        return self._session.closed or not is_alive(self._node)

    # Controls. All raise a SessionError once the world has ended, and for what is no number.

    def drive(self, speed: float, turn: float) -> None:
        """Command m/s and rad/s (left is positive), as `cmd_vel` does; it holds for 0.5 s."""
        with self._paced.lock:
            self._control().drive(_check_number(speed), _check_number(turn))

    def press_stop(self) -> None:
        """Press the emergency stop."""
        with self._paced.lock:
            self._control().press_stop()
            self._node.publish_events()

    def release_stop(self) -> None:
        """Release the emergency stop."""
        with self._paced.lock:
            self._control().release_stop()
            self._node.publish_events()

    def add_obstacle(self, x: float, y: float, radius: float = 0.2) -> int:
        """Put a round obstacle at (``x``, ``y``), all in m; return its number."""
        numbers = _check_number(x), _check_number(y), _check_number(radius)
        with self._paced.lock:
            return self._control().add_obstacle(*numbers)

    def move_obstacle(self, number: int, x: float, y: float) -> None:
        """Move an obstacle to (``x``, ``y``), in m."""
        with self._paced.lock:
            self._control().move_obstacle(number, _check_number(x), _check_number(y))

    def remove_obstacle(self, number: int) -> None:
        """Take an obstacle away."""
        with self._paced.lock:
            self._control().remove_obstacle(number)

    def set_fault(self, what: str, state: str) -> None:
        """Let something fail, or work again: ``world.set_fault("wheels", "jammed")``.

        Raises:
            SessionError: there is no such part, or no such state of it; the error names all.
        """
        with self._paced.lock:
            self._control().set_fault(what, state)
            self._node.publish_events()

    def reset(self) -> None:
        """Put everything back to where it was at first, and mend all faults."""
        with self._paced.lock:
            self._control()
            self._node.reset()

    # What other nodes have to do with it.

    def hand_over(
        self, deliver: Callable[[str, Any], None], cables: Collection[str], motors: str
    ) -> None:
        """Leave the robot's topics to other nodes; see `WorldNode.hand_over`."""
        with self._paced.lock:
            self._control()
            self._node.hand_over(deliver, cables, motors)

    def show_plans(
        self, path: Sequence[tuple[float, float]], found: Sequence[tuple[float, float]]
    ) -> None:
        """Show a planned path and where somebody has found obstacles, in m."""
        with self._paced.lock:
            self._paced.simulation.show_path(path)
            self._paced.simulation.show_found(found)

    def tell(self, what: str) -> None:
        """Show a sentence among the news; its end says when."""
        with self._paced.lock:
            self._paced.simulation.tell(what)

    # Time.

    @property
    def paused(self) -> bool:
        """Whether it stands still."""
        return self._paced.paused

    def pause(self) -> None:
        """Stand still, whatever the clock does. Idempotent."""
        with self._paced.lock:
            self._control()
            self._node.advance()
            self._paced.paused = True

    def resume(self) -> None:
        """Go on. Idempotent."""
        with self._paced.lock:
            self._control()
            self._paced.resume(self._node.now_ns)

    def step_once(self) -> None:
        """Take 0.1 s at once; for a world that is paused."""
        with self._paced.lock:
            self._control()
            self._node.take_one_look()

    @property
    def speed(self) -> float:
        """Simulated seconds a second of wall time, 0.25 to 4.

        Setting it raises a SessionError if it is out of range, or the session has simulated time.
        """
        return self._paced.speed

    @speed.setter
    def speed(self, factor: float) -> None:
        with self._paced.lock:
            self._control()
            self._node.advance()
            self._paced.speed = factor

    def close(self) -> None:
        """End the world: its node goes from the graph. Idempotent."""
        if not self.closed:
            self._session.stop(self._node)

    # Inside.

    def _control(self) -> Simulation:
        """Return the simulation; hold the lock for longer than one call."""
        if self.closed:
            raise SessionError(
                "This world has ended, with its session or because its node was stopped: make "
                'another one with course.world("warehouse").'
            )
        return self._paced.simulation


def _check_number(value: Any) -> float:
    """Return a finite number.

    Raises:
        SessionError: it is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise SessionError(f"The world takes finite numbers (m, m/s, rad/s), not {value!r}.")
    return float(value)
