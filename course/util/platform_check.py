"""Whether ROS 2 can run here at all. Needs nothing but the standard library.

The ROS 2 wheels exist for CPython on Linux x86-64 only. Elsewhere a ROS 2 that is installed in
another way takes their place, and without one ``import rclpy`` fails with an error that helps
nobody. So this runs before anything imports it.
"""

from __future__ import annotations

import importlib.util
import platform
import sys

from course.errors import CourseError

OLDEST, NEWEST = (3, 11), (3, 14)
"""First and last CPython that nbgrader, ipykernel and the ROS 2 wheels all support."""

WHEELS_TORN = (
    "Parts of ROS 2 are gone from this Python: there is no rclpy in it. A second `uv sync` does "
    "that, as the ROS 2 wheels list what is in them under two names."
)
WHEELS_ANEW = (
    "Install all of it anew with `uv run --reinstall course doctor`, and use `uv run` from then on."
)
"""What is wrong where the packages are listed as installed, and rclpy is not; and how to mend it.

`uv sync` takes away what is not in its list: the metadata of the wheels ``ros-…`` names the modules
themselves (``rclpy``), and nothing asks for those. `uv run` leaves alone what it does not know.
"""


class UnsupportedPlatformError(CourseError):
    """A Python or a platform that the course cannot run on."""

    exit_code = 2


def find_problem(
    *,
    system: str | None = None,
    machine: str | None = None,
    implementation: str | None = None,
    version: tuple[int, int] | None = None,
    libc: str | None = None,
    ros: bool | None = None,
) -> str | None:
    """Return one sentence that says why the course cannot run, or None if it can.

    Args:
        system: as `platform.system` gives it; this machine's if left out, like all that follow.
        machine: as `platform.machine` gives it.
        implementation: as `platform.python_implementation` gives it.
        version: (major, minor) of Python.
        libc: name of the C library, as `platform.libc_ver` gives it; empty if it is not glibc.
        ros: whether Python finds an rclpy.
    """
    system = platform.system() if system is None else system
    machine = platform.machine() if machine is None else machine
    implementation = platform.python_implementation() if implementation is None else implementation
    version = sys.version_info[:2] if version is None else version
    if system == "Windows":
        return (
            "This course does not run on Windows itself: install WSL 2, with `wsl --install` in "
            "PowerShell, and run it there."
        )
    if implementation != "CPython" or not OLDEST <= version <= NEWEST:
        return (
            f"This course needs CPython {_version_text(OLDEST)} to {_version_text(NEWEST)}, not "
            f"{implementation} {_version_text(version)}: run it with another Python, for example "
            f"`uv run --python {_version_text((3, 12))} course lab`."
        )
    if has_wheels(system, machine, libc) or (has_rclpy() if ros is None else ros):
        return None
    return (
        f"There is no ROS 2 here: its wheels exist for Linux x86-64 with glibc only, not for "
        f"{system or 'this system'} {machine}, and Python finds no other rclpy; "
        "`source /opt/ros/jazzy/setup.bash` or activate RoboStack's environment, if you have one, "
        "or use a Linux x86-64 machine, a container or a JupyterHub."
    )


def has_wheels(system: str, machine: str, libc: str | None = None) -> bool:
    """Return whether there are ROS 2 wheels for a machine; the arguments are `find_problem`'s."""
    if (system, machine.lower()) not in {("Linux", "x86_64"), ("Linux", "amd64")}:
        return False
    return bool(platform.libc_ver()[0] if libc is None else libc)


def has_rclpy() -> bool:
    """Return whether Python finds an rclpy, without importing it."""
    return importlib.util.find_spec("rclpy") is not None


def require_supported_platform() -> None:
    """Return if the course can run here.

    Raises:
        UnsupportedPlatformError: it cannot; the message says why, and what to do.
    """
    if (sentence := find_problem()) is not None:
        raise UnsupportedPlatformError(sentence)


def _version_text(version: tuple[int, int]) -> str:
    return f"{version[0]}.{version[1]}"
