"""Part A, the gripper's client: one request for a grip, its tries, and its outcome."""

from __future__ import annotations

from functools import partial

from std_msgs.msg import Bool, Empty, String
from std_srvs.srv import SetBool

from autograder.examination.pictures.picture import Lane, Timeline
from autograder.observe import Service, Task, Topic
from autograder.observe.examiner.services import Request, ServiceServer
from autograder.observe.findings import with_picture
from autograder.observe.observed_node import STRIDE_S
from autograder.observe.phrases import capitalize_first, say_words, there_were
from autograder.observe.several_nodes.clock_bound_node import ClockBoundNode
from autograder.observe.several_nodes.heartbeats import require_heartbeat
from autograder.observe.several_nodes.plain_programs import Clocked

REQUEST = Topic("grip/request", Bool)
OUTCOME = Topic("grip/outcome", String, value=lambda message: message.data)
HOLD = Topic("arm/hold", Empty)
HEARTBEAT = Topic("grip/heartbeat", Empty)
GRIPPER = Service("gripper/set", SetBool)
GRIPPER_CLIENT = Task(
    "GripperClient", publishes=[OUTCOME, HOLD, HEARTBEAT], subscribes=[REQUEST], uses=[GRIPPER],
    threads=4,
)  # fmt: skip

PROMPT_S = 1.0  # for an outcome that is clear; a node may look for it by a timer
LONGEST_S = 10.0  # from a request to its outcome
ALLOWED_S = 0.2  # more or less, which does no harm
TOLERANCE_S = ALLOWED_S + STRIDE_S / 2  # what the task allows, and what the strides blur
DEADLINE_S = LONGEST_S + TOLERANCE_S + STRIDE_S  # after which no outcome is due any more
AFTER_S = 1.5  # in which a second outcome would show
COARSE_S = 0.5  # between two looks where it does not matter when exactly something happens
ANSWER_S = 1.0  # after which a try has failed
PAUSE_S = 0.5  # from then to the second try, at least, and by which the next pause is longer
SHORTEST_S = 4.5 - 5 * ALLOWED_S - STRIDE_S  # three tries and two pauses, as short as may be
HELD_S = 1.0  # of wall time for which the node's clock stands still in the first pause
BEAT_S = 0.5  # between two heartbeats
MOST_DRAWN = 30  # tries, and outcomes, in a picture
GIVEN_UP = "After three tries without an answer"
require_beats = partial(require_heartbeat, topic=HEARTBEAT, period_s=BEAT_S, allowed_s=ALLOWED_S)
SECOND_TRY = "After a try without an answer there is a second one."


class Grip:
    """One request for a grip, and what has become of it; what was before is forgotten.

    Attributes:
        gripper: the server that is asked, if there is one.
        close: what was requested.
        began_s: when, in s of the node's time.
    """

    def __init__(self, node: Clocked, gripper: ServiceServer | None, close: bool) -> None:
        """Ask for it."""
        self.gripper, self.close, self.began_s = gripper, close, node.now_s
        self._end, self._first_try = node.end, len(gripper.requests) if gripper else 0
        before = node.end.values(OUTCOME)
        self.follows = f", the next one after “{before[-1]}”" if before else ""
        node.forget(OUTCOME, HOLD)
        node.end.publisher(REQUEST).publish(Bool(data=close))

    @property
    def tries(self) -> list[Request]:
        """The calls of the gripper so far."""
        return self.gripper.requests[self._first_try :] if self.gripper else []

    @property
    def outcomes(self) -> list[str]:
        """What was published on grip/outcome so far."""
        return self._end.values(OUTCOME)

    def has_begun(self) -> bool:
        """Return whether the gripper has been called."""
        return bool(self.tries)

    def is_over(self) -> bool:
        """Return whether there is an outcome."""
        return bool(self.outcomes)

    def has_gone_on(self, tries: int = 1) -> bool:
        """Return whether there are more tries than these, or an outcome."""
        return len(self.tries) > tries or self.is_over()


class ExaminedGrip(Grip):
    """A request for a grip in a session, of which the task says what has to become."""

    def __init__(self, node: ClockBoundNode, gripper: ServiceServer | None, close: bool) -> None:
        """Ask for it, and require that the gripper is called, if there is one."""
        super().__init__(node, gripper, close)
        self._node, self._when = node, ""
        if gripper is not None:
            data = str(close).lower()
            node.require_that(
                node.advance_until(self.has_begun, PROMPT_S),
                f"After grip/request {data}{self.follows}, gripper/set is called.",
                f"Within {PROMPT_S:g} s the gripper was not called. {say_words(self.outcomes)}",
            )
            self.require_data()

    def draw(self) -> Timeline:
        """Return a picture of the tries so far, of when they were due, and of the outcomes."""
        tries_s = [attempt.at_s - self.began_s for attempt in self.tries[:MOST_DRAWN]]
        outcomes = [h for h in self._end.heard(OUTCOME) if h.at_s >= self.began_s][:MOST_DRAWN]
        seconds = max(self._node.now_s - self.began_s, ANSWER_S)
        due_s = [tries_s[0], tries_s[0] + ANSWER_S + PAUSE_S] if tries_s else []
        if len(tries_s) > 1:
            due_s.append(2 * tries_s[1] - tries_s[0] + PAUSE_S)
        waits = [(at, min(at + ANSWER_S, seconds), "busy") for at in tries_s]
        wrong = {
            at for number, at in enumerate(tries_s)
            if number >= len(due_s) or at < due_s[number] - TOLERANCE_S
        }  # fmt: skip
        lanes = (
            Lane.of("tries", {"done": {*tries_s} - wrong, "wrong": wrong}, waits),
            Lane.of("due then, or a bit later", {"due": [at for at in due_s if at <= seconds]}),
            Lane.of("outcome", {"event": [heard.at_s - self.began_s for heard in outcomes]}),
        )
        legend = (
            ("done", "the gripper is called"), ("wrong", "too early, or too often"),
            ("busy", "1 s for its answer"),
        )  # fmt: skip
        data = str(self.close).lower()
        return Timeline(f"After grip/request {data}, by the node's clock", seconds, lanes, legend)

    def require_data(self) -> None:
        """Require that every try so far asks for what was requested."""
        for number, attempt in enumerate(self.tries, 1):
            which = f" in try {number}" if number > 1 else ""
            self._node.require_that(
                attempt.message.data is self.close,
                f"The gripper is called with data={str(self.close).lower()}, as requested.",
                f"It was called with data={str(attempt.message.data).lower()}{which}.",
            )

    def require_outcome(self, when: str, word: str, limit_s: float = PROMPT_S) -> None:
        """Require one outcome, and a held arm unless it is good; ``when`` begins a sentence."""
        self._when = when
        self._node.require_word(OUTCOME, word, limit_s, when)
        self._node.require_that(
            word == "done" or self._node.advance_until(lambda: self._end.values(HOLD), PROMPT_S),
            f"With “{word}” the arm is told to hold still, on arm/hold.",
            f"It said “{word}”, and within {PROMPT_S:g} s nothing came on arm/hold.",
        )

    def require_once(self, when: str = "") -> None:
        """Require that the outcome stays the only one."""
        self._node.advance(AFTER_S, stride_s=COARSE_S)
        self._node.require_that(
            len(self.outcomes) == 1,
            f"{when or self._when}, there is exactly one outcome.",
            say_words(self.outcomes),
        )

    def refuse(self, when: str) -> None:
        """Refuse the try that is under way, and require that it is the last."""
        self._node.forget(HOLD)  # what came with the request says nothing about the outcome
        tries = len(self.tries)
        self.tries[-1].answer(success=False)

        def require_no_more() -> None:
            self._node.require_that(
                len(self.tries) <= tries,
                f"{when}: a refusal is an answer, so the gripper is not asked again.",
                f"The gripper was called {len(self.tries)} times.",
            )

        self._node.advance_until(lambda: self.has_gone_on(tries), PROMPT_S)
        require_no_more()
        self.require_outcome(when, "refused")
        self.require_once()
        require_no_more()

    def require_patience(self) -> None:
        """Require that there is no outcome yet, while one try has had no answer."""
        said = f"After one try it said “{''.join(self.outcomes[:1])}”."
        self._node.require_that(not self.outcomes, SECOND_TRY, said)

    def require_second_try(self) -> None:
        """Require that the gripper is tried once more before there is an outcome."""
        self._node.advance_until(self.has_gone_on, LONGEST_S)
        self.require_patience()
        missing = f"There was no second try in {LONGEST_S:g} s."
        self._node.require_that(len(self.tries) > 1, SECOND_TRY, missing)

    def answer_again(self) -> None:
        """Let the second try succeed, and require that it counts."""
        self.require_second_try()
        self.tries[1].answer(success=True)
        self.require_outcome("When the second try was answered with success=True", "done")

    def require_ignored(self, what: str) -> None:
        """Require that an answer that has just been given does not count."""
        self._node.advance(2 * STRIDE_S)
        self._node.require_that(
            not self.outcomes,
            f"A try has 1 s. The answer to the {what}, and is ignored.",
            f"It was taken for a present answer: it said “{''.join(self.outcomes[:1])}”.",
        )

    def require_failure(self, when: str, began_s: float) -> None:
        """Require that it fails, after three tries' time, and that the heart beats on."""
        self.require_outcome(when, "failed", DEADLINE_S)
        lasted_s = self._node.now_s - began_s
        self._node.require_that(
            lasted_s >= SHORTEST_S,
            f"{when}, three tries take 3 s, and the pauses 1.5 s: it may come back.",
            f"“failed” came after {lasted_s:.1f} s.",
        )
        require_beats(self._node, when=when, since_s=began_s)


def carry_out(
    node: ClockBoundNode, gripper: ServiceServer, close: bool, delay_s: float, aside: str = ""
) -> ExaminedGrip:
    """Answer a first try with success after so many s, and require that it counts.

    ``aside`` is a sentence to add if the gripper was called again.
    """
    grip = ExaminedGrip(node, gripper, close)
    with with_picture(grip.draw):
        node.advance_until(lambda: False, delay_s)
        if not grip.outcomes:
            grip.tries[0].answer(success=True)
        node.advance_until(grip.has_gone_on, PROMPT_S)
        node.require_that(
            len(grip.tries) == 1,
            f"An answer after {delay_s:g} s is in time: one try is enough.",
            f"The gripper was called {len(grip.tries)} times.{aside}",
        )
        grip.require_outcome(f"When the gripper answered success=True after {delay_s:g} s", "done")
    return grip


def give_up(
    node: ClockBoundNode, gripper: ServiceServer, close: bool, *, stands_still: bool = False
) -> ExaminedGrip:
    """Answer no try, let the second one raise, and require three of them, pauses and outcome.

    ``stands_still``: time does so for a while when the first try has had its own.
    """
    grip = ExaminedGrip(node, gripper, close)

    def advance_to(second_s: float, tries: int, stride_s: float = STRIDE_S) -> None:
        left_s = grip.began_s + second_s - node.now_s
        node.advance_until(lambda: grip.has_gone_on(tries), left_s, stride_s=stride_s)

    half_s = STRIDE_S / 2  # strides blur how short the first pause is
    advance_to(node.now_s - grip.began_s + ANSWER_S + half_s, 1, half_s)
    if stands_still:
        what = f"{ANSWER_S:g} s after the first try the next one came, or an outcome"
        node.require_standstill(grip.has_gone_on, what, HELD_S)
    advance_to(2 * (ANSWER_S + PAUSE_S), 1, half_s)
    advance_to(DEADLINE_S, 1, COARSE_S)
    if len(grip.tries) > 1:
        grip.tries[1].fail()
    advance_to(DEADLINE_S, 2)
    if not grip.outcomes:
        node.forget(HOLD)  # what came with a try says nothing about the outcome
    node.advance_until(grip.is_over, grip.began_s + DEADLINE_S - node.now_s)
    with with_picture(grip.draw):
        _require_three_tries(node, grip)
    return grip


def _require_three_tries(node: ClockBoundNode, grip: ExaminedGrip) -> None:
    """Require that a grip was given up after three tries, with pauses that grow, and at once."""
    ended_s, times_s = node.now_s, [attempt.at_s for attempt in grip.tries]
    tries = there_were(len(times_s), "try", "tries")
    hint = " A time-out on the wall clock does not run in simulated time."
    node.require_that(
        grip.outcomes,
        f"A gripper that never answers is given up within {LONGEST_S:g} s.",
        f"After {DEADLINE_S:.1f} s of simulated time {tries} and no outcome."
        + ("" if len(times_s) > 1 else hint),
    )
    node.require_that(
        len(times_s) == 3,
        "A gripper that never answers is tried three times.",
        f"{capitalize_first(tries)} before the outcome “{grip.outcomes[0]}”.",
    )
    grip.require_data()
    grip.require_outcome(GIVEN_UP, "failed")
    first_s, second_s = times_s[1] - times_s[0], times_s[2] - times_s[1]
    node.require_that(  # a try and a pause: two times, each of which may be shorter
        first_s >= ANSWER_S + PAUSE_S - 2 * ALLOWED_S - STRIDE_S / 4,
        "The second try comes 1.5 s after the first, or later: 1 s for an answer, and 0.5 s of "
        f"pause. Each may be {ALLOWED_S:g} s shorter.",
        f"It came {first_s:.1f} s after the first.",
    )
    node.require_that(
        second_s - first_s >= PAUSE_S - TOLERANCE_S,
        f"The second pause is at least {PAUSE_S:g} s longer than the first one; {ALLOWED_S:g} s "
        "less do no harm.",
        f"The second try came {first_s:.1f} s after the first, and the third {second_s:.1f} s "
        "after the second.",
    )
    node.require_that(
        ended_s - times_s[2] <= ANSWER_S + PROMPT_S + TOLERANCE_S,
        f"When the third try has had no answer for {ANSWER_S:g} s, the outcome is clear, and comes "
        "at once.",
        f"It came {ended_s - times_s[2]:.1f} s after the third try.",
    )
