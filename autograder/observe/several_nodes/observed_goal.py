"""A goal that the examiner sends to the student's action server: accepted, ended, canceled."""

from __future__ import annotations

from typing import Any

from autograder.examination.pictures.picture import (
    MAX_LABEL_CHARS,
    MAX_TITLE_CHARS,
    Lane,
    Timeline,
)
from autograder.observe.examiner.actions import SentGoal
from autograder.observe.findings import with_picture
from autograder.observe.nouns import Action
from autograder.observe.observed_node import ObservedNode
from autograder.observe.phrases import end_phrase

MOST_DRAWN, SHORTEST_DRAWN_S = 100, 0.1
"""Messages of feedback in a picture, and seconds that it shows at least."""


class ObservedGoal:
    """A goal of which the task says what has to become of it.

    Attributes:
        sent: what has come of it so far.
        what: the goal in words, to begin a sentence with: "A goal of 3 m".

    Example:
        >>> def drives(node):
        ...     goal = ObservedGoal(node, DRIVE, "A goal of 3 m", order=3)
        ...     goal.require_accepted(within_s=1.0)
        ...     goal.require_end("succeeded", within_s=4.0)
    """

    def __init__(self, node: ObservedNode, action: Action, what: str, **fields: Any) -> None:
        """Send it, with these fields."""
        self._node, self._client, self.what = node, node.end.action_client(action), what
        self.sent: SentGoal = self._client.send(**fields)

    def require_accepted(self, within_s: float) -> None:
        """Require that it is accepted within so many s of the node's time.

        Raises:
            Failed: it is rejected, or no answer comes.
        """
        self._require_answer(True, within_s)

    def require_rejected(self, within_s: float) -> None:
        """Require that it is rejected within so many s of the node's time.

        Raises:
            Failed: it is accepted, or no answer comes.
        """
        self._require_answer(False, within_s)

    def _require_answer(self, accepted: bool, within_s: float) -> None:
        answers = {None: "not answered", True: "accepted", False: "rejected"}
        self._node.advance_until(lambda: self.sent.accepted is not None, within_s)
        with with_picture(self.draw):
            self._node.require_that(
                self.sent.accepted is accepted,
                f"{self.what} is {answers[accepted]}.",
                f"It was {answers[self.sent.accepted]}.",
            )

    def require_end(self, how: str, within_s: float, leeway_s: float = 0.0) -> None:
        """Require that it is over within so many s, and how it ended.

        Args:
            how: "succeeded", "canceled" or "aborted".
            within_s: seconds of the node's time, as the task says.
            leeway_s: seconds more that do no harm.

        Raises:
            Failed: it is not over then, or ended in another way.
        """
        is_over = self._node.advance_until(lambda: self.sent.end, within_s + leeway_s)
        with with_picture(self.draw):
            self._node.require_that(
                is_over,
                f"{self.what} is over, and {how}, within {within_s:g} s.",
                "After that time there was no result.",
            )
            self._node.require_that(
                self.sent.end == how,
                f"{self.what} ends as {how}.",
                f"It {end_phrase(self.sent.end)}.",
            )

    def require_cancel_accepted(self, within_s: float) -> None:
        """Ask the server to cancel it, and require that it says yes within so many s.

        Raises:
            Failed: it refuses, or no answer comes.
        """
        self._client.cancel(self.sent)
        self._node.advance_until(lambda: self.sent.cancel_accepted is not None, within_s)
        with with_picture(self.draw):
            self._node.require_that(
                self.sent.cancel_accepted,
                "A request to cancel is accepted.",
                "It was not answered." if self.sent.cancel_accepted is None else "It was refused.",
            )

    def draw(self) -> Timeline:
        """Return a picture of the goal's states so far, and of its feedback."""
        sent, begin_s = self.sent, self.sent.sent_at_s
        seconds = max(self._node.now_s - begin_s, SHORTEST_DRAWN_S)

        def since_begin(*times_s: float | None) -> list[float]:
            return [at - begin_s for at in times_s if at is not None]

        accepted = since_begin(sent.answered_at_s) if sent.accepted else []
        asked = since_begin(sent.cancel_asked_at_s)
        end_s = [*since_begin(sent.ended_at_s), seconds][0]
        lanes = (
            Lane.of(
                "the goal", {"event": since_begin(sent.ended_at_s)},
                [(at, end_s, "busy") for at in accepted],
            ),
            Lane.of("its feedback", {"done": since_begin(*sent.feedback_at_s[-MOST_DRAWN:])}),
            *(Lane.of("a cancel is asked for", {"due": [at]}) for at in asked),
        )  # fmt: skip
        legend = (
            ("busy", "accepted, and executed"), ("event", f"over: {sent.end}"[:MAX_LABEL_CHARS]),
        )  # fmt: skip
        title = f"{self.what} since it was sent, by the node's clock"[:MAX_TITLE_CHARS]
        return Timeline(title, seconds, lanes, legend)
