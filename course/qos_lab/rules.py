"""What DDS promises for two profiles: whether they connect, and what then arrives."""

from __future__ import annotations

import math
from dataclasses import dataclass

from course.graph.reader import find_incompatibilities
from course.qos_lab.experiment import COUNT, Experiment, ExperimentOutcome
from course.qos_lab.profile import Profile

OUTLIVES_S = 30.0
"""Seconds: no message of an experiment gets this old, so such a lifespan has no effect."""


@dataclass(frozen=True)
class Rule:
    """One policy of a pair: what is offered and requested, whether that fits, and the rule."""

    policy: str
    offered: str
    requested: str
    fits: bool
    rule: str


def compare_profiles(offered: Profile, requested: Profile) -> list[Rule]:
    """Return every policy side by side with its rule (DDS 1.4, section 2.2.3)."""
    broken = find_incompatibilities(offered.to_rclpy(), requested.to_rclpy())
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
            "history", _format_queue(offered), _format_queue(requested), True,
            "Each side has a queue of its own: it never matters to connecting.",
        ),
        Rule(
            "deadline", _format_span(offered.deadline), _format_span(requested.deadline),
            "DEADLINE" not in broken,
            "What is offered must not be longer than what is requested.",
        ),
        Rule(
            "lifespan", _format_span(offered.lifespan), _format_span(requested.lifespan), True,
            "Each side's queue drops what is older than its own. It never matters to connecting.",
        ),
        Rule(
            "liveliness", _format_liveliness(offered), _format_liveliness(requested),
            "LIVELINESS" not in broken,
            "AUTOMATIC never satisfies MANUAL_BY_TOPIC, and the offered lease must not be longer.",
        ),
    ]  # fmt: skip


def can_connect(experiment: Experiment) -> bool:
    """Whether DDS connects the two."""
    return all(rule.fits for rule in compare_profiles(experiment.offered, experiment.requested))


def is_reliable(experiment: Experiment) -> bool:
    """Whether the connection is reliable: both sides must want it."""
    return experiment.offered.reliability == experiment.requested.reliability == "RELIABLE"


def explain_outcome(experiment: Experiment, outcome: ExperimentOutcome) -> str:
    """Return why it came out so, in one or two sentences."""
    if not outcome.connected:
        broken = [
            r for r in compare_profiles(experiment.offered, experiment.requested) if not r.fits
        ]
        names = ", ".join(
            f"{r.policy} ({r.offered} offered, {r.requested} requested)" for r in broken
        )
        return f"DDS does not connect them: {names or 'no endpoint was found'}."
    if experiment.scenario == "late joiner":
        return _explain_late_joiner(experiment, outcome)
    if experiment.scenario == "slow reader":
        return _explain_slow_reader(experiment, outcome)
    if experiment.scenario == "deadline":
        return (
            f"The reader was told {outcome.deadlines_missed} times that its deadline had passed."
            if experiment.requested.deadline
            else "The reader asked for no deadline, so nobody told it about the pause."
        )
    if experiment.scenario == "liveliness":
        return _liveliness_lost(experiment, outcome)
    return _explain_stream(experiment, outcome)


def _explain_stream(experiment: Experiment, outcome: ExperimentOutcome) -> str:
    if not outcome.missing_count:
        repaired = " What the link dropped was sent again." if outcome.lossy else ""
        return f"Every message arrived, in order.{repaired if is_reliable(experiment) else ''}"
    if not is_reliable(experiment):
        return (
            f"Lost on the way: {outcome.missing_count}. A best-effort connection never sends "
            f"anything twice.{_too_old(_describe_lifespans(experiment))}"
        )
    missing = f"Missing, although the connection is reliable: {outcome.missing_count}."
    return f"{missing} {_not_repaired(experiment)}"


def _not_repaired(experiment: Experiment) -> str:
    """Return why a reliable connection did not bring what the link had lost."""
    causes = _describe_lifespans(experiment)
    if _queue_capacity(experiment.offered) < COUNT:
        causes.insert(0, f"the writer's queue ({_format_queue(experiment.offered)})")
    if not causes:
        return "They had not been sent again when the experiment ended."
    return f"They were dropped before they could be sent again, by {' or '.join(causes)}."


def _explain_late_joiner(experiment: Experiment, outcome: ExperimentOutcome) -> str:
    if not _has_replay(experiment):
        return (
            "The late reader got nothing of the past: that needs TRANSIENT_LOCAL and RELIABLE on "
            "both sides. A topic stores nothing by itself."
        )
    kept, fit = len(outcome.received), _replayed_count(experiment)
    if kept < fit and _describe_lifespans(experiment):
        came = f"Of the writer's last messages {fit} would fit into both queues, and {kept} came."
        return came + _too_old(_describe_lifespans(experiment))
    return (
        "The writer had kept its last messages for late readers, and sent as many as fit into both "
        f"queues: {kept}."
    )


def _explain_slow_reader(experiment: Experiment, outcome: ExperimentOutcome) -> str:
    kept = len(outcome.received)
    if kept == outcome.sent:
        return "The reader's queue was long enough: it found every message."
    parts = [
        f"What was left in the reader's queue ({_format_queue(experiment.requested)}): {kept}."
    ]
    full = kept >= _queue_capacity(experiment.requested)
    newest = list(range(outcome.sent - kept, outcome.sent))
    if full:
        parts.append("Newer messages had pushed out older ones.")
    if not full or outcome.received != newest:  # not all of them ever got there, or stayed
        parts.append(_never_there(experiment, outcome))
    return " ".join(filter(None, parts))


def _never_there(experiment: Experiment, outcome: ExperimentOutcome) -> str:
    """Return why a slow reader's queue lacks messages that it had room for, if that is known."""
    parts = []
    if outcome.lossy and is_reliable(experiment):
        parts.append(f"The link lost some. {_not_repaired(experiment)}")
    elif outcome.lossy:
        parts.append("The link lost some, and a best-effort connection never sends anything twice.")
    if experiment.requested.lifespan:
        parts.append(_too_old(_describe_lifespans(experiment)[-1:]).strip())
    return " ".join(parts)


def _liveliness_lost(experiment: Experiment, outcome: ExperimentOutcome) -> str:
    if outcome.liveliness_lost:
        return "The lease ran out without a sign of life, and DDS told the reader."
    if not experiment.requested.lease:
        return "The reader asked for no lease, so silence means nothing to it."
    return (
        "The lease is renewed by the writer's process as long as it lives (AUTOMATIC), so its "
        "silence was not noticed."
    )


def expected_count(experiment: Experiment) -> int | None:
    """Return how many messages must arrive by the rules; None where chance has a say."""
    if not can_connect(experiment):
        return 0
    offered, requested = experiment.offered, experiment.requested
    if experiment.scenario == "late joiner" and not _has_replay(experiment):
        return 0
    if 0 < min(offered.lifespan or OUTLIVES_S, requested.lifespan or OUTLIVES_S) < OUTLIVES_S:
        return None  # it depends on how soon they come
    if experiment.scenario == "late joiner":
        return _replayed_count(experiment)
    if experiment.drop_percent and not is_reliable(experiment):
        return None
    if experiment.scenario == "slow reader":
        return None if experiment.drop_percent else min(COUNT, _queue_capacity(requested))
    # Lost messages are repaired only as long as the writer still has them.
    return COUNT if not experiment.drop_percent or _queue_capacity(offered) >= COUNT else None


def chance_margin(experiment: Experiment) -> int:
    """Return by how many messages chance alone may well move an outcome, either way.

    Twice the standard deviation of a loss that drops each message by itself: 19 of 20 outcomes are
    that near to the most likely one. 0 where the rules leave nothing to the loss.
    """
    share = experiment.drop_percent / 100
    if not share or expected_count(experiment) is not None:
        return 0
    return math.ceil(2 * math.sqrt(COUNT * share * (1 - share)))


def _has_replay(experiment: Experiment) -> bool:
    """Whether a late reader gets what was published before it came."""
    offered, requested = experiment.offered, experiment.requested
    both = offered.durability == requested.durability == "TRANSIENT_LOCAL"
    return both and is_reliable(experiment)


def _replayed_count(experiment: Experiment) -> int:
    """Return how many messages of the past fit into both queues."""
    return min(COUNT, _queue_capacity(experiment.offered), _queue_capacity(experiment.requested))


def _describe_lifespans(experiment: Experiment) -> list[str]:
    """Return the lifespans that a side has set."""
    sides = (("writer", experiment.offered.lifespan), ("reader", experiment.requested.lifespan))
    return [f"the {side}'s lifespan ({_format_span(span)})" for side, span in sides if span]


def _too_old(lifespans: list[str]) -> str:
    """Return the sentence, after a space, that says what becomes of old messages, if anything."""
    return f" What is older than {' or '.join(lifespans)} is dropped." if lifespans else ""


def _queue_capacity(profile: Profile) -> int:
    return profile.depth if profile.history == "KEEP_LAST" else 10**9


def _format_queue(profile: Profile) -> str:
    return f"KEEP_LAST({profile.depth})" if profile.history == "KEEP_LAST" else "KEEP_ALL"


def _format_span(seconds: float) -> str:
    return f"{seconds:g} s" if seconds else "none"


def _format_liveliness(profile: Profile) -> str:
    return (
        f"{profile.liveliness}, {_format_span(profile.lease)}"
        if profile.lease
        else profile.liveliness
    )
