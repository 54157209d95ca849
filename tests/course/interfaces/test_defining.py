"""A learner's own types in one process: names that are taken, changes, and restarts."""

from __future__ import annotations

import pytest

from course import interfaces
from course.interfaces import DefinitionError, RestartNeededError, Source

pytestmark = pytest.mark.usefixtures("here")


def test_a_changed_definition_is_built_and_asks_for_a_restart(python, built) -> None:
    first = interfaces.define("change_msgs/msg/Pose2", "float64 x\n")
    assert interfaces.define("change_msgs/msg/Pose2", "# in metres\nfloat64 x  # east\n") is first
    with pytest.raises(RestartNeededError, match="restart the kernel"):
        interfaces.define("change_msgs/msg/Pose2", "float64 x\nfloat64 y\n")
    from change_msgs.msg import Pose2

    assert Pose2 is first
    assert interfaces.define("change_msgs/msg/Pose2", "float64 x\n") is first
    # The new process has no compiler: what it uses was built above.
    done = python(
        "made = interfaces.define('change_msgs/msg/Pose2', 'float64 x\\nfloat64 y\\n')\n"
        "print(made(y=2.0).y, interfaces.status()['change_msgs'])",
        COURSE_INTERFACES_CACHE=str(built),
        PATH="/nonexistent",
    )
    assert (done.stdout, done.stderr) == ("2.0 built\n", "")


def test_a_package_can_grow(python) -> None:
    get = interfaces.define("grow_msgs/srv/GetPose", "---\nfloat64 x\n")
    import grow_msgs.srv

    put = interfaces.define("grow_msgs/srv/SetPose", "float64 x\n---\n")
    from grow_msgs.srv import GetPose, SetPose

    assert (GetPose, SetPose) == (get, put)
    assert grow_msgs.srv.SetPose is put
    assert interfaces.status()["grow_msgs"] is Source.BUILT


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("std_msgs/msg/String", ["std_msgs is an existing ROS package", "my_std_msgs/msg/String"]),
        ("std_msgs/msg/Novel", ["std_msgs is an existing ROS package"]),
        ("example_interfaces/srv/SetBool", ["existing ROS package"]),
        ("rclpy/msg/Novel", ["rclpy is an installed Python package"]),
        ("json/msg/Novel", ["json is an installed Python package"]),
        ("sys/msg/Novel", ["sys is an installed Python package"]),
        ("course/msg/Novel", ["course is an installed Python package"]),
    ],
)
def test_a_package_that_exists_is_not_redefined(name: str, parts: list[str]) -> None:
    with pytest.raises(DefinitionError) as caught:
        interfaces.define(name, "int32 x\n" + ("---\n" if "/srv/" in name else ""))
    for part in parts:
        assert part in str(caught.value)


def test_names_that_share_a_file_are_refused() -> None:
    interfaces.define("twin_msgs/msg/HTTPGet", "int32 x\n")
    with pytest.raises(DefinitionError, match="share the file name http_get"):
        interfaces.define("twin_msgs/msg/HttpGet", "int32 x\n")


def test_a_folder_beside_the_notebook_does_not_take_the_name(python, built, tmp_path) -> None:
    (tmp_path / "folder_msgs").mkdir()
    done = python(
        "print(interfaces.define('folder_msgs/msg/Novel', 'int32 x\\n').__module__)",
        COURSE_INTERFACES_CACHE=str(built),
    )
    assert (done.stdout, done.stderr) == ("folder_msgs.msg._novel\n", "")


def test_what_is_refused_leaves_nothing_behind() -> None:
    with pytest.raises(DefinitionError):
        interfaces.define("refused_msgs/msg/Wrong", "int32\n")
    with pytest.raises(ModuleNotFoundError):
        __import__("refused_msgs")
    assert "refused_msgs" not in interfaces.status()
