"""A QoS profile as plain data: what a form sets, a file keeps, and rclpy understands."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from course.errors import CourseError

CHOICES = {
    "reliability": ("RELIABLE", "BEST_EFFORT"),
    "durability": ("VOLATILE", "TRANSIENT_LOCAL"),
    "history": ("KEEP_LAST", "KEEP_ALL"),
    "liveliness": ("AUTOMATIC", "MANUAL_BY_TOPIC"),
}
"""{policy: what it can be}; the others are numbers."""

NUMBERS = {
    "depth": (1, 5000),
    "deadline": (0.0, 60.0),
    "lifespan": (0.0, 60.0),
    "lease": (0.0, 60.0),
}
"""{policy: (least, most)}: depth in messages, the others in seconds, 0 for "none"."""


class ProfileError(CourseError):
    """A profile that no endpoint can have; the message names the policy and what it can be."""


@dataclass(frozen=True)
class Profile:
    """A QoS profile. ``depth`` counts for KEEP_LAST only; times are in seconds, 0 for "none".

    ``lease`` is the liveliness lease duration.
    """

    reliability: str = "RELIABLE"
    durability: str = "VOLATILE"
    history: str = "KEEP_LAST"
    depth: int = 10
    deadline: float = 0.0
    lifespan: float = 0.0
    liveliness: str = "AUTOMATIC"
    lease: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what no endpoint can have."""
        for policy, choices in CHOICES.items():
            if getattr(self, policy) not in choices:
                raise ProfileError(
                    f"{policy} is {' or '.join(choices)}, not {getattr(self, policy)!r}."
                )
        for policy, (least, most) in NUMBERS.items():
            value = getattr(self, policy)
            wrong = isinstance(value, bool) or not isinstance(value, int | float)
            if wrong or not least <= value <= most:
                raise ProfileError(f"{policy} is {least:g} to {most:g}, not {value!r}.")

    @classmethod
    def from_rclpy(cls, profile: QoSProfile) -> Profile:
        """Return the data of an rclpy profile.

        Raises:
            ProfileError: it has a policy that the lab does not know (SYSTEM_DEFAULT, say).
        """
        return cls(
            profile.reliability.name, profile.durability.name, profile.history.name,
            max(1, profile.depth),
            _duration_seconds(profile.deadline), _duration_seconds(profile.lifespan),
            profile.liveliness.name if profile.liveliness else "AUTOMATIC",
            _duration_seconds(profile.liveliness_lease_duration),
        )  # fmt: skip

    @classmethod
    def from_data(cls, data: Any) -> Profile:
        """Return a profile from what a form or a file has.

        Raises:
            ProfileError: an unknown policy, or a value that it cannot have.
        """
        known = {field.name for field in fields(cls)}
        if not isinstance(data, dict) or not set(data) <= known:
            raise ProfileError(f"A profile has {', '.join(sorted(known))}, not {data!r}.")
        try:
            numbers = {
                name: int(data[name]) if name == "depth" else float(data[name])
                for name in NUMBERS
                if name in data
            }
        except (TypeError, ValueError):
            raise ProfileError(
                "depth is a whole number; deadline, lifespan and lease are seconds."
            ) from None
        return cls(**{**data, **numbers})

    def to_data(self) -> dict[str, Any]:
        """Return it as JSON data."""
        return asdict(self)

    def to_rclpy(self) -> QoSProfile:
        """Return the rclpy profile."""
        times = {
            name: Duration(seconds=value)
            for name, value in (
                ("deadline", self.deadline),
                ("lifespan", self.lifespan),
                ("liveliness_lease_duration", self.lease),
            )
            if value
        }
        return QoSProfile(
            reliability=ReliabilityPolicy[self.reliability],
            durability=DurabilityPolicy[self.durability],
            history=HistoryPolicy[self.history],
            depth=self.depth,
            liveliness=LivelinessPolicy[self.liveliness],
            **times,
        )

    def __str__(self) -> str:
        """Return it in one line, without what is at its default."""
        queue = f"KEEP_LAST({self.depth})" if self.history == "KEEP_LAST" else "KEEP_ALL"
        parts = [self.reliability, self.durability, queue]
        parts += [
            f"{name} {getattr(self, name):g} s"
            for name in ("deadline", "lifespan", "lease")
            if getattr(self, name)
        ]
        return ", ".join(parts + ([self.liveliness] if self.liveliness != "AUTOMATIC" else []))


def _duration_seconds(duration: Duration) -> float:
    seconds: float = duration.nanoseconds / 1e9
    return 0.0 if seconds > NUMBERS["deadline"][1] else seconds
