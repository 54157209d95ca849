"""What nearly every subject and examiner imports: a zygote imports it for all of them.

Only time is saved by what stands here. What is missing is imported when it is needed, as ever.
"""

from __future__ import annotations

import inspect
import os
import pwd
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

COURSE = (
    "course.learner_session.default_session", "course.design.declaration", "course.design.node",
    "course.graph.reader", "course.interfaces.magic", "course.notebook", "course.ros_magic.magic",
)  # fmt: skip
ROS = ("rclpy.action", "rclpy.lifecycle", "rclpy.parameter_client")
INTERFACES = {
    "action_msgs": ("msg", "srv"),
    "builtin_interfaces": ("msg",),
    "diagnostic_msgs": ("msg", "srv"),
    "geometry_msgs": ("msg",),
    "lifecycle_msgs": ("msg", "srv"),
    "nav_msgs": ("msg", "srv"),
    "rcl_interfaces": ("msg", "srv"),
    "rosgraph_msgs": ("msg",),
    "sensor_msgs": ("msg", "srv"),
    "service_msgs": ("msg",),
    "std_msgs": ("msg",),
    "std_srvs": ("srv",),
    "test_msgs": ("action",),
    "type_description_interfaces": ("msg", "srv"),
    "unique_identifier_msgs": ("msg",),
}
"""Interface packages of the ROS 2 wheels, and their modules."""


def import_all(more: Iterable[str] = ()) -> None:
    """Import the modules above and ``more``, and load the interfaces' libraries."""
    for name in (*ROS, *COURSE, *more):
        import_module(name)
    for package, modules in INTERFACES.items():
        for module in modules:
            _load_type_support(import_module(f"{package}.{module}"))


def note_files() -> None:
    """Have the file of every module noted, once: IPython asks for each cell and traceback."""
    inspect.getmodule(note_files.__code__)


@contextmanager
def scratch_folder(*variables: str) -> Iterator[None]:
    """Name a folder in environment variables where modules can write while they are imported.

    A zygote has no home and nothing to write to. matplotlib lists the machine's fonts, which takes
    most of a second, and wants to keep the list; without a folder it cannot be imported at all.
    A list that it has kept for the user who grades is used.

    Raises:
        OSError: there is none to be had.
    """
    before = {name: os.environ[name] for name in variables if name in os.environ}
    with TemporaryDirectory(dir="/dev/shm") as folder:
        os.environ.update(dict.fromkeys(variables, folder))
        kept = Path(pwd.getpwuid(os.getuid()).pw_dir, ".cache", "matplotlib")
        try:
            for fonts in kept.glob("fontlist-*.json"):
                shutil.copy(fonts, folder)
            yield
        finally:
            for name in variables:
                del os.environ[name]
            os.environ.update(before)


def _load_type_support(interfaces: object) -> None:
    """Load the type support of interfaces, which rclpy else does when one is first used."""
    for interface in vars(interfaces).values():
        if isinstance(interface, type):
            with suppress(AttributeError):  # not an interface
                type(interface).__import_type_support__()  # type: ignore[attr-defined]
