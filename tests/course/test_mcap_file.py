"""Recordings come back out of an MCAP file as they went in, read by somebody else's reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.node import Node
from std_msgs.msg import String
from test_msgs.msg import Arrays, BasicTypes, Empty, Nested, Strings, UnboundedSequences

import course
from course import Session, mcap_file
from course.mcap_file import RecordingError
from course.values import to_data


def read(path: Path) -> list[Any]:
    """Return (schema, channel, message, decoded message) of each message, as Foxglove reads it."""
    with path.open("rb") as file:
        return list(make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())


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
        Arrays(), BasicTypes(int32_value=-7, float64_value=0.5), Empty(), Nested(),
        Strings(string_value="äöü"), UnboundedSequences(string_values=["a", ""]), PoseStamped(),
    ],
    ids=lambda message: type(message).__name__,
)  # fmt: skip
def test_every_kind_of_field_survives(message: object, tmp_path: Path) -> None:
    path = mcap_file.write(tmp_path / "x.mcap", {"/x": (type(message), [(1, message)])})
    ((_, _, _, decoded),) = read(path)
    for name, value in to_data(message, None).items():
        if not isinstance(value, dict | list):
            assert getattr(decoded, name) == value, name


def test_own_interfaces_are_written_with_their_definition(tmp_path: Path) -> None:
    own = course.interfaces.define("mcap_msgs/msg/Reading", "float64 value\nstring[] names\n")
    message = own(value=1.5, names=["a"])
    path = mcap_file.write(tmp_path / "x.mcap", {"/x": (own, [(1, message)])})
    ((_, _, _, decoded),) = read(path)
    assert (decoded.value, list(decoded.names)) == (1.5, ["a"])


def test_a_place_that_cannot_be_written_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"nowhere/x\.mcap cannot be written"):
        mcap_file.write(tmp_path / "nowhere" / "x", {})
