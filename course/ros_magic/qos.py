"""``--qos-reliability`` and its relatives, as the ROS 2 command line has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.qos import (
    QoSDurabilityPolicy,
    QoSHistoryPolicy,
    QoSPresetProfiles,
    QoSProfile,
    QoSReliabilityPolicy,
)

from course.ros_magic.options import Add
from course.util.argument_checks import check_whole_number

_POLICIES = {
    "reliability": QoSReliabilityPolicy,
    "durability": QoSDurabilityPolicy,
    "history": QoSHistoryPolicy,
}


def declare_options(add: Add) -> None:
    """Declare the options."""
    presets = [key for key in QoSPresetProfiles.short_keys() if key != "unknown"]
    add("--qos-profile", choices=presets, metavar="NAME", help="a preset, such as sensor_data")
    for policy, kinds in _POLICIES.items():
        known = [key for key in kinds.short_keys() if key not in ("unknown", "best_available")]
        add(f"--qos-{policy}", choices=known, metavar="P", help=", ".join(known))
    add("--qos-depth", type=int, metavar="N", help="of the history, with keep_last")


def profile_from_options(asked: Mapping[str, Any], preset: str) -> QoSProfile | None:
    """Return the profile that the options ask for; None if none of them was given.

    Args:
        asked: the options, by name.
        preset: what the policies that are not named are taken from, unless ``--qos-profile`` is.
    """
    given = {name: value for name, value in asked.items() if value is not None}
    if not given:
        return None
    base = QoSPresetProfiles.get_from_short_key(given.get("qos_profile", preset))
    policies = {slot[1:]: getattr(base, slot[1:]) for slot in base.__slots__}
    for policy, kinds in _POLICIES.items():
        if (key := given.get(f"qos_{policy}")) is not None:
            policies[policy] = kinds.get_from_short_key(key)
    if "qos_depth" in given:
        policies["depth"] = check_whole_number(
            given["qos_depth"], "--qos-depth", least=1, example=10
        )
    return QoSProfile(**policies)
