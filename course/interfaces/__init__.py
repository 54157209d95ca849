"""Real ROS interfaces, built from their text.

``import course`` calls ``install``. From then on ``from example_interfaces.srv import SetBool``
works, and so does ``%%interface robot_msgs/srv/GetPose`` for a learner's own types. What is built
is what colcon would build: the same type names and type hashes on the wire (REP 2011), so that it
talks to any ROS 2 Jazzy system.
"""

from course.interfaces.building.cache import root as cache_root
from course.interfaces.building.toolchain import compiler_problem
from course.interfaces.defining import Source, define, ensure, ensure_definition, status
from course.interfaces.errors import (
    BuildError,
    CompilerMissingError,
    DefinitionError,
    InterfaceError,
    RestartNeededError,
)
from course.interfaces.finder import install

__all__ = [
    "BuildError",
    "CompilerMissingError",
    "DefinitionError",
    "InterfaceError",
    "RestartNeededError",
    "Source",
    "cache_root",
    "compiler_problem",
    "define",
    "ensure",
    "ensure_definition",
    "install",
    "status",
]
