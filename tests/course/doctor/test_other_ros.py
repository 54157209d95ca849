"""A ROS 2 that is there already, in place of the wheels: found by Python's path, as when sourced.

The wheels' own files play it: a folder laid out as /opt/ros/jazzy is, reached by the variables that
`source /opt/ros/jazzy/setup.bash` sets. The Python has everything but these wheels.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
Run = Callable[..., subprocess.CompletedProcess[str]]

WORK = """
from rclpy.node import Node
from std_msgs.msg import String
import rclpy, sys
assert "/jazzy/" in rclpy.__file__, rclpy.__file__
import course
with course.Session() as session:
    node = session.run(lambda: Node("talker"))
    publisher = node.create_publisher(String, "words", 10)
    node.create_timer(0.05, lambda: publisher.publish(String(data="hello")))
    print(session.next_message(String, "words", timeout=30).data)
with course.Session(sim_time=True) as session:
    times = []
    node = session.run(lambda: Node("ticker"))
    node.create_timer(0.1, lambda: times.append(node.get_clock().now()))
    session.sim.advance(1.0)
    print(len(times))
"""


@pytest.fixture(scope="module")
def sourced(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Give a way to run Python code with that ROS 2 sourced; more variables by name."""
    folder = tmp_path_factory.mktemp("machine")
    libraries, ros = folder / "libraries", folder / "opt" / "ros" / "jazzy"
    modules = ros / "lib" / "python" / "site-packages"
    for made in (libraries, modules):
        made.mkdir(parents=True)
    packages = Path(sys.prefix, "share/ament_index/resource_index/packages").iterdir()
    names = {path.name for path in packages}
    for path in Path(sysconfig.get_path("purelib")).iterdir():
        if path.name.startswith("ros_") and path.name.endswith(".dist-info"):
            continue  # what says that the wheels are installed
        is_ros = path.name.partition("-")[0] in names or path.name.startswith("ros_")
        if not path.name.endswith(".pth"):
            ((modules if is_ros else libraries) / path.name).symlink_to(path)
    shared = [path for path in Path(sys.prefix, "lib").iterdir() if path.is_file()]
    shared += Path(sysconfig.get_path("purelib")).glob("ros_*.libs/*")
    for name, path in {path.name: path for path in shared}.items():
        (ros / "lib" / name).symlink_to(path)
    for name in ("share", "include"):
        if Path(sys.prefix, name).exists():
            (ros / name).symlink_to(Path(sys.prefix, name))
    path = [str(modules), str(libraries), str(ROOT)]

    def run(code: str, *arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "AMENT_PREFIX_PATH": str(ros), "ROS_DISTRO": "jazzy"}
        environment.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
        environment |= {"LD_LIBRARY_PATH": str(ros / "lib"), "PYTHONPATH": ":".join(path)}
        base = getattr(sys, "_base_executable", sys.executable)
        return subprocess.run(
            [base, "-S", "-c", code, *arguments],
            env={**environment, **variables},
            cwd=folder, capture_output=True, text=True, timeout=150, check=False,
        )  # fmt: skip

    return run


@pytest.mark.parametrize("portable", ["0", "1"])
def test_nodes_run_on_it(sourced: Run, portable: str) -> None:
    done = sourced(WORK, COURSE_PORTABLE=portable)
    assert (done.stdout, done.returncode) == ("hello\n10\n", 0), done.stderr


def test_the_doctor_says_its_version_and_where_it_is(sourced: Run) -> None:
    command = "from course.command_line.launch import course; course()"
    done = sourced(command, "doctor", "--json")
    findings = {finding["name"]: finding for finding in json.loads(done.stdout)}
    assert findings["rclpy"]["message"].startswith("7.")
    assert "(ROS 2 Jazzy) of a ROS 2 that is installed here, in " in findings["rclpy"]["message"]
    assert "jazzy" in findings["rclpy"]["message"]
    for name in ("packages", "ROS 2 packages", "ROS 2", "round trip between processes"):
        assert findings[name]["status"] == "ok", findings[name]
    assert "sourced ROS" not in findings
