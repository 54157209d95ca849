"""Python, the platform, and the packages that the course stands on."""

from __future__ import annotations

import platform
import shutil
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

from course.doctor import ros_origin
from course.doctor.finding import HealthFinding, make_ok, make_problem, make_warning
from course.util.platform_check import find_problem as platform_problem

DISTRIBUTION = "ros2-course"
_SHOWN = ("ros-jazzy-rclpy", "jupyterlab", "nbgrader", "ipykernel")
_REINSTALL = "In the course's folder run `uv sync`, or `pip install .` in this environment."


def examine_software() -> Iterator[HealthFinding]:
    """Yield what there is to say about Python, packages, compiler and kernel."""
    yield check_python()
    yield check_packages()
    yield check_kernel()
    yield check_compiler()


def check_python(sentence: str | None = None) -> HealthFinding:
    """Look at Python and the platform; ``sentence`` says what is wrong with them, if known."""
    sentence = sentence or platform_problem()
    if sentence:
        return make_problem("Python", sentence)
    here = f"{platform.python_implementation()} {platform.python_version()}"
    return make_ok("Python", f"{here} on {platform.system()} {platform.machine()}, {sys.prefix}")


def check_packages(distribution: str = DISTRIBUTION) -> HealthFinding:
    """Compare every package that ``distribution`` requires with what is installed.

    The ROS 2 wheels are not asked for where a ROS 2 that was installed in another way is found.
    """
    name = "packages"
    origin = ros_origin.find_origin()
    has_other_ros = origin is not None and not origin.from_wheels
    try:
        required = [Requirement(text) for text in metadata.requires(distribution) or ()]
    except metadata.PackageNotFoundError:
        return make_problem(
            name, f"{distribution} is not installed in this environment.", _REINSTALL
        )
    versions, wrong = {}, []
    for requirement in required:
        if requirement.marker and not requirement.marker.evaluate({"extra": ""}):
            continue
        if has_other_ros and requirement.name.startswith(ros_origin.WHEEL_PREFIX):
            continue
        try:
            version = versions[requirement.name] = metadata.version(requirement.name)
        except metadata.PackageNotFoundError:
            wrong.append(f"{requirement.name} is missing")
            continue
        if not requirement.specifier.contains(version, prereleases=True):
            wrong.append(f"{requirement.name} {version} is not {requirement.specifier}")
    if wrong:
        return make_problem(name, f"{'; '.join(wrong)}.", _REINSTALL)
    shown = ", ".join(f"{key} {versions[key]}" for key in _SHOWN if key in versions)
    return make_ok(name, f"{shown}; all {len(versions)} in their tested range")


def check_kernel() -> HealthFinding:
    """Look whether JupyterLab's Python kernel is this Python, and not another one's."""
    from jupyter_client.kernelspec import KernelSpecManager, NoSuchKernel

    name = "kernel"
    try:
        spec = KernelSpecManager().get_kernel_spec("python3")
    except NoSuchKernel:
        return make_problem(name, "JupyterLab has no Python kernel here.", _REINSTALL)
    program = shutil.which(spec.argv[0]) if spec.argv[0] != "python" else sys.executable
    # Not resolved: two virtual environments link to one and the same interpreter.
    if program is None or Path(program).parent.absolute() != Path(sys.executable).parent.absolute():
        return make_problem(
            name,
            f"JupyterLab's Python kernel starts {spec.argv[0]}, another Python than this one, and "
            "it knows nothing of the course.",
            f"Remove the folder {spec.resource_dir}.",
        )
    return make_ok(name, "JupyterLab's Python kernel is this Python")


def check_compiler() -> HealthFinding:
    """Look for what building ROS interfaces needs."""
    from course.interfaces.building.toolchain import compiler_problem

    sentence = compiler_problem()
    if sentence is None:
        return make_ok(
            "compiler", "C, C++ and Python's headers are there: interfaces are built for real"
        )
    return make_warning(
        "compiler",
        "example_interfaces cannot be built, so installed types of the same shape stand in for it, "
        "and %%interface does not work.",
        sentence,
    )
