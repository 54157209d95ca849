"""What a check works with: the examiner's own session, and its grip on the subject."""

from __future__ import annotations

from typing import Any

from autograder.wire import Channel, ChannelClosed, ChannelTimeout
from course import Session

REPLY_TIMEOUT = 10.0
"""Seconds a subject may take over one request (making a node, say) before it counts as hung."""


class SubjectGone(Exception):  # noqa: N818 - it is a finding, not a fault of ours
    """The subject's process ended, or does not answer any more; the message says how."""


class StudentError(Exception):
    """The student's code raised while carrying out a request; the message is its error."""

    def __init__(self, error: str, trace: str = "") -> None:
        """Keep the student's error and where in their code it came from."""
        super().__init__(error)
        self.trace = trace


class Subject:
    """The examiner's end of the control channel. It asks; it does not believe."""

    def __init__(self, channel: Channel) -> None:
        """Talk to the harness over ``channel``."""
        self._channel = channel
        self._gone: str | None = None

    def start(self, class_name: str) -> str:
        """Make a node of a class of the notebook and spin it; return its name.

        Raises:
            StudentError: the class is missing or its constructor raised.
            SubjectGone: the process ended or hangs.
        """
        return str(self._ask("start", class_name)["node"])

    def stop(self, class_name: str) -> None:
        """Destroy the node made of a class."""
        self._ask("stop", class_name)

    def pause(self, class_name: str) -> None:
        """Stop executing the node's callbacks while its endpoints go on receiving."""
        self._ask("pause", class_name)

    def resume(self, class_name: str) -> None:
        """Execute the node's callbacks again, beginning with what queued up."""
        self._ask("resume", class_name)

    def errors(self) -> list[str]:
        """Return what the student's callbacks raised: for an explanation, never as evidence."""
        return [str(line) for line in self._ask("errors", "").get("errors", [])]

    def _ask(self, operation: str, class_name: str) -> dict[str, Any]:
        if self._gone:
            raise SubjectGone(self._gone)
        try:
            self._channel.send({"op": operation, "class": class_name})
            reply = self._channel.receive(REPLY_TIMEOUT)
        except ChannelClosed:
            self._gone = f"Your program ended while it was asked to {operation} {class_name}."
            raise SubjectGone(self._gone) from None
        except ChannelTimeout:
            self._gone = (
                f"Your program did not answer within {REPLY_TIMEOUT:.0f} s when it was asked to "
                f"{operation} {class_name}: does a constructor or a callback wait for ever?"
            )
            raise SubjectGone(self._gone) from None
        if not reply.get("ok"):
            raise StudentError(str(reply.get("error", "unknown")), str(reply.get("trace", "")))
        return reply

    def release(self) -> None:
        """Let the harness go: it stops its nodes and returns to whoever started it."""
        try:
            self._channel.send({"op": "done"})
        except ChannelClosed:
            self._gone = self._gone or "Your program ended."


class Bench:
    """The examiner's session on the subject's domain, and the subject."""

    def __init__(self, session: Session, subject: Subject, memory: dict[str, Any]) -> None:
        """Put both within a check's reach.

        ``memory`` outlives this bench: what an experiment found in an earlier part of the exam,
        as long as the notebook has not moved on since.
        """
        self.session = session
        self.subject = subject
        self.memory = memory
