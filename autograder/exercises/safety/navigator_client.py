"""Part C, the navigator's client: one request for a drive, its goal, its outcome, and a stop."""

from __future__ import annotations

from itertools import pairwise

from geometry_msgs.msg import Twist
from std_msgs.msg import Int32, String
from test_msgs.action import Fibonacci as Drive

from autograder.exercises.safety.speed_limits import is_motion
from autograder.observe import Action, Task, Topic
from autograder.observe.examiner.actions import ActionServerEnd
from autograder.observe.observed_node import STRIDE_S
from autograder.observe.phrases import say_words
from autograder.observe.several_nodes.clock_bound_node import ClockBoundNode
from autograder.observe.several_nodes.plain_programs import Clocked

REQUEST = Topic("navigate/request", Int32)
OUTCOME = Topic("navigate/outcome", String, value=lambda message: message.data)
SPEED = Topic("cmd_vel", Twist, value=is_motion)
NAVIGATE = Action("navigate", Drive)
NAVIGATION_CLIENT = Task(
    "NavigationClient", publishes=[OUTCOME, SPEED], subscribes=[REQUEST], uses=[NAVIGATE], threads=4
)

PROMPT_S = 1.0  # for an outcome that is clear; a node may look for it by a timer
SILENCE_S = 2.0  # without feedback after which a drive is canceled
ANSWER_S = 1.0  # that an answer may take
SLOW_S = 0.7  # that an answer takes which is slow, but in time whatever the tolerance
ALLOWED_S = 0.2  # more or less, which does no harm
TOLERANCE_S = ALLOWED_S + STRIDE_S  # what the task allows, and a node that looks by a timer
LOST_S = ANSWER_S + TOLERANCE_S + STRIDE_S  # for an answer that does not come
DIED_S = SILENCE_S + ANSWER_S + 2 * ALLOWED_S + STRIDE_S  # of a navigator that dies on the way
AFTER_S = 2.5  # in which a second outcome would show
COARSE_S = 0.5  # between two looks where it does not matter when exactly something happens
BREATH_S = 1.5  # between the feedbacks of a navigator that is slow, not dead
# Marks in the feedbacks of a slow drive, which takes longer than anyone would wait for the whole.
# Once it stands still in between: the same feedback again is a sign of life, too.
BREATHS = (1, 2, 3, 3, 4, 5, 6, 7)


class Journey:
    """One request for a drive, and what has become of it; what was before is forgotten.

    Attributes:
        metres: what was requested.
    """

    def __init__(
        self, node: Clocked, navigator: ActionServerEnd | None, metres: int, **plan: bool
    ) -> None:
        """Ask for it; what the navigator does with the goal is its `ActionServerEnd.plan`."""
        self.metres, self._end = metres, node.end
        before = node.end.values(OUTCOME)
        self.follows = f", the next one after “{before[-1]}”" if before else ""
        node.forget(OUTCOME, SPEED)
        if navigator is not None:
            navigator.plan(**plan)
        node.end.publisher(REQUEST).publish(Int32(data=metres))

    @property
    def outcomes(self) -> list[str]:
        """What was published on navigate/outcome so far."""
        return self._end.values(OUTCOME)

    def is_over(self) -> bool:
        """Return whether there is an outcome."""
        return bool(self.outcomes)


class ExaminedJourney(Journey):
    """A request for a drive in a session, of which the task says what has to become."""

    def __init__(
        self, node: ClockBoundNode, navigator: ActionServerEnd, metres: int, **plan: bool
    ) -> None:
        """Ask for it, and require that its goal is sent, if the navigator is there."""
        super().__init__(node, navigator, metres, **plan)
        self._node, self.navigator = node, navigator
        if not node.is_served(NAVIGATE):
            return
        node.advance_until(lambda: navigator.requested, PROMPT_S)
        orders = [goal.order for goal in navigator.requested]
        got = f"a goal with order={orders[0]}" if orders else "no goal"
        node.require_that(
            orders[:1] == [metres],
            f"After navigate/request {metres}{self.follows}, a goal with order={metres} is sent.",
            f"The request was published, and the navigator got {got}.",
        )
        if not plan.get("holds_goal"):
            node.advance_until(lambda: navigator.goals, PROMPT_S)

    def send_feedback(self, marks: int) -> None:
        """Tell how far the drive has come."""
        self.navigator.send_feedback(sequence=list(range(1, marks + 1)))

    def forget_stop(self) -> None:
        """Forget what the wheels were told so far: it does not answer what comes now."""
        self._node.rest()
        self._node.forget(SPEED)

    def require_outcome(self, when: str, word: str, limit_s: float = PROMPT_S) -> None:
        """Require one outcome, and a stop unless it is good; ``when`` begins a sentence."""
        self._node.require_word(OUTCOME, word, limit_s, when)
        if word == "arrived":
            return
        self._node.advance_until(lambda: self._end.values(SPEED), PROMPT_S)
        moved = self._end.values(SPEED)
        last = "the last command was to drive" if moved else f"nothing came within {PROMPT_S:g} s"
        self._node.require_that(
            moved[-1:] == [False],
            f"With “{word}” the robot is stopped: a zero Twist on cmd_vel.",
            f"It said “{word}”, but on cmd_vel {last}.",
        )

    def require_once(self, when: str, word: str) -> None:
        """Require that the outcome stays the only one, past any timer of the goal's."""
        self._node.advance(AFTER_S, stride_s=COARSE_S)
        self.require_outcome(when, word)

    def require_end(self, when: str, word: str) -> None:
        """Require an outcome at once, and none after it: a timer of the goal's may still run."""
        self.require_outcome(when, word)
        self.require_once(f"{when}, and for {AFTER_S:g} s after that", word)

    def breathe(self) -> None:
        """Give feedback so often that the drive must be left alone."""
        for before, marks in pairwise((-1, 0, *BREATHS)):
            if marks:
                self.send_feedback(marks)
            self._node.advance(BREATH_S, stride_s=COARSE_S)
            same = " The last feedback had the same marks as the one before: it counts, too."
            canceled = bool(self.navigator.cancels_at_s)
            self._node.require_that(
                not canceled and not self.outcomes,
                f"A drive with feedback every {BREATH_S:g} s is left alone.",
                ("It was canceled." if canceled else say_words(self.outcomes))
                + (same if marks == before else ""),
            )

    def require_cancel(self, event: str = "its acceptance") -> None:
        """Wait in silence until the goal is canceled, neither too early nor too late.

        ``event`` is what has just happened, and begins the silence.
        """
        self.forget_stop()  # what came before the silence does not answer it
        since_s, cancels_at_s = self._node.now_s, self.navigator.cancels_at_s
        self._node.advance_until(lambda: cancels_at_s, SILENCE_S + TOLERANCE_S)
        expected = (
            f"The goal is canceled {SILENCE_S:g} s after {event}, with no feedback since then."
        )
        self._node.require_that(
            cancels_at_s,
            expected,
            f"{SILENCE_S + TOLERANCE_S:g} s after {event} no request to cancel had come. "
            + say_words(self.outcomes),
        )
        waited_s = cancels_at_s[0] - since_s
        came = f"{waited_s:.1f} s after {event}"
        if waited_s < 0.0:
            came = f"while feedback was still coming, {-waited_s:.1f} s before {event}"
        self._node.require_that(
            waited_s >= SILENCE_S - TOLERANCE_S, expected, f"The request to cancel came {came}."
        )

    def answer_slowly(self, what: str, aside: str = "") -> None:
        """Let an answer come late, but in time; ``aside`` is told if it was given up."""
        self._node.advance(SLOW_S)
        self._node.require_that(
            not self.outcomes,
            f"An answer to {what} after {SLOW_S:g} s is in time.",
            f"Before that it said “{''.join(self.outcomes[:1])}”.{aside}",
        )
        self.navigator.decide()
        self._node.advance_until(lambda: self.navigator.goals, PROMPT_S)
