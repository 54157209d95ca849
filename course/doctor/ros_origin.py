"""Which ROS 2 this Python has: the course's wheels, or one that was there before."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from course.doctor.finding import HealthFinding, make_ok, make_warning
from course.interfaces import installed

WHEEL = "ros-jazzy-rclpy"
WHEEL_PREFIX = "ros-jazzy-"
DISTRIBUTIONS = {"7": "Jazzy", "9": "Kilted"}
"""Distributions of ROS 2 that the course is made for, by the major version of their rclpy."""

_INDEX = Path("share/ament_index/resource_index/packages")


class RosOrigin(NamedTuple):
    """The rclpy that Python finds: its version (empty if it says none), and where it comes from."""

    version: str
    folder: Path
    from_wheels: bool


def find_origin() -> RosOrigin | None:
    """Return which rclpy this Python finds; None if it finds none. Imports nothing."""
    spec = importlib.util.find_spec("rclpy")
    if spec is None or spec.origin is None:
        return None
    folder = Path(spec.origin).parent.parent
    found = next(iter(metadata.distributions(name="rclpy", path=[str(folder)])), None)
    wheels = any(metadata.distributions(name=WHEEL, path=[str(folder)]))
    return RosOrigin(found.version if found else "", folder, wheels)


def check_origin(origin: RosOrigin) -> HealthFinding:
    """Say which rclpy there is, and whether the course is made for it."""
    name = "rclpy"
    distribution = DISTRIBUTIONS.get(origin.version.partition(".")[0])
    source = "the course's wheels" if origin.from_wheels else "a ROS 2 that is installed here"
    if distribution:
        text = f"{origin.version} (ROS 2 {distribution}) of {source}, in {origin.folder}"
        return make_ok(name, text)
    return make_warning(
        name,
        f"{origin.version or 'a version that it does not say'} of {source}, in {origin.folder}: "
        f"the course is made for ROS 2 {' and '.join(DISTRIBUTIONS.values())}.",
        "Use one of these if something does not work.",
    )


def missing_packages(wheels: Iterable[str]) -> list[str]:
    """Return which ROS packages an installed ROS 2 lacks, given the wheels that it stands for."""
    names = [wheel.removeprefix(WHEEL_PREFIX).replace("-", "_") for wheel in wheels]
    prefixes = installed.ament_prefixes()
    return [name for name in names if not any((p / _INDEX / name).exists() for p in prefixes)]


def install_advice(packages: Iterable[str]) -> str:
    """Return how to install ROS packages into the ROS 2 that is here."""
    chosen = os.environ.get("ROS_DISTRO", "jazzy")
    debian = " ".join(f"ros-{chosen}-{name.replace('_', '-')}" for name in packages)
    return f"Run `sudo apt install {debian}`, or install packages of these names with conda."
