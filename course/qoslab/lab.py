"""Running experiments from a kernel: in processes of their own, with a deadline."""

from __future__ import annotations

import os
import subprocess
import sys

from course.domains import lease_domain
from course.errors import CourseError
from course.qoslab import link
from course.qoslab.experiment import LOSSY, SCENARIOS, Experiment, Outcome

TIMEOUT = 240.0


class LabError(CourseError):
    """An experiment that cannot be run; the message says why."""


def run(experiment: Experiment) -> Outcome:
    """Run ``experiment`` and return what was seen; about two seconds, or longer with a loss.

    Raises:
        LabError: no such scenario, a loss that is not 0 to 90 %, or its processes failed.
    """
    if experiment.scenario not in SCENARIOS:
        raise LabError(
            f"There is no scenario {experiment.scenario!r}: choose {', '.join(SCENARIOS)}."
        )
    loss: object = experiment.loss
    if not isinstance(loss, int) or not 0 <= loss <= 90:
        raise LabError(f"A link loses 0 to 90 % of its packets, a whole number, not {loss!r}.")
    remark = _no_loss(experiment)
    lossy = bool(experiment.drops and not remark)
    command = [sys.executable, "-m", "course.qoslab.bench"]
    lease = lease_domain()
    try:
        environment = _environment(lease.domain_id, lossy=lossy)
        done = subprocess.run(
            [*link.ENTER, *command, "--link"] if lossy else command,
            input=experiment.to_json() + "\n", env=environment, capture_output=True, text=True,
            timeout=TIMEOUT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise LabError(f"The experiment did not end within {TIMEOUT:.0f} s.") from None
    finally:
        lease.release()
    lines = done.stdout.strip().splitlines()
    if done.returncode or not lines:
        reason = (done.stderr.strip().splitlines() or ["no reason was given"])[-1]
        raise LabError(f"The experiment's processes failed: {reason}")
    outcome = Outcome.from_json(lines[-1])
    outcome.remark = remark
    return outcome


def _no_loss(experiment: Experiment) -> str:
    """Return why the link loses nothing although it was to, as a sentence; empty if it does."""
    if experiment.loss and not experiment.drops:
        return f"The link lost nothing here: it does so in {' and '.join(LOSSY)} only."
    return link.problem() if experiment.loss else ""


def _environment(domain_id: int, *, lossy: bool) -> dict[str, str]:
    environment = {
        **os.environ,
        "ROS_DOMAIN_ID": str(domain_id),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "RCUTILS_LOGGING_MIN_SEVERITY": "FATAL",
    }
    for name in ("ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY"):
        environment.pop(name, None)
    # Two processes on one host find each other at once only if they know where to look.
    environment["ROS_STATIC_PEERS"] = "127.0.0.1"
    return {**environment, **link.ENVIRONMENT} if lossy else environment
