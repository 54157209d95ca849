"""Recordings come back out of an MCAP file as they went in, read by somebody else's reader."""

from __future__ import annotations

import array
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, PoseStamped
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.node import Node
from std_msgs.msg import Header, String
from test_msgs.msg import (
    Arrays,
    BasicTypes,
    BoundedSequences,
    Defaults,
    Empty,
    MultiNested,
    Nested,
    Strings,
    UnboundedSequences,
)

import course
from course import Session
from course.messages import mcap_file
from course.messages.mcap_file import RecordingError
from course.messages.values import to_data
from tests.machine import needs_compiler


def read(path: Path) -> list[Any]:
    """Return (schema, channel, message, decoded message) of each message, as Foxglove reads it."""
    with path.open("rb") as file:
        return list(make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())


def as_data(decoded: Any) -> Any:
    """Return a message that mcap_ros2 has decoded as `to_data` would, whatever it nests."""
    if hasattr(decoded, "__slots__"):
        names = [n for n in decoded.__slots__ if n != "structure_needs_at_least_one_member"]
        return {name: as_data(getattr(decoded, name)) for name in names}
    if isinstance(decoded, list | tuple | bytes | array.array):
        return [as_data(item) for item in decoded]
    return decoded


class Talker(Node):
    """Publishes numbered messages."""

    def __init__(self) -> None:
        super().__init__("talker")
        publisher = self.create_publisher(String, "chatter", 10)
        self.sent = 0

        def publish() -> None:
            self.sent += 1
            publisher.publish(String(data=f"{self.sent}"))

        self.create_timer(0.01, publish)


def test_a_recording_is_read_back_in_order(session: Session, tmp_path: Path) -> None:
    session.run(Talker)
    with session.record("chatter", String) as recorder:
        recorder.wait(5)
    path = recorder.save(tmp_path / "chatter")
    assert path == tmp_path / "chatter.mcap"
    found = read(path)
    assert [m[3].data for m in found] == [s.message.data for s in recorder.messages]
    assert [m[2].log_time for m in found] == [s.stamp_ns for s in recorder.messages]
    assert {m[1].topic for m in found} == {"/chatter"}
    assert found[0][0].name == "std_msgs/msg/String"


@pytest.mark.parametrize(
    "message",
    [
        Arrays(int8_values=[-1, 0, 1], byte_values=[b"\x01", b"\x02", b"\xff"]),
        BasicTypes(int32_value=-7, float64_value=0.5, byte_value=b"\x07"), Empty(),
        Nested(basic_types_value=BasicTypes(bool_value=True, uint64_value=2**64 - 1)),
        MultiNested(array_of_arrays=[Arrays(string_values=["a", "b", str(n)]) for n in range(3)]),
        Strings(string_value="äöü", bounded_string_value="x" * 22),
        UnboundedSequences(string_values=["a", ""], float32_values=[0.5, -1.0]),
        BoundedSequences(bool_values=[True, False], byte_values=[b"\x09"]), Defaults(),
        PoseStamped(header=Header(frame_id="map"), pose=Pose(position=Point(x=1.5))),
    ],
    ids=lambda message: type(message).__name__,
)  # fmt: skip
def test_every_kind_of_field_survives(message: object, tmp_path: Path) -> None:
    path = mcap_file.write_recordings(tmp_path / "x.mcap", {"/x": (type(message), [(1, message)])})
    ((_, _, _, decoded),) = read(path)
    assert as_data(decoded) == to_data(message, None)


@needs_compiler
def test_own_interfaces_are_written_with_their_definition(tmp_path: Path) -> None:
    own = course.interfaces.define("mcap_msgs/msg/Reading", "float64 value\nstring[] names\n")
    message = own(value=1.5, names=["a"])
    path = mcap_file.write_recordings(tmp_path / "x.mcap", {"/x": (own, [(1, message)])})
    ((_, _, _, decoded),) = read(path)
    assert (decoded.value, list(decoded.names)) == (1.5, ["a"])


def test_a_place_that_cannot_be_written_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"cannot be written to .*nowhere/x\.mcap"):
        mcap_file.write_recordings(tmp_path / "nowhere" / "x", {})


@pytest.mark.parametrize("path", ["", ".", "/", "a\0b", "x" * 300])
def test_a_name_that_is_none_is_a_sentence(session: Session, path: str) -> None:
    recorder = session.record("chatter", String)
    with pytest.raises(RecordingError, match="name a file"):
        recorder.save(path)
