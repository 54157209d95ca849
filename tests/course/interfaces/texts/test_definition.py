"""What is said about a wrong name or a wrong text: the line, and what to write instead."""

from __future__ import annotations

import keyword

import pytest

from course.interfaces import installed
from course.interfaces.errors import DefinitionError
from course.interfaces.texts.definition import define_text
from course.interfaces.texts.type_names import TypeName, lower_case, parse_name

MESSAGE = TypeName("robot_msgs", "msg", "Probe")


def complaint(text: str, name: TypeName = MESSAGE) -> str:
    with pytest.raises(DefinitionError) as caught:
        define_text(name, text, {"Pose2"})
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ["package/kind/Name", "robot_msgs/srv/GetPose"]),
        ("robot_msgs/GetPose", ["package/kind/Name"]),
        ("robot_msgs/service/GetPose", ["service is not a kind", "msg, srv or action"]),
        ("Robot/srv/GetPose", ["Robot is not a valid package name", "lower-case"]),
        ("robot__msgs/srv/GetPose", ["robot__msgs is not a valid package name"]),
        ("import/srv/GetPose", ["import is not a valid package name"]),
        ("robot_msgs/srv/get_pose", ["get_pose is not a valid name", "as in GetPose"]),
        ("robot_msgs/srv/getPose", ["as in GetPose"]),
        ("robot_msgs/srv/Get_Pose", ["as in GetPose"]),
        ("robot_msgs/srv/2Poses", ["2Poses is not a valid name", "as in robot_msgs/srv/GetPose"]),
    ],
)
def test_a_wrong_name_is_explained(text: str, parts: list[str]) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_name(text)
    for part in parts:
        assert part in str(caught.value)


@pytest.mark.parametrize("name", ["GetPose", "HTTPGet", "Pose2D", "LaserScan3DPoints", "A", "X9y"])
def test_file_names_follow_rosidl(name: str) -> None:
    from rosidl_pycommon import convert_camel_case_to_lower_case_underscore

    assert lower_case(name) == convert_camel_case_to_lower_case_underscore(name)


@pytest.mark.parametrize(
    ("line", "parts"),
    [
        ("int32", ["expected a type and then a name", "`int32 order`"]),
        ("int32 x;", ["has no ';' at its end"]),
        ("x: int32", ["type first", "without a colon"]),
        ("order int32", ["write `int32 order`"]),
        ("float65 x", ["no type float65", "did you mean float64"]),
        ("Strin s", ["did you mean string"]),
        ("int x", ["int32 or int64"]),
        ("double x", ["float64"]),
        ("str x", ["use string"]),
        ("time t", ["builtin_interfaces/Time"]),
        ("Header header", ["did you mean std_msgs/Header?"]),
        ("geometry_msgs/Pos p", ["no type geometry_msgs/Pos", "geometry_msgs/Pose"]),
        ("geometry_msg/Pose p", ["did you mean geometry_msgs/Pose"]),
        ("geometry_msgs/msg/Pose p", ["write geometry_msgs/Pose, without msg"]),
        ("std_srvs/SetBool s", ["std_srvs/SetBool is a service"]),
        ("nowhere_msgs/Zebra z", ["no package nowhere_msgs"]),
        ("Zebra z", ["define robot_msgs/msg/Zebra in a cell above"]),
        ("Pose3 p", ["did you mean robot_msgs/Pose2"]),
        ("Probe p", ["no type Probe"]),
        ("int32 targetPose", ["target_pose, not targetPose"]),
        ("int32 _x", ["lower case", "_x"]),
        ("int32 class", ["class cannot name a field"]),
        ("int32 from", ["from cannot name a field"]),
        ("int32 [] x", ["`int32[] data`"]),
        ("int32 x[]", ["not the name"]),
        ("int32[0] x", ["above 0, not '0'"]),
        ("int32[-1] x", ["above 0, not '-1'"]),
        ("int32] x", ["int32] is not a type"]),
        ("string<=0 s", ["string<=20"]),
        ("bool ready maybe", ["expected one name after the type", "'maybe'"]),
        ("bool ready 5", ["bool"]),
        ("int8 level 300", ["<= 127"]),
        ("float32 x nan", ["finite number"]),
        ("int32[3] a [1, 2]", ["exactly 3 elements, not 2"]),
        ("geometry_msgs/Pose p 3", ["cannot have a default value"]),
        ("string s 'open", ["not closed"]),
        (r"string s 'C:\new'", ["a backslash may stand before a quote only"]),
        ("uint8 STOP=", ["needs a value"]),
        ("uint8 STOP=256", ["<= 255"]),
        ("uint8 stop=0", ["UPPER_CASE", "`uint8 STOP=0`", "default value"]),
        ("geometry_msgs/Pose HOME=1", ["a constant has a basic type"]),
        ("---", ["a message has one part"]),
    ],
)
def test_a_wrong_line_is_named_and_explained(line: str, parts: list[str]) -> None:
    said = complaint(f"# a comment\nint32 first\n\n{line}   # why\n")
    assert said.startswith(f"robot_msgs/msg/Probe, line 4 (`{line}`): ")
    assert said.endswith((".", "?"))
    assert "\n" not in said
    for part in parts:
        assert part in said


def test_a_name_is_used_once_in_a_part_and_again_in_the_next() -> None:
    assert "the name x is used twice" in complaint("int32 x\nstring x\n")
    service = TypeName("robot_msgs", "srv", "Ask")
    assert define_text(service, "int32 x\n---\nint32 x\n").text == "int32 x\n---\nint32 x\n"


@pytest.mark.parametrize(
    ("kind", "text", "part"),
    [
        ("srv", "int32 x\n", "one line of three dashes"),
        ("srv", "---\n---\n", "line 2 (`---`): expected one line of three dashes"),
        ("srv", "int32 x\n----\nint32 y\n", "line 2 (`----`): expected exactly three dashes"),
        ("action", "int32 x\n---\nint32 y\n", "goal, ---, result, ---, feedback; found 1"),
        ("action", "---\n---\n---\n", "line 3"),
    ],
)
def test_parts_are_counted(kind: str, text: str, part: str) -> None:
    assert part in complaint(text, TypeName("robot_msgs", kind, "Probe"))


def test_comments_and_blanks_are_no_part_of_a_definition() -> None:
    plain = define_text(MESSAGE, "int32 x\nfloat64[] y\n")
    dressed = define_text(MESSAGE, "# 21 °C\n\n  int32   x # first\n\tfloat64[]\ty\n\n")
    assert dressed.text.split() == plain.text.split()
    again = define_text(MESSAGE, "int32 x  # another comment\nfloat64[] y\n")
    assert again == plain


def test_references_are_sorted_out() -> None:
    text = "Pose2 a\nrobot_msgs/Pose2[] b\ngeometry_msgs/Pose c\nstd_msgs/Header d\n"
    definition = define_text(MESSAGE, text, {"Pose2"})
    assert definition.own == ("Pose2",)
    assert definition.packages == ("geometry_msgs", "std_msgs")


def test_every_installed_interface_passes() -> None:
    names = [
        TypeName(p, *i.split("/")) for p, found in installed.read_index().items() for i in found
    ]
    assert len(names) > 150
    for name in names:
        text = installed.prefix_of(name.package) / "share" / name.package / name.relative_path
        own = installed.message_names(name.package)
        assert parse_name(str(name)) == name
        define_text(name, text.read_text(encoding="utf-8"), own)


def test_no_keyword_of_python_names_a_field() -> None:
    for word in keyword.kwlist:
        assert f"(`int32 {word}`)" in complaint(f"int32 {word}\n")
