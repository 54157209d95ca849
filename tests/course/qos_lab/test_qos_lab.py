"""The lab's rules and what DDS really does agree, between two processes and over a lossy link."""

from __future__ import annotations

import json
import re
from typing import Any

import psutil
import pytest
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data

from course import Session
from course.qos_lab import experiment_runner, link, rules
from course.qos_lab.experiment import COUNT, Experiment, ExperimentOutcome
from course.qos_lab.experiment_runner import ExperimentError
from course.qos_lab.profile import Profile, ProfileError
from course.views.qos_lab import LabTrial
from tests.machine import needs_lossy_link


def best_effort(**policies: Any) -> Profile:
    return Profile(reliability="BEST_EFFORT", **policies)


def durable(**policies: Any) -> Profile:
    return Profile(durability="TRANSIENT_LOCAL", **policies)


CASES = {
    "all arrives": Experiment(),
    "refused": Experiment(best_effort(), Profile()),
    "asks for less": Experiment(Profile(), best_effort(), "slow reader"),
    "refused durability": Experiment(Profile(), durable()),
    "repaired": Experiment(
        Profile(history="KEEP_ALL"), Profile(history="KEEP_ALL"), "stream", loss=25
    ),
    "late": Experiment(durable(depth=5), durable(depth=20), "late joiner"),
    "late, shallow reader": Experiment(durable(depth=20), durable(depth=3), "late joiner"),
    "late, one side": Experiment(durable(depth=5), Profile(), "late joiner"),
    "late, best effort": Experiment(
        best_effort(durability="TRANSIENT_LOCAL"), best_effort(durability="TRANSIENT_LOCAL"),
        "late joiner",
    ),
    "slow, newest": Experiment(Profile(), Profile(depth=1), "slow reader"),
    "slow, all": Experiment(Profile(), Profile(history="KEEP_ALL"), "slow reader"),
    "late, long lifespan": Experiment(
        durable(depth=30, lifespan=60.0), durable(depth=30), "late joiner"
    ),
    "no deadline": Experiment(Profile(), Profile(deadline=0.1), "deadline"),
}  # fmt: skip


@pytest.mark.parametrize(
    "experiment",
    [
        pytest.param(case, id=name, marks=[needs_lossy_link] if case.loss else [])
        for name, case in CASES.items()
    ],
)
def test_dds_does_what_the_rules_say(experiment: Experiment) -> None:
    outcome = experiment_runner.run_experiment(experiment)
    assert outcome.remark == ""
    assert outcome.connected == rules.can_connect(experiment)
    assert len(outcome.received) == rules.expected_count(experiment)
    assert outcome.in_order
    assert outcome.lossy == (experiment.loss > 0)
    if not outcome.connected:
        broken = [r.policy for r in rules.compare_profiles(*_pair(experiment)) if not r.fits]
        assert outcome.broken.lower() in broken
    if experiment.scenario == "slow reader":
        assert outcome.received[-1] == COUNT - 1, "the newest are kept"


def _pair(experiment: Experiment) -> tuple[Profile, Profile]:
    return experiment.offered, experiment.requested


@needs_lossy_link
def test_what_is_lost_is_lost_under_best_effort() -> None:
    outcome = experiment_runner.run_experiment(
        Experiment(best_effort(), best_effort(), "stream", loss=60)
    )
    assert outcome.missing_count > 0
    assert "never sends anything twice" in rules.explain_outcome(
        Experiment(best_effort(), best_effort(), "stream", 60), outcome
    )


@pytest.mark.parametrize("side", ["writer", "reader"])
def test_what_is_older_than_a_lifespan_is_not_replayed_to_a_late_reader(side: str) -> None:
    short, long = durable(depth=30, lifespan=0.05), durable(depth=30)
    pair = (short, long) if side == "writer" else (long, short)
    experiment = Experiment(*pair, "late joiner")
    assert rules.expected_count(experiment) is None
    outcome = experiment_runner.run_experiment(experiment)
    assert (outcome.connected, outcome.received) == (True, [])
    why = rules.explain_outcome(experiment, outcome)
    assert "30 would fit into both queues, and 0 came." in why
    assert f"What is older than the {side}'s lifespan (0.05 s) is dropped." in why


def test_a_slow_readers_own_lifespan_empties_its_queue() -> None:
    experiment = Experiment(Profile(), Profile(history="KEEP_ALL", lifespan=0.05), "slow reader")
    assert rules.expected_count(experiment) is None
    outcome = experiment_runner.run_experiment(experiment)
    assert outcome.missing_count > 0
    why = rules.explain_outcome(experiment, outcome)
    assert "pushed out" not in why
    assert "What is older than the reader's lifespan (0.05 s) is dropped." in why


@needs_lossy_link
def test_a_slow_reader_misses_what_the_link_has_lost() -> None:
    deep = best_effort(depth=30)
    experiment = Experiment(deep, deep, "slow reader", loss=60)
    outcome = experiment_runner.run_experiment(experiment)
    assert outcome.missing_count > 0
    why = rules.explain_outcome(experiment, outcome)
    assert "pushed out" not in why
    assert "The link lost some, and a best-effort connection never sends anything twice." in why


@needs_lossy_link
def test_what_grew_old_before_it_was_sent_again_is_said() -> None:
    brief = Profile(depth=30, lifespan=0.2)  # lost messages are sent again after seconds
    experiment = Experiment(brief, Profile(depth=30), "stream", loss=60)
    outcome = experiment_runner.run_experiment(experiment)
    assert outcome.missing_count > 0
    why = rules.explain_outcome(experiment, outcome)
    assert "before they could be sent again, by the writer's lifespan (0.2 s)." in why


@pytest.mark.parametrize(
    ("experiment", "received", "sentence"),
    [
        (
            Experiment(Profile(history="KEEP_ALL"), Profile(history="KEEP_ALL"), "stream", 60),
            [0, 1], "They had not been sent again when the experiment ended.",
        ),
        (
            Experiment(best_effort(), best_effort(depth=3), "slow reader", 60),
            [20, 24, 29], "Newer messages had pushed out older ones. The link lost some, and",
        ),
    ],
)  # fmt: skip
def test_the_reason_is_one_that_can_be(
    experiment: Experiment, received: list[int], sentence: str
) -> None:
    outcome = ExperimentOutcome(connected=True, sent=COUNT, received=received, lossy=True)
    assert sentence in rules.explain_outcome(experiment, outcome)


@pytest.mark.parametrize("scenario", ["late joiner", "deadline", "liveliness"])
def test_a_loss_is_not_claimed_where_nothing_is_lost(scenario: str) -> None:
    experiment = Experiment(durable(), durable(), scenario, loss=50)
    outcome = experiment_runner.run_experiment(experiment)
    assert not outcome.lossy
    assert (
        outcome.remark == "The link lost nothing here: it does so in stream and slow reader only."
    )
    assert len(outcome.received) == rules.expected_count(experiment)


@needs_lossy_link
def test_a_shallow_writer_cannot_repair() -> None:
    experiment = Experiment(Profile(depth=1), Profile(depth=1), "stream", loss=60)
    outcome = experiment_runner.run_experiment(experiment)
    assert outcome.missing_count > 0
    assert "although the connection is reliable" in rules.explain_outcome(experiment, outcome)


def test_a_missed_deadline_is_an_event() -> None:
    experiment = Experiment(Profile(deadline=0.2), Profile(deadline=0.2), "deadline")
    outcome = experiment_runner.run_experiment(experiment)
    assert outcome.deadlines_missed > 0
    assert "deadline had passed" in rules.explain_outcome(experiment, outcome)


@pytest.mark.parametrize("manual", [True, False])
def test_silence_is_noticed_where_life_has_to_be_asserted(manual: bool) -> None:
    kind = "MANUAL_BY_TOPIC" if manual else "AUTOMATIC"
    profile = Profile(liveliness=kind, lease=0.3)
    assert (
        experiment_runner.run_experiment(Experiment(profile, profile, "liveliness")).liveliness_lost
        is manual
    )


def test_without_namespaces_the_loss_is_left_out_and_that_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(link, "problem", lambda: "No namespaces here.")
    outcome = experiment_runner.run_experiment(Experiment(loss=50))
    assert (outcome.remark, outcome.lossy, outcome.missing_count) == (
        "No namespaces here.",
        False,
        0,
    )


@pytest.mark.parametrize(
    ("experiment", "sentence"),
    [
        (Experiment(scenario="party"), "no scenario 'party': choose stream"),
        (Experiment(loss=95), "0 to 90 % of its packets, a whole number, not 95"),
        (Experiment(loss="x"), "0 to 90 % of its packets, a whole number, not 'x'"),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_run_is_said(experiment: Experiment, sentence: str) -> None:
    with pytest.raises(ExperimentError, match=sentence):
        experiment_runner.run_experiment(experiment)


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        ({"reliability": "MAYBE"}, "reliability is RELIABLE or BEST_EFFORT, not 'MAYBE'."),
        ({"depth": 0}, "depth is 1 to 5000, not 0."),
        ({"depth": "x"}, "depth is a whole number"),
        ({"deadline": -1}, "deadline is 0 to 60, not -1.0."),
        ({"colour": "red"}, "A profile has deadline"),
        (None, "A profile has deadline"),
    ],
)
def test_a_profile_that_cannot_be_is_refused(data: Any, sentence: str) -> None:
    with pytest.raises(ProfileError) as caught:
        Profile.from_data(data)
    assert sentence in str(caught.value)


def test_profiles_go_there_and_back() -> None:
    profile = QoSProfile(
        depth=7, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.5)
    )
    data = Profile.from_rclpy(profile)
    assert str(data) == "BEST_EFFORT, VOLATILE, KEEP_LAST(7), deadline 0.5 s"
    assert Profile.from_rclpy(data.to_rclpy()) == data
    assert Profile.from_data(data.to_data()) == data


def test_experiments_and_outcomes_go_over_a_pipe() -> None:
    experiment = CASES["late"]
    assert Experiment.from_json(experiment.to_json()) == experiment
    outcome = ExperimentOutcome(connected=True, received=[1, 2])
    assert ExperimentOutcome.from_json(json.dumps(json.loads(outcome.to_json()))) == outcome


def test_the_view_keeps_the_prediction_beside_what_was_seen(session: Session) -> None:
    view = session.qos_lab(qos_profile_sensor_data, QoSProfile(depth=10))
    trial = view.run("stream", connects=True, arrive=30)
    assert trial.is_right is False
    words = view.words()
    assert "not connected (reliability)" in words
    durable_ten = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    view.run("late joiner", connects=True, offered=durable_ten, requested=durable_ten, loss=20)
    replay = view.words().partition("late joiner: ")[2]
    assert re.match(r"connected, 10 of 30 arrived, age p50 \d", replay), replay
    assert "The link lost nothing here" in replay
    assert "reliability: BEST_EFFORT -> RELIABLE does not fit. BEST_EFFORT never satis" in words
    assert "You said: connected, 30 messages. It came out otherwise." in words
    asked = {
        "offered": Profile().to_data(), "requested": Profile().to_data(), "scenario": "stream",
        "connects": True, "arrive": 30, "loss": 0,
    }  # fmt: skip
    view._on_message(view.widget, {"run": asked}, [])
    session.until(lambda: len(view.trials) == 3, timeout=60)
    assert view.trials[2].is_right is True
    session.until(lambda: not view.widget.frame["running"])
    for wrong, sentence in (
        ({"offered": {"depth": 0}}, "depth is 1 to 5000"),
        ({"loss": 2.5}, "0 to 90 % of its packets, a whole number, not 2.5."),
        ({"arrive": 2.5}, "A prediction is a whole number of messages, 0 to 30, not 2.5."),
    ):
        view._on_message(view.widget, {"run": {**asked, **wrong}}, [])
        session.until(lambda said=sentence: said in view.widget.frame["problem"])  # type: ignore[misc]
        assert not view.widget.frame["running"]
    assert len(view.trials) == 3


def test_an_experiment_that_fails_says_so_and_the_next_one_runs(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    view = session.qos_lab()
    asked = {"offered": Profile().to_data(), "requested": Profile().to_data(), "scenario": "stream",
             "connects": True, "arrive": None, "loss": 0}  # fmt: skip
    with monkeypatch.context() as patch:
        patch.setattr(experiment_runner.sys, "executable", "/nowhere/python")
        view._on_message(view.widget, {"run": asked}, [])
        session.until(
            lambda: "The experiment failed (FileNotFoundErr" in view.make_frame()["problem"]
        )
    assert not view.make_frame()["running"]
    view._on_message(view.widget, {"run": asked}, [])
    session.until(lambda: view.trials and not view.make_frame()["problem"], timeout=60)


def children() -> list[psutil.Process]:
    return [
        process
        for process in psutil.Process().children(recursive=True)
        if any(part.startswith("course.qos_lab.") for part in process.cmdline())
    ]


def test_an_experiment_ends_with_its_session() -> None:
    with Session() as session:
        view = session.qos_lab()
        asked = {"offered": Profile(deadline=60).to_data(),
                 "requested": Profile(deadline=60).to_data(),
                 "scenario": "deadline", "connects": True, "loss": 0}  # fmt: skip
        view._on_message(view.widget, {"run": asked}, [])
        session.until(lambda: len(children()) == 2, timeout=60)  # the bench and its writer
        running = children()
    _, alive = psutil.wait_procs(running, timeout=20)
    assert alive == []
    with pytest.raises(ExperimentError, match="This QoS lab has ended"):
        view.run("stream", connects=True)


@needs_lossy_link
def test_the_tools_of_a_lossy_link_are_found_by_an_ordinary_user(
    monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.setenv("PATH", "/usr/local/bin:/usr/bin:/bin")  # Debian has nft in /usr/sbin
    link.problem.cache_clear()
    request.addfinalizer(link.problem.cache_clear)
    experiment = Experiment(best_effort(), best_effort(), "stream", loss=60)
    outcome = experiment_runner.run_experiment(experiment)
    assert (outcome.remark, outcome.lossy) == ("", True)
    assert outcome.missing_count > 0


def trial(experiment: Experiment, predicted: int, arrived: int) -> LabTrial:
    outcome = ExperimentOutcome(
        connected=True, sent=COUNT, received=list(range(arrived)), lossy=experiment.loss > 0
    )
    return LabTrial(experiment, True, predicted, outcome)


def test_a_prediction_of_a_random_loss_is_right_as_near_as_chance_allows() -> None:
    half = Experiment(best_effort(), best_effort(), "stream", loss=50)
    assert rules.chance_margin(half) == 6  # 2 * sqrt(30 * 0.5 * 0.5) = 5.5
    right = [n for n in range(COUNT + 1) if trial(half, 15, n).is_right]
    assert right == list(range(9, 22))
    assert trial(half, 30, 12).is_right is False
    assert trial(half, 0, 12).is_right is False


def test_where_the_rules_decide_a_prediction_is_exact() -> None:
    for exact in (
        Experiment(),
        Experiment(loss=50, offered=Profile(depth=COUNT), requested=Profile(depth=COUNT)),
        Experiment(Profile(), Profile(depth=1), "slow reader"),
    ):
        assert rules.chance_margin(exact) == 0
        expected = rules.expected_count(exact)
        assert expected is not None
        assert trial(exact, expected, expected).is_right
        assert not trial(exact, expected - 1, expected).is_right
    # A machine that cannot lose packets has lost none: nothing was left to chance.
    lossless = trial(Experiment(best_effort(), best_effort(), "stream", loss=50), 15, COUNT)
    assert lossless.outcome is not None
    lossless.outcome.lossy = False
    assert not lossless.is_right


def test_the_verdict_says_that_chance_was_allowed_for(session: Session) -> None:
    lab = session.qos_lab()
    lab._keep_trial(trial(Experiment(best_effort(), best_effort(), "stream", loss=50), 15, 12))
    assert "connected, 15 messages. That was right. (The loss is random: up to 6" in lab.words()
