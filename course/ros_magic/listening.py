"""Listen to a topic: ``echo`` shows its messages, ``hz`` measures their rate."""

from __future__ import annotations

import itertools
import statistics
from typing import Any

from course.errors import SessionError, WaitTimeout
from course.learner_session import default_session
from course.messages import values, yaml_text
from course.ros_magic.options import Add
from course.ros_magic.options import declare_timeout as add_timeout
from course.ros_magic.qos import declare_options as declare_qos
from course.ros_magic.qos import profile_from_options
from course.ros_magic.topic_types import message_type
from course.runtime.requests.graph_queries import full_topic
from course.runtime.waiting import Deadline
from course.util.argument_checks import check_seconds, check_whole_number

_ENOUGH = 20  # messages for a rate that one late message does not spoil


def echo(
    topic: str, asked: str, count: int, timeout: float, field: str, longest: int, flow_style: bool,
    **qos: Any,
) -> str:  # fmt: skip
    """Show the next message of a topic; -n for more."""
    check_whole_number(count, "-n", least=1, example=1)
    longest = check_whole_number(longest, "-l", least=0, example=128)
    msg_type = message_type(topic, asked) if asked else None
    deadline = Deadline(check_seconds(timeout))
    with default_session.record(
        topic, msg_type, limit=count, timeout=timeout, qos=profile_from_options(qos, "sensor_data")
    ) as recorder:
        try:
            messages = recorder.wait(count, round(deadline.seconds_left, 2))
        except WaitTimeout:
            messages = recorder.messages
            if not messages:
                raise
    shown = [_field_value(stamped.message, field) for stamped in messages[:count]]
    # A longest of 0 keeps all.
    data = [values.to_plain(part, longest or None) for part in shown]
    if flow_style:
        return "\n---\n".join(yaml_text.one_line(one) for one in data)
    return "---\n".join(yaml_text.to_lines(one).removesuffix("...\n") for one in data)


def _field_value(message: Any, field: str) -> Any:
    """Return what a path such as ``pose.position.x`` stands for in a message."""
    part = message
    for name in field.split(".") if field else ():
        known = [slot for slot, _ in values.message_fields(type(part))] if _is_message(part) else []
        if name not in known:
            raise SessionError(
                f"--field {field}: {yaml_text.short_repr(name)} is no field there, it has "
                f"{', '.join(known) or 'none'}."
            )
        part = getattr(part, name)
    return part


def _is_message(part: Any) -> bool:
    return hasattr(part, "get_fields_and_field_types")


def hz(topic: str, window: int, timeout: float) -> str:
    """Measure the rate at which messages are published."""
    check_whole_number(window, "--window", least=2, example=_ENOUGH)
    deadline = Deadline(check_seconds(timeout))
    with default_session.record(topic, timeout=timeout, limit=window) as recorder:
        try:
            recorder.wait(window, round(deadline.seconds_left, 2))
        except WaitTimeout as error:
            if recorder.count < 2:
                raise _too_few(error, recorder.count, topic, timeout) from None
        stamps = [stamped.stamp_ns / 1e9 for stamped in recorder.messages]
        rate = recorder.rate()
    gaps = [later - earlier for earlier, later in itertools.pairwise(stamps)]
    return (
        f"average rate: {rate:.3f} Hz over {len(stamps)} messages\n"
        f"  period: min {min(gaps):.4f} s, max {max(gaps):.4f} s, "
        f"standard deviation {statistics.pstdev(gaps):.4f} s"
    )


def _too_few(error: WaitTimeout, count: int, topic: str, timeout: float) -> WaitTimeout:
    """Return what there is to say of a topic on which two messages did not come in time."""
    observer = default_session.session().observer
    name = full_topic(observer, topic)
    if not observer.count_publishers(name):
        return error  # it says that nobody publishes: listening longer helps nobody
    only = "Only one message" if count else "No message"
    why = "" if count else f" {str(error).partition('. ')[2]}"
    return WaitTimeout(
        f"{only} arrived on {name} in {timeout:g} s, and a rate takes two.{why} A slow topic takes "
        f"longer: %ros topic hz {topic} --timeout {4 * timeout:g}."
    )


def declare_echo(add: Add) -> None:
    """Declare what ``echo`` takes."""
    add("topic", metavar="TOPIC")
    add("asked", metavar="TYPE", nargs="?", default="", help="as in std_msgs/msg/String")
    add("-n", "--count", type=int, default=1, metavar="N", help="how many messages (1)")
    add("--once", dest="count", action="store_const", const=1, help="one message")
    add("--field", default="", metavar="F", help="only this field, as in pose.position.x")
    add("-l", "--truncate-length", dest="longest", type=int, metavar="N",
        default=values.MAX_SHOWN_ITEMS, help="so many elements of a sequence")  # fmt: skip
    add("-f", "--full-length", dest="longest", action="store_const", const=0, help="all of them")
    add("--flow-style", action="store_true", help="each message on one line")
    add_timeout(add)
    declare_qos(add)


def declare_hz(add: Add) -> None:
    """Declare what ``hz`` takes."""
    add("topic", metavar="TOPIC")
    add("-w", "--window", type=int, default=_ENOUGH, metavar="N", help="over so many messages")
    add_timeout(add)
