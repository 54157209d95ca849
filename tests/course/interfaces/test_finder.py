"""The import hook: who wins, what is said, and what stands in where nothing can be built."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from course.interfaces import finder
from course.interfaces.building import cache
from course.interfaces.building.toolchain import python_headers
from tests.machine import needs_compiler

NO_COMPILER = {"PATH": "/nonexistent", "CC": "", "CXX": ""}


@pytest.fixture
def prebuilt(built: Path) -> dict[str, str]:
    return {"COURSE_INTERFACES_CACHE": str(built)}


@needs_compiler
def test_importing_the_hook_builds_nothing(python) -> None:
    done = python("""
import importlib.util, sys
assert importlib.util.find_spec("example_interfaces") is not None
assert "example_interfaces" not in sys.modules
assert "numpy" not in sys.modules and "rclpy" not in sys.modules
interfaces.install()
print([type(f).__module__ for f in sys.meta_path].count("course.interfaces.finder"))
print(interfaces.status()["example_interfaces"])
""")
    assert (done.stdout, done.stderr) == ("1\nunbuilt\n", "")


def test_an_installed_package_wins(python, tmp_path: Path) -> None:
    package = tmp_path / "site/example_interfaces/srv"
    package.mkdir(parents=True)
    (package.parent / "__init__.py").write_text("", encoding="utf-8")
    (package / "__init__.py").write_text("SetBool = 'the installed one'", encoding="utf-8")
    done = python(
        """
print(interfaces.status()["example_interfaces"], interfaces.ensure("example_interfaces"))
from example_interfaces.srv import SetBool
print(SetBool, interfaces.status()["example_interfaces"])
""",
        PYTHONPATH=str(tmp_path / "site"),
    )
    assert (done.stdout, done.stderr) == ("ros ros\nthe installed one ros\n", "")


def test_it_is_imported_in_every_way_that_python_has(python, prebuilt) -> None:
    done = python(
        """
import importlib, pickle
import example_interfaces.srv
from example_interfaces.srv import SetBool, SetBool_Request
from example_interfaces import action
assert SetBool.Request is SetBool_Request
assert example_interfaces.srv.SetBool is SetBool
assert importlib.reload(example_interfaces.srv).SetBool is SetBool
assert importlib.reload(example_interfaces).srv.SetBool is SetBool
assert pickle.loads(pickle.dumps(SetBool)) is SetBool
try:
    from example_interfaces.srv import Missing
except ImportError as error:
    print(type(error).__name__)
""",
        **prebuilt,
    )
    assert (done.stdout, done.stderr) == ("ImportError\n", "")


def test_threads_that_import_at_once_get_the_same_type(python, prebuilt) -> None:
    done = python(
        """
from concurrent.futures import ThreadPoolExecutor
def get(number):
    from example_interfaces.srv import SetBool
    made = interfaces.define("thread_msgs/msg/Same", "int32 x")
    return SetBool, made
with ThreadPoolExecutor(8) as pool:
    print(len(set(pool.map(get, range(8)))))
""",
        **prebuilt,
    )
    assert (done.stdout, done.stderr) == ("1\n", "")


def test_without_a_compiler_same_shaped_types_stand_in_and_it_is_said_once(python) -> None:
    done = python(
        """
from example_interfaces.srv import SetBool, Trigger
from example_interfaces.action import Fibonacci
import importlib, example_interfaces
importlib.reload(example_interfaces)
import std_srvs.srv, test_msgs.action
assert SetBool is std_srvs.srv.SetBool and Trigger is std_srvs.srv.Trigger
assert Fibonacci is test_msgs.action.Fibonacci
SetBool.Request(data=True), Fibonacci.Goal(order=5), Fibonacci.Feedback(sequence=[0, 1])
assert interfaces.status()["example_interfaces"] == "stand-in"
assert not hasattr(example_interfaces.srv, "Nonsense")
try:
    from example_interfaces.srv import AddTwoInts
except ImportError as error:
    print(error)
""",
        **NO_COMPILER,
    )
    assert done.stderr == ""
    note, no_stand_in = done.stdout.splitlines()
    headers = "" if python_headers() else " and Python's headers (Python.h)"
    for part in (
        "std_srvs/srv/SetBool, std_srvs/srv/Trigger, test_msgs/action/Fibonacci",
        "on the network a type is called std_srvs/srv/SetBool, not example_interfaces/srv/SetBool",
        f"a C compiler (gcc) and a C++ compiler (g++){headers}, not found here",
        "apt-get install g++ python3-dev",
    ):
        assert part in note
    assert no_stand_in.startswith("example_interfaces/srv/AddTwoInts is not available")
    assert "apt-get install g++ python3-dev" in no_stand_in


def test_without_a_compiler_the_rest_is_one_clear_sentence(python) -> None:
    done = python(
        """
assert interfaces.status()["example_interfaces"] == "stand-in"
for work in (
    lambda: interfaces.define("robot_msgs/msg/Pose2", "float64 x"),
    lambda: interfaces.ensure("example_interfaces"),
):
    try:
        work()
    except interfaces.CompilerMissingError as error:
        assert str(error) == interfaces.compiler_problem()
        print(error)
""",
        **NO_COMPILER,
    )
    assert done.stderr == ""
    assert len(done.stdout.splitlines()) == 2


@needs_compiler
def test_a_compiler_that_fails_is_quoted_and_leaves_stand_ins(python) -> None:
    done = python(
        "from example_interfaces.srv import SetBool\nprint(SetBool.__module__)", CC="false"
    )
    assert done.stderr == ""
    note, module = done.stdout.splitlines()
    assert "because false failed: it ended with code 1" in note
    assert module == "std_srvs.srv._set_bool"


def test_the_command_says_what_is_missing_and_fails(environment, tmp_path: Path) -> None:
    import subprocess
    import sys

    done = subprocess.run(
        [sys.executable, "-m", "course.interfaces"],
        env={**environment, **NO_COMPILER},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("Building ROS interfaces needs a C compiler")
    assert len(done.stderr.splitlines()) == 1


def test_an_unknown_bundled_package_is_named(python) -> None:
    done = python("""
try:
    interfaces.ensure("turtlesim")
except interfaces.DefinitionError as error:
    print(error)
""")
    assert done.stdout == "The course does not build turtlesim; it builds example_interfaces.\n"


@needs_compiler
def test_an_own_package_after_a_restart_names_the_cell_to_run(python) -> None:
    done = python("""
interfaces.define("robot_msgs/srv/GetPose", "string robot\\n---\\nfloat64 x")
interfaces.define("robot_msgs/msg/Wheel", "float64 speed")
""")
    assert (done.stdout, done.stderr) == ("", "")
    done = python("""
import importlib.util
for statement in ("import robot_msgs", "from robot_msgs.srv import GetPose"):
    try:
        exec(statement)
    except ModuleNotFoundError as error:
        print(type(error).__name__, error)
try:
    import other_msgs
except ModuleNotFoundError as error:
    print(type(error).__name__)
interfaces.define("robot_msgs/srv/GetPose", "string robot\\n---\\nfloat64 x")
from robot_msgs.srv import GetPose
print(GetPose.Response(x=1.0).x)
""")
    sentence = (
        "NotDefinedYetError robot_msgs is a package of your own, and this kernel does not know it "
        "yet: run the cells `%%interface robot_msgs/msg/Wheel` and "
        "`%%interface robot_msgs/srv/GetPose` first, and then this one again.\n"
    )
    assert done.stderr == ""
    assert done.stdout == 2 * sentence + "ModuleNotFoundError\n1.0\n"


def test_a_missing_dependency_of_the_cache_is_no_endless_recursion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def root() -> Path:
        importlib.import_module("platformdirs_that_nobody_installed")
        raise AssertionError("it is not there")

    finder.install()
    monkeypatch.setattr(cache, "root", root)
    assert importlib.util.find_spec("some_package_that_is_not_there") is None
    with pytest.raises(ModuleNotFoundError, match="nobody_installed"):
        cache.root()
