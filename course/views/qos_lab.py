"""The QoS lab as a view: two profiles side by side, a prediction, and what really happens."""

from __future__ import annotations

import statistics
import threading
from dataclasses import asdict, dataclass
from typing import Any

from rclpy.qos import QoSProfile

from course.errors import CourseError
from course.messages.yaml_text import format_count
from course.qos_lab import experiment_runner, link, rules
from course.qos_lab.experiment import COUNT, SCENARIOS, Experiment, ExperimentOutcome
from course.qos_lab.experiment_runner import ExperimentError
from course.qos_lab.profile import CHOICES, NUMBERS, Profile
from course.runtime.core_session import CoreSession
from course.views.shared.live_view import Frame, LiveView

KEPT_TRIALS = 8


@dataclass(frozen=True)
class LabTrial:
    """One experiment with the prediction that was made before it, and what was seen."""

    experiment: Experiment
    connects: bool
    arrive: int | None
    outcome: ExperimentOutcome | None = None
    problem: str = ""

    @property
    def is_right(self) -> bool | None:
        """Whether the prediction came true; None while it is not known."""
        if self.outcome is None:
            return None
        if self.outcome.connected != self.connects:
            return False
        return self.missed_by is None or self.missed_by <= self.margin

    @property
    def margin(self) -> int:
        """By how many messages a right prediction may miss: a random loss is not exact."""
        lossy = self.outcome is not None and self.outcome.lossy and self.outcome.connected
        return rules.chance_margin(self.experiment) if lossy else 0

    @property
    def missed_by(self) -> int | None:
        """How far the predicted number of messages is from what arrived; None if there is none."""
        if self.arrive is None or self.outcome is None:
            return None
        return abs(self.arrive - len(self.outcome.received))


class QoSLab(LiveView):
    """Predict first, then run: real endpoints in two processes, in one of five scenarios.

    The kernel's own nodes are not touched. With a loss, both processes are in a network namespace
    of their own, where the machine allows it.
    """

    label = "QoS lab"
    script = "qos_lab"
    shared = ("forms",)
    period = 0.2

    def __init__(
        self, session: CoreSession, offered: QoSProfile | None, requested: QoSProfile | None
    ) -> None:
        """Begin with two profiles; None is the default one."""
        super().__init__(session, offered, requested)
        self._offered = Profile.from_rclpy(offered) if offered else Profile()
        self._requested = Profile.from_rclpy(requested) if requested else Profile()
        self._processes = experiment_runner.ExperimentProcesses()
        self.resources.callback(self._processes.end)
        self._trials: list[LabTrial] = []
        self._running = False
        self._problem = ""
        self._lock = threading.Lock()

    @property
    def trials(self) -> list[LabTrial]:
        """The latest trials, oldest first."""
        with self._lock:
            return list(self._trials)

    def run(
        self,
        scenario: str = "stream",
        *,
        connects: bool,
        arrive: int | None = None,
        loss: int = 0,
        offered: QoSProfile | None = None,
        requested: QoSProfile | None = None,
    ) -> LabTrial:
        """Say what you expect, run a scenario, and return the trial.

        Args:
            scenario: "stream", "late joiner", "slow reader", "deadline" or "liveliness".
            connects: whether you expect DDS to connect the two.
            arrive: how many of 30 messages you expect to arrive; None leaves that open. Where the
                loss is random, a number as near as chance allows is right.
            loss: share of packets that the link drops, in %.
            offered: the writer's profile from now on.
            requested: the reader's profile from now on.

        Raises:
            ExperimentError: no such scenario, its processes failed, or this view has ended.
            ProfileError: a profile that the lab does not know.
        """
        self._offered = Profile.from_rclpy(offered) if offered else self._offered
        self._requested = Profile.from_rclpy(requested) if requested else self._requested
        experiment = Experiment(self._offered, self._requested, scenario, loss)
        trial = LabTrial(
            experiment,
            connects,
            arrive,
            experiment_runner.run_experiment(experiment, self._processes),
        )
        self._keep_trial(trial)
        return trial

    def handle_control(self, message: dict[str, Any]) -> None:
        """Run what the browser asks for, in a thread: the kernel goes on."""
        asked = message.get("run")
        if not isinstance(asked, dict):
            return
        with self._lock:
            if self._running:
                return
            self._running, self._problem = True, ""
        threading.Thread(target=self._run_trial, args=(asked,), name="QoS lab", daemon=True).start()

    def make_frame(self) -> Frame:
        """Return profiles, rules and trials."""
        return {
            "offered": self._offered.to_data(),
            "requested": self._requested.to_data(),
            "choices": {name: list(choices) for name, choices in CHOICES.items()},
            "numbers": {name: list(limits) for name, limits in NUMBERS.items()},
            "scenarios": SCENARIOS,
            "count": COUNT,
            "no_loss": link.problem(),
            "running": self._running,
            "problem": self._problem,
            "trials": [_trial_data(trial) for trial in reversed(self.trials)],
        }

    def words(self) -> str:
        """Return profiles, trials and the rule of each policy as text."""
        lines = [f"offered: {self._offered}", f"requested: {self._requested}"]
        lines += [
            f"  {_format_rule(asdict(rule))}"
            for rule in rules.compare_profiles(self._offered, self._requested)
        ]
        for trial in self.trials:
            shown = _trial_data(trial)
            lines += [f"{shown['title']}: {shown['seen']}", f"  {shown['why']}"]
            lines += [f"  {shown['verdict']}"]
            lines += [f"  {_format_rule(rule)}" for rule in shown["rules"]]
        return "\n".join([*lines, *([self._problem] if self._problem else [])])

    def _run_trial(self, asked: dict[str, Any]) -> None:
        problem = ""
        try:
            self._offered = Profile.from_data(asked.get("offered"))
            self._requested = Profile.from_data(asked.get("requested"))
            scenario, loss = str(asked.get("scenario")), asked.get("loss") or 0
            experiment = Experiment(self._offered, self._requested, scenario, loss)
            connects, arrive = bool(asked.get("connects")), _check_prediction(asked.get("arrive"))
            outcome = experiment_runner.run_experiment(experiment, self._processes)
            self._keep_trial(LabTrial(experiment, connects, arrive, outcome))
        except CourseError as error:
            problem = str(error)
        except Exception as error:  # noqa: BLE001 - whatever it was, the buttons work again
            problem = f"The experiment failed ({type(error).__name__}: {error})."
        finally:
            with self._lock:
                self._running, self._problem = False, problem

    def _keep_trial(self, trial: LabTrial) -> None:
        with self._lock:
            self._trials = [*self._trials, trial][-KEPT_TRIALS:]


def _trial_data(trial: LabTrial) -> dict[str, Any]:
    experiment, outcome = trial.experiment, trial.outcome
    assert outcome is not None
    loss = f", {experiment.loss} % loss" if outcome.lossy else ""
    said = "connected" if trial.connects else "not connected"
    said += f", {format_count(trial.arrive, 'message')}" if trial.arrive is not None else ""
    truth = "That was right." if trial.is_right else "It came out otherwise."
    if trial.is_right and trial.missed_by:
        truth += f" (The loss is random: up to {trial.margin} more or less are chance.)"
    return {
        "title": f"{experiment.scenario}{loss}",
        "pair": f"{experiment.offered} -> {experiment.requested}",
        "seen": _describe_outcome(experiment, outcome),
        "why": " ".join(filter(None, [rules.explain_outcome(experiment, outcome), outcome.remark])),
        "right": trial.is_right,
        "verdict": f"You said: {said}. {truth}",
        "received": outcome.received,
        "sent": outcome.sent,
        "rules": [
            asdict(r) for r in rules.compare_profiles(experiment.offered, experiment.requested)
        ],
    }


def _format_rule(rule: dict[str, Any]) -> str:
    fits = "fits" if rule["fits"] else "does not fit"
    return f"{rule['policy']}: {rule['offered']} -> {rule['requested']} {fits}. {rule['rule']}"


def _describe_outcome(experiment: Experiment, outcome: ExperimentOutcome) -> str:
    if not outcome.connected:
        return f"not connected ({outcome.broken.lower() or 'nothing was found'})"
    parts = [f"connected, {len(outcome.received)} of {outcome.sent} arrived"]
    if outcome.latency_ms:
        # What is replayed to a late reader waited in the writer's queue, and not on its way.
        what = "age" if experiment.scenario == "late joiner" else "latency"
        parts.append(f"{what} p50 {statistics.median(outcome.latency_ms):.2f} ms")
    if outcome.received and not outcome.in_order:
        parts.append("not in order")
    return ", ".join(parts)


def _check_prediction(arrive: Any) -> int | None:
    if arrive is None or (isinstance(arrive, int) and 0 <= arrive <= COUNT):
        return arrive
    raise ExperimentError(
        f"A prediction is a whole number of messages, 0 to {COUNT}, not {arrive!r}."
    )
