"""Grade ROS 2 exercises by what the nodes do: exams, the examiner, and the nbgrader bridge."""

from autograder.check import check

__all__ = ["check"]
