"""The robot's rates and times in a plain program, by a clock that the student's process never has.

The harness moves a node's time through functions in the student's process, which may move it by
twice as much as they are asked to: a camera with half the pictures then seems to be right. So what
was right there is seen once more, in short, in a program that nobody asks. Only what is off by a
good part counts: nothing here has to be punctual.

At first it is seen with little patience, as most of it is right. What was not, or was not to be
seen, is looked at by itself with as much patience as ever, if it was right with the harness.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field

from sensor_msgs.msg import BatteryState

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import Failed, NotExaminable
from autograder.examination.plain_programs import Program, Programs
from autograder.exercises.patterns import camera_stream, drive_ends, interface_patterns, odometry
from autograder.exercises.patterns.discovery import LateJoiner, wait_for_discovery
from autograder.exercises.patterns.driving import ACTIONS, Drive
from autograder.exercises.patterns.rig import (
    LEAST_IDLE,
    LEVEL_MARGIN,
    NODE,
    SETTLE,
    STEP,
    THREADS,
    RobotRig,
)
from autograder.exercises.patterns.scenarios import NAMES, Scenario
from autograder.exercises.patterns.stations import require_no_further
from autograder.exercises.patterns.unaffected_during_drive import LEVEL_AGE, last_level
from autograder.observe.patience import IDLE_S, Patience
from autograder.observe.simulated_clock import SimulatedClock

MORE, LESS = 1.4, 0.7
"""Times what the task says from which on a time is too long, or a rate too high, or too low."""
FILMED = 1.0
"""Seconds of the program's clock in which pictures are counted."""
STANDS, COARSE = 15.0, 0.5
"""Seconds of the program's clock for which the aisle is blocked, and between two moments of it."""
FAR = 50  # stations to drive; the drive is called off
AT_ONCE = 1.0  # s in which nodes and the examiner find each other, if all is made with the node
HASTY_IDLE, HASTY = 0.5, 2.0
"""Seconds with nobody at work, and in all, in which what is right comes from an idle machine."""

WHEN = "When the node runs in a program of its own, whose /clock the examiner publishes,"
UNTOLD = (
    "This was right when the harness moved your node's time on. But in a program of its own, whose "
    "/clock the examiner publishes, it could not be seen. After a hand-in a person looks at it."
)


class ProgramRig(RobotRig):
    """The rig of a plain program: its time is the examiner's own clock, and nobody is asked.

    ``drive`` is the one that is under way.
    """

    def __init__(self, bench: CheckContext, program: Program, *, hasty: bool) -> None:
        """Bring up the examiner's endpoints beside a program."""
        super().__init__(bench, program.session)
        self.memory = {"offers": bench.memory["offers"]}
        self.drive: Drive | None = None
        self.clock = SimulatedClock(program.session)
        self.settle, self._idle = (HASTY, HASTY_IDLE) if hasty else (SETTLE, IDLE_S)

    def _advance_clock(self, seconds: float, grain: float) -> None:
        stride = min(seconds, grain)
        for _ in range(round(seconds / stride)):
            self.clock.move(stride)
            self._threads.wait_for_rest()

    def wait_stepping(
        self,
        condition: Callable[[], object],
        seconds: float | None = None,
        timeout: float | None = None,
        step: float = STEP,
    ) -> bool:
        """Let the clock run until ``condition`` holds, as `RobotRig.wait_stepping` does.

        Raises:
            NotExaminable: the wall time for that was over before the ``seconds`` were.
        """
        began = self.elapsed
        holds = super().wait_stepping(condition, seconds, timeout, step)
        if not holds and seconds is not None and seconds - (self.elapsed - began) > step / 2:
            raise NotExaminable(UNTOLD)
        return holds

    def nudge(self) -> None:
        """Tell the node that hardly any time has passed."""
        self.clock.move(0.0)

    def start_patience(self, seconds: float, stepped: float = 0.0) -> Patience:
        """Return for how long something is waited for that may never come."""
        return Patience(self._threads, seconds, max(LEAST_IDLE, self._idle - stepped))

    def error_note(self) -> str:
        """Return nothing: nobody is asked what a callback raised."""
        return ""


@dataclass
class _Findings:
    """The trials that were passed and those that were not, and those that had all patience."""

    right: set[str] = field(default_factory=set)
    wrong: dict[str, Failed] = field(default_factory=dict)
    patient: set[str] = field(default_factory=set)

    def note_outcomes(self, outcomes: dict[str, Failed | None]) -> None:
        for name, outcome in outcomes.items():
            self.wrong.pop(name, None)
            if outcome is None:
                self.right.add(name)
            else:
                self.wrong[name] = outcome


def require_trial(rig: RobotRig, name: str) -> None:
    """Fail unless a trial is passed in a plain program; nothing where there are no such programs.

    Args:
        rig: the rig with which all was right that the trial is about.
        name: one of `TRIALS`.

    Raises:
        NotExaminable: it could not be seen there.
    """
    programs = rig.bench.programs
    if programs is None:
        return
    if __name__ not in rig.memory:
        rig.memory[__name__] = _Findings()
        # The checks come in this order: what those before this one are about has failed already.
        names = list(TRIALS)[list(TRIALS).index(name) :]
        rig.memory[__name__].note_outcomes(_run_trials(rig.bench, programs, names, hasty=True))
    found: _Findings = rig.memory[__name__]
    if name not in found.right and name not in found.patient:
        found.patient.add(name)
        found.note_outcomes(_run_trials(rig.bench, programs, [name], hasty=False))
    if name in found.wrong:
        raise found.wrong[name]
    if name not in found.right:
        raise NotExaminable(UNTOLD)


def _run_trials(
    bench: CheckContext, programs: Programs, names: Iterable[str], *, hasty: bool
) -> dict[str, Failed | None]:
    """Return of each trial how it was failed, or None; what could not be seen is missing."""
    outcomes: dict[str, Failed | None] = {}
    nodes = [(NODE, ())]
    with programs.program(nodes, threads=THREADS, sim_time=True, goes_on=True) as program:
        if not program.up:
            return outcomes
        with closing(ProgramRig(bench, program, hasty=hasty)) as rig:
            trials = {
                name: TRIALS[name] for name in names if _has_pattern(rig, TRIALS[name].scenario)
            }
            _await_interface(rig, {trial.scenario for trial in trials.values()})
            for name, trial in trials.items():
                if program.has_ended():
                    break  # something in it has: an exit, say
                outcome = None
                try:
                    trial.run(rig)
                except Failed as failed:
                    outcome = failed
                except NotExaminable:
                    continue
                if not program.has_ended():
                    outcomes[name] = outcome
    return outcomes


def _has_pattern(rig: ProgramRig, scenario: Scenario) -> bool:
    """Whether a scenario has the pattern that its trial is about, as far as the graph tells."""
    found: interface_patterns.Patterns = rig.memory["offers"][scenario]
    if scenario == "navigation":
        return found.get("action") in ACTIONS.split(" or ")
    return "topic" in found or (scenario == "position" and "service" in found)


def _await_interface(rig: ProgramRig, scenarios: set[Scenario]) -> None:
    def met() -> bool:
        return rig.clock.is_followed and all(
            interface_patterns.find_patterns(rig, s) for s in scenarios
        )

    if rig.wait(met, AT_ONCE):
        return
    # A timer may make all this, and a level may not come before it has.
    rig.step(interface_patterns.WAKES, interface_patterns.COARSE)
    if not rig.wait(met, AT_ONCE):
        interface_patterns.trigger_creation(rig)
        rig.wait(met)


@contextmanager
def _as_not_examinable() -> Iterator[None]:
    """Where the block fails, nothing can be told of what comes after it."""
    try:
        yield
    except Failed:
        raise NotExaminable(UNTOLD) from None


def _require_level(rig: ProgramRig) -> None:
    level = rig.draws.number("the level in a program", 0.45, 0.3, 0.5)
    rig.report("charge", level)
    if not rig.wait_stepping(lambda: rig.told_level(level), MORE * LEVEL_AGE):
        raise Failed(
            expected=f"{WHEN} a new battery level is known within {LEVEL_AGE:g} s.",
            actual=f"{MORE * LEVEL_AGE:g} s after it had become {level:g}, {last_level(rig)}.",
        )


def _require_late(rig: ProgramRig) -> None:
    level = rig.draws.number("the last level in a program", 0.25, 0.1, 0.29)
    rig.report("charge", level)
    if not LateJoiner(rig, BatteryState, NAMES["battery"]).durable:
        rig.step(
            MORE * LEVEL_AGE, interface_patterns.COARSE
        )  # until what this change set off is over
    late = LateJoiner(rig, BatteryState, NAMES["battery"])
    wait_for_discovery(rig)

    def told() -> bool:
        return bool(late.heard) and abs(late.heard[-1].percentage - level) < LEVEL_MARGIN

    # What DDS has kept comes without any time of the program's.
    if not (late.durable and rig.wait(told)) and not rig.wait_stepping(told, MORE * LEVEL_AGE):
        said = f"it was told {late.heard[-1].percentage:.4g}" if late.heard else "it knew none"
        raise Failed(
            expected=f"{WHEN} whoever joins late knows the battery level within {LEVEL_AGE:g} s.",
            actual=f"{MORE * LEVEL_AGE:g} s after it had joined, with the level at {level:g}, "
            f"{said}.",
        )


def _require_position(rig: ProgramRig) -> None:
    pattern = "service" if "service" in rig.memory["offers"]["position"] else "topic"
    rig.report("position", rig.draws.number("the first position in a program", 0.1, 0.1, 0.2))
    if pattern == "service" and not odometry.ask_position(rig)[1]:
        raise NotExaminable(UNTOLD)
    position = rig.draws.number("the position in a program", 0.4, 0.3, 0.6)
    rig.report("position", position)
    asker = odometry.asker_by(rig, pattern)
    if answer := odometry.position_fault(rig, asker, position, MORE * odometry.AGE):
        raise Failed(
            expected=f"{WHEN} whoever wants to know the position gets it, at most "
            f"{odometry.AGE:g} s old.",
            actual=f"{MORE * odometry.AGE:g} s after the robot had come to {position:g} m, "
            f"{answer}",
        )


def _require_rate(rig: ProgramRig) -> None:
    if not camera_stream.wait_for_picture(rig, 0):
        raise NotExaminable(UNTOLD)
    least, most = camera_stream.RATE
    stretch = camera_stream.Stretch(rig)
    stretch.run(FILMED, (least + most) / 2)
    if (rates := stretch.measure_rates()) is None or not stretch.is_numbered:
        raise NotExaminable(UNTOLD)
    if wrong := camera_stream.rate_fault(rates, (LESS * least, MORE * most)):
        raise Failed(
            expected=f"{WHEN} {least:g} to {most:g} pictures a second come.",
            actual=f"They came at {wrong} a second.",
        )


def _under_way(rig: ProgramRig) -> Drive:
    """Return a drive, with the robot on its way to the next station."""
    if rig.drive is None or rig.drive.run.done:
        with _as_not_examinable():
            start = max(1, math.ceil(rig.position))
            rig.drive = Drive(rig, start, start + FAR)
            rig.drive.require_driving()
            rig.drive.leave_station()
    return rig.drive


def _require_patience(rig: ProgramRig) -> None:
    drive = _under_way(rig)
    try:
        drive.go_by(STANDS, COARSE)
        require_no_further(drive)
    except Failed as failed:
        raise Failed(
            expected=f"{failed.expected} So it is in a program of its own, too, whose /clock the "
            "examiner publishes.",
            actual=failed.actual,
        ) from None


def _require_stop(rig: ProgramRig) -> None:
    drive = _under_way(rig)
    with _as_not_examinable():
        over = drive_ends.cancel_drive(drive, MORE * drive_ends.STOPS, looking=0.0)
    if not drive_ends.stopped_by(drive, over):
        raise Failed(
            expected=f"{WHEN} a drive that is called off stops the robot within "
            f"{drive_ends.STOPS:g} s.",
            actual=f"{MORE * drive_ends.STOPS:g} s later hardware/speed had not said 0.0 yet.",
        )


@dataclass(frozen=True)
class Trial:
    """What is seen in a plain program, and which scenario it is about."""

    scenario: Scenario
    run: Callable[[ProgramRig], None]


TRIALS = {
    "camera": Trial("camera", _require_rate),
    "position": Trial("position", _require_position),
    "level": Trial("battery", _require_level),
    "late": Trial("battery", _require_late),
    "aisle": Trial("navigation", _require_patience),
    "cancel": Trial("navigation", _require_stop),
}
"""By the name that `require_trial` knows each by, in the order in which they come."""
