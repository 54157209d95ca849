"""GoalRun: one goal sent to an action server, followed from acceptance to result."""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Any

from rclpy.action.client import ActionClient, ClientGoalHandle

from course.errors import WaitTimeout
from course.runtime.offers import why_no_service
from course.runtime.probe import Probe
from course.runtime.settle import settle
from course.runtime.waiting import Deadline, poll


class GoalState(IntEnum):
    """action_msgs/msg/GoalStatus, with names."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    def __str__(self) -> str:
        """Return the name and the number."""
        return f"{self.name} ({self.value})"


class GoalRun:
    """A goal on its way.

    Attributes:
        accepted: whether the server took the goal.
        feedback: the feedback messages so far, in order.
    """

    def __init__(self, probe: Probe, name: str, on_feedback: Callable[[Any], None] | None) -> None:
        """Prepare to follow a goal of the action `name`; `Goals.send` starts it."""
        self.name = name
        self.accepted = False
        self.feedback: list[Any] = []
        self._probe = probe
        self._on_feedback = on_feedback
        self._handle: ClientGoalHandle | None = None
        self._future: Any = None

    @property
    def done(self) -> bool:
        """Whether the result is here, or never will be because the goal was rejected."""
        return not self.accepted or bool(self._future.done())

    @property
    def result(self) -> Any | None:
        """The result message, or None before it is here and for a rejected goal."""
        return self._future.result().result if self.accepted and self.done else None

    @property
    def status(self) -> GoalState:
        """The goal's state; an `int` as in action_msgs/msg/GoalStatus. UNKNOWN if rejected."""
        if not self.accepted:
            return GoalState.UNKNOWN
        if self.done:
            return GoalState(self._future.result().status)
        assert self._handle is not None
        return GoalState(self._handle.status)

    def wait(self, timeout: float = 10.0) -> Any | None:
        """Return the result as soon as it is here; None at once for a rejected goal.

        Raises:
            WaitTimeout: no result within `timeout` seconds.
        """
        if not poll(lambda: self.done, timeout, self._probe.pulse):
            raise WaitTimeout(
                f"The goal on {self.name} has no result after {timeout:g} s; "
                f"its state is {self.status.name}, with {len(self.feedback)} feedback messages."
            )
        # Feedback and result come on separate topics: take what arrived before the result.
        settle([self._probe.executor])
        return self.result

    def cancel(self, timeout: float = 5.0) -> bool:
        """Ask the server to cancel the goal; return whether it agreed.

        The answer is in the response's `goals_canceling`: its return code is 0 in both cases.

        Raises:
            WaitTimeout: the server did not answer within `timeout` seconds.
        """
        if self._handle is None or not self.accepted:
            return False
        # rclpy registers the request after it has sent it: no answer may come in between.
        with self._probe.executor.held():
            future = self._handle.cancel_goal_async()
        response = self._probe.outcome(
            future, Deadline(timeout), f"{self.name} did not answer the request to cancel"
        )
        mine = bytes(self._handle.goal_id.uuid)
        return any(bytes(info.goal_id.uuid) == mine for info in response.goals_canceling)

    def __repr__(self) -> str:
        """Return a summary for a notebook."""
        state = self.status.name if self.accepted else "REJECTED"
        return f"<Goal on {self.name}: {state}, {len(self.feedback)} feedback messages>"

    def take_feedback(self, message: Any) -> None:
        """Keep a feedback message and hand it on."""
        self.feedback.append(message.feedback)
        if self._on_feedback is not None:
            self._on_feedback(message.feedback)

    def follow(self, handle: ClientGoalHandle) -> None:
        """Take the server's answer, and ask for the result of an accepted goal."""
        self.accepted, self._handle = bool(handle.accepted), handle
        if self.accepted:
            with self._probe.executor.held():
                self._future = handle.get_result_async()


class Goals:
    """Sends goals through a probe; keeps one action client for each action."""

    def __init__(self, probe: Probe) -> None:
        """Send through `probe`."""
        self._probe = probe
        self._clients: dict[tuple[Any, str], ActionClient] = {}

    def send(
        self,
        action_type: Any,
        name: str,
        goal: Any,
        timeout: float,
        on_feedback: Callable[[Any], None] | None,
    ) -> GoalRun:
        """Send a goal and return when the server has accepted or rejected it.

        Raises:
            WaitTimeout: no server, or no answer, within `timeout` seconds.
        """
        deadline = Deadline(timeout)
        client = self._clients.get((action_type, name))
        if client is None:
            client = ActionClient(self._probe.node, action_type, name)
            self._clients[action_type, name] = client
        if not poll(client.server_is_ready, deadline.left, self._probe.pulse):
            service = str(self._probe.node.resolve_service_name(f"{name}/_action/send_goal"))
            reason = why_no_service(
                self._probe.node, service, action_type.Impl.SendGoalService
            ).replace("/_action/send_goal", "")
            raise WaitTimeout(f"The action {name} was not ready in {timeout:g} s. {reason}")
        run = GoalRun(self._probe, name, on_feedback)
        with self._probe.executor.held():
            future = client.send_goal_async(goal, feedback_callback=run.take_feedback)
        run.follow(self._probe.outcome(future, deadline, f"{name} did not answer to the goal"))
        return run
