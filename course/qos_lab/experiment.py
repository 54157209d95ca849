"""What an experiment is, and what comes of it, as plain data."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import Any

from course.qos_lab.profile import Profile

SCENARIOS = {
    "stream": "A reader listens while the writer publishes.",
    "late joiner": "The writer has published before the reader starts.",
    "slow reader": "The reader is busy while the writer publishes, and reads what is left then.",
    "deadline": "The writer pauses for three deadlines in the middle of its stream.",
    "liveliness": "The writer stops asserting that it is alive.",
}
"""{scenario: what happens}."""

LOSSY = ("stream", "slow reader")
"""Scenarios that a loss says something about: in the others the link loses nothing."""

COUNT = 30
RATE_HZ = 50.0  # Hz


@dataclass(frozen=True)
class Experiment:
    """Two profiles in one scenario.

    ``loss`` is the share of packets that the link drops, in %, if the scenario is one of `LOSSY`.
    """

    offered: Profile = field(default_factory=Profile)
    requested: Profile = field(default_factory=Profile)
    scenario: str = "stream"
    loss: int = 0

    @property
    def drop_percent(self) -> int:
        """The share of packets that the link drops in this scenario, in %."""
        return self.loss if self.scenario in LOSSY else 0

    def to_json(self) -> str:
        """Return it as JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Experiment:
        """Read what `to_json` wrote."""
        data = json.loads(text)
        offered, requested = Profile(**data["offered"]), Profile(**data["requested"])
        return cls(offered, requested, data["scenario"], data["loss"])


@dataclass
class ExperimentOutcome:
    """What was seen.

    Attributes:
        connected: DDS matched the two endpoints.
        broken: the policy that DDS's own event named, if it did not.
        sent: messages published.
        received: their numbers, in the order in which they came.
        latency_ms: from publication to reception, in the same order.
        deadlines_missed: events that the reader got.
        liveliness_lost: whether the reader was told that the writer is not alive any more.
        lossy: the link did drop packets.
        remark: what else should be known (no namespaces here, say).
    """

    connected: bool = False
    broken: str = ""
    sent: int = 0
    received: list[int] = field(default_factory=list)
    latency_ms: list[float] = field(default_factory=list)
    deadlines_missed: int = 0
    liveliness_lost: bool = False
    lossy: bool = False
    remark: str = ""

    @property
    def in_order(self) -> bool:
        """Whether no message came before an older one."""
        return self.received == sorted(self.received)

    @property
    def missing_count(self) -> int:
        """How many messages never came."""
        return self.sent - len(set(self.received))

    def to_json(self) -> str:
        """Return it as JSON."""
        return json.dumps(vars(self))

    @classmethod
    def from_json(cls, text: str) -> ExperimentOutcome:
        """Read what `to_json` wrote."""
        data: dict[str, Any] = json.loads(text)
        return cls(**data)
