"""What is generated is what ROS generates: the type hashes (REP 2011) are the same."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from course.interfaces import installed
from course.interfaces.building.unit import Unit, generate_sources
from course.interfaces.texts.definition import define_text
from course.interfaces.texts.type_names import TypeName

# From the wild, not from these wheels: rmw_zenoh's design document (AddTwoInts), and other
# implementations of RIHS01 that test against a ROS 2 installation (Fibonacci's services).
PUBLISHED = {
    "srv/AddTwoInts": "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a",
    "action/Fibonacci_SendGoal": (
        "RIHS01_d1a57fb2a4afe8c21e34fb10db206f16ce6729b28531141472df92277c55b557"
    ),
    "action/Fibonacci_GetResult": (
        "RIHS01_1b0de0d5d29dc955d92f546706568428632771db13ec84c15ec1c1a59f424a57"
    ),
}


def hashes(file: Path) -> dict[str, str]:
    content = json.loads(file.read_text(encoding="utf-8"))
    return {entry["type_name"]: entry["hash_string"] for entry in content["type_hashes"]}


def test_the_bundled_types_have_the_hashes_that_ros_publishes(built: Path) -> None:
    (folder,) = built.glob("*/example_interfaces/*/include/example_interfaces")
    for name, published in PUBLISHED.items():
        assert hashes(folder / f"{name}.json")[f"example_interfaces/{name}"] == published


@pytest.mark.parametrize(
    ("package", "types"),
    [
        ("std_srvs", ["srv/SetBool", "srv/Trigger", "srv/Empty"]),
        (
            "geometry_msgs",
            ["msg/Point", "msg/Quaternion", "msg/Pose", "msg/PoseStamped"],
        ),
        ("test_msgs", ["action/Fibonacci", "msg/WStrings", "msg/Nested", "msg/BasicTypes"]),
    ],
)
def test_an_installed_package_generated_again_has_its_own_hashes(
    package: str, types: list[str], tmp_path: Path
) -> None:
    share = installed.prefix_of(package) / "share" / package
    names = [TypeName(package, *t.split("/")) for t in types]
    # A unit is generated as a whole, so its definitions may refer to each other.
    own = [name.name for name in names if name.kind == "msg"]
    texts = [(name, (share / name.relative_path).read_text(encoding="utf-8")) for name in names]
    unit = Unit(package, tuple(define_text(name, text, own) for name, text in texts))
    sources = tmp_path / "sources" / package
    generate_sources(unit, tmp_path, sources)
    for name in names:
        path = Path(name.kind) / f"{name.name}.json"
        assert hashes(sources / path) == hashes(share / path)
