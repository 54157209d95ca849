"""Recordings as MCAP files, which Foxglove, PlotJuggler and ``ros2 bag`` read."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from mcap.writer import Writer
from rclpy.serialization import serialize_message

from course.errors import CourseError
from course.messages import values
from course.messages.types import type_name
from course.util import argument_checks
from course.util.files import replace_file

_RULE = "=" * 80


class RecordingError(CourseError):
    """A recording that cannot be written; the message says where, and what to do."""


def write_recordings(
    path: str | Path, recordings: Mapping[str, tuple[Any, Sequence[tuple[int, Any]]]]
) -> Path:
    """Write recordings to an MCAP file of profile "ros2"; return its path.

    Args:
        path: the file; ".mcap" is added if it has no suffix. One that is there is replaced.
        recordings: {topic: (message class, [(time in ns, message), ...])}, where a message that is
            bytes is CDR already.

    Raises:
        RecordingError: the file cannot be written.
        SessionError: the path is no path.
    """
    if not isinstance(path, Path):
        path = Path(argument_checks.check_text(path, "The path", "scan.mcap"))
    try:
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        path = path if path.suffix else path.with_suffix(".mcap")
        with replace_file(path) as file:
            _write_messages(file, recordings)
    except (OSError, ValueError) as error:  # an empty name, or one with a NUL, is a ValueError
        reason = getattr(error, "strerror", None) or str(error)
        raise RecordingError(
            f"The recording cannot be written to {str(path)!r} ({reason}): name a file, as in "
            "'scan.mcap', in a folder that you may write to."
        ) from error
    return path


def definition_text(msg_type: Any) -> str:
    """Return the text of a message definition, the messages that it contains below it."""
    parts: dict[str, str] = {}
    _collect_definitions(msg_type, parts)
    first, *rest = parts.items()
    texts = [first[1], *(f"{_RULE}\nMSG: {name}\n{text}" for name, text in rest)]
    return "\n".join(texts)


def _write_messages(
    file: IO[bytes], recordings: Mapping[str, tuple[Any, Sequence[tuple[int, Any]]]]
) -> None:
    writer = Writer(file)
    writer.start(profile="ros2", library="ros2-course")
    schemas: dict[str, int] = {}
    channels = {}
    for topic, (msg_type, _) in recordings.items():
        name = type_name(msg_type)
        if name not in schemas:
            schemas[name] = writer.register_schema(
                name, "ros2msg", definition_text(msg_type).encode()
            )
        channels[topic] = writer.register_channel(topic, "cdr", schemas[name])
    for number, (stamp, topic, message) in enumerate(_in_order(recordings)):
        writer.add_message(
            channels[topic], log_time=stamp, publish_time=stamp, sequence=number,
            data=message if isinstance(message, bytes) else serialize_message(message),
        )  # fmt: skip
    writer.finish()  # type: ignore[no-untyped-call]


def _in_order(
    recordings: Mapping[str, tuple[Any, Sequence[tuple[int, Any]]]],
) -> Iterator[tuple[int, str, Any]]:
    rows = [
        (stamp, topic, message)
        for topic, (_, stamped) in recordings.items()
        for stamp, message in stamped
    ]
    return iter(sorted(rows, key=lambda row: row[0]))


def _collect_definitions(msg_type: Any, parts: dict[str, str]) -> None:
    package, _, name = type_name(msg_type).split("/")
    key = f"{package}/{name}"
    if key in parts:
        return
    parts[key] = ""  # its place is before what it contains
    lines = []
    for field, slot in values.all_fields(msg_type):
        lines.append(f"{values.in_words(slot)} {field}")
        inner = getattr(slot, "value_type", slot)
        if hasattr(inner, "namespaces"):
            _collect_definitions(values.class_of(inner), parts)
    parts[key] = "\n".join(lines) + "\n"
