"""What DDS promises for two profiles: whether they connect, and what then arrives."""

from __future__ import annotations

from dataclasses import dataclass

from course.graph.reader import incompatibilities
from course.qoslab.experiment import COUNT, Experiment, Outcome
from course.qoslab.profile import Profile


@dataclass(frozen=True)
class Rule:
    """One policy of a pair: what is offered and requested, whether that fits, and the rule."""

    policy: str
    offered: str
    requested: str
    fits: bool
    rule: str


def compare(offered: Profile, requested: Profile) -> list[Rule]:
    """Return every policy side by side with its rule (DDS 1.4, section 2.2.3)."""
    broken = incompatibilities(offered.qos(), requested.qos())
    return [
        Rule(
            "reliability", offered.reliability, requested.reliability, "RELIABILITY" not in broken,
            "BEST_EFFORT never satisfies a request for RELIABLE; the other way round fits.",
        ),
        Rule(
            "durability", offered.durability, requested.durability, "DURABILITY" not in broken,
            "VOLATILE never satisfies a request for TRANSIENT_LOCAL; the other way round fits.",
        ),
        Rule(
            "history", _queue(offered), _queue(requested), True,
            "Each side has a queue of its own: it never matters to connecting.",
        ),
        Rule(
            "deadline", _span(offered.deadline), _span(requested.deadline),
            "DEADLINE" not in broken,
            "What is offered must not be longer than what is requested.",
        ),
        Rule(
            "lifespan", _span(offered.lifespan), _span(requested.lifespan), True,
            "The writer's: messages older than it are dropped. It never matters to connecting.",
        ),
        Rule(
            "liveliness", _liveliness(offered), _liveliness(requested),
            "LIVELINESS" not in broken,
            "AUTOMATIC never satisfies MANUAL_BY_TOPIC, and the offered lease must not be longer.",
        ),
    ]  # fmt: skip


def connects(experiment: Experiment) -> bool:
    """Whether DDS connects the two."""
    return all(rule.fits for rule in compare(experiment.offered, experiment.requested))


def reliable(experiment: Experiment) -> bool:
    """Whether the connection is reliable: both sides must want it."""
    return experiment.offered.reliability == experiment.requested.reliability == "RELIABLE"


def explain(experiment: Experiment, outcome: Outcome) -> str:
    """Return why it came out so, in one or two sentences."""
    if not outcome.connected:
        broken = [r for r in compare(experiment.offered, experiment.requested) if not r.fits]
        names = ", ".join(
            f"{r.policy} ({r.offered} offered, {r.requested} requested)" for r in broken
        )
        return f"DDS does not connect them: {names or 'no endpoint was found'}."
    if experiment.scenario == "late joiner":
        return _late(experiment, outcome)
    if experiment.scenario == "slow reader":
        return _slow(experiment, outcome)
    if experiment.scenario == "deadline":
        return (
            f"The reader was told {outcome.deadlines_missed} times that its deadline had passed."
            if experiment.requested.deadline
            else "The reader asked for no deadline, so nobody told it about the pause."
        )
    if experiment.scenario == "liveliness":
        return _liveliness_lost(experiment, outcome)
    return _stream(experiment, outcome)


def _stream(experiment: Experiment, outcome: Outcome) -> str:
    if not outcome.missing:
        repaired = " What the link dropped was sent again." if outcome.lossy else ""
        return f"Every message arrived, in order.{repaired if reliable(experiment) else ''}"
    if not reliable(experiment):
        return (
            f"Lost on the way: {outcome.missing}. A best-effort connection never sends anything "
            "twice."
        )
    return (
        f"Missing, although the connection is reliable: {outcome.missing}. The writer's queue "
        f"({_queue(experiment.offered)}) had dropped them before they could be sent again."
    )


def _late(experiment: Experiment, outcome: Outcome) -> str:
    if not _replays(experiment):
        return (
            "The late reader got nothing of the past: that needs TRANSIENT_LOCAL and RELIABLE on "
            "both sides. A topic stores nothing by itself."
        )
    return (
        "The writer had kept its last messages for late readers, and sent as many as fit into both "
        f"queues: {len(outcome.received)}."
    )


def _slow(experiment: Experiment, outcome: Outcome) -> str:
    kept = len(outcome.received)
    if kept == outcome.sent:
        return "The reader's queue was long enough: it found every message."
    return (
        f"What was left in the reader's queue ({_queue(experiment.requested)}): {kept}. Newer "
        "messages had pushed out older ones."
    )


def _liveliness_lost(experiment: Experiment, outcome: Outcome) -> str:
    if outcome.liveliness_lost:
        return "The lease ran out without a sign of life, and DDS told the reader."
    if not experiment.requested.lease:
        return "The reader asked for no lease, so silence means nothing to it."
    return (
        "The lease is renewed by the writer's process as long as it lives (AUTOMATIC), so its "
        "silence was not noticed."
    )


def expected(experiment: Experiment) -> int | None:
    """Return how many messages must arrive by the rules; None where chance has a say."""
    if not connects(experiment):
        return 0
    offered, requested = experiment.offered, experiment.requested
    if experiment.scenario == "late joiner":
        return min(COUNT, _room(offered), _room(requested)) if _replays(experiment) else 0
    if offered.lifespan or (experiment.loss and not reliable(experiment)):
        return None
    if experiment.scenario == "slow reader":
        return None if experiment.loss else min(COUNT, _room(requested))
    # Lost messages are repaired only as long as the writer still has them.
    return COUNT if not experiment.loss or _room(offered) >= COUNT else None


def _replays(experiment: Experiment) -> bool:
    """Whether a late reader gets what was published before it came."""
    offered, requested = experiment.offered, experiment.requested
    both = offered.durability == requested.durability == "TRANSIENT_LOCAL"
    return both and reliable(experiment)


def _room(profile: Profile) -> int:
    return profile.depth if profile.history == "KEEP_LAST" else 10**9


def _queue(profile: Profile) -> str:
    return f"KEEP_LAST({profile.depth})" if profile.history == "KEEP_LAST" else "KEEP_ALL"


def _span(seconds: float) -> str:
    return f"{seconds:g} s" if seconds else "none"


def _liveliness(profile: Profile) -> str:
    return f"{profile.liveliness}, {_span(profile.lease)}" if profile.lease else profile.liveliness
