"""A plain program's nodes follow the clock that an examiner publishes, and nothing else."""

from __future__ import annotations

import rclpy
from rclpy.parameter import Parameter

from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.programs.simulated_clock import SimulatedClock
from course import Session


def test_a_timer_fires_as_often_as_the_clock_says() -> None:
    fired: list[int] = []
    with Session() as session:
        clock = SimulatedClock(session)
        assert not clock.is_followed
        node = session.run(
            rclpy.create_node, "robot",
            parameter_overrides=[Parameter("use_sim_time", value=True)],
        )  # fmt: skip
        node.create_timer(0.1, lambda: fired.append(node.get_clock().now().nanoseconds))
        session.until(lambda: clock.is_followed)
        for number in range(1, 6):
            clock.move(0.1)
            session.until(lambda most=number: len(fired) == most)
        assert round(clock.now, 6) == 0.5


def test_nodes_with_the_machines_time_do_not_follow_it() -> None:
    with Session() as session:
        clock = SimulatedClock(session)
        session.run(QuietNode, "beside")
        assert not clock.is_followed
