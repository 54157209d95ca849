"""GoalRun: one goal sent to an action server, followed from acceptance to result."""

from __future__ import annotations

import uuid
import weakref
from collections.abc import Callable
from enum import IntEnum
from typing import Any

from rclpy.action.client import ActionClient, ClientGoalHandle
from rclpy.qos import QoSProfile
from unique_identifier_msgs.msg import UUID  # type: ignore[import-untyped]

from course.errors import WaitTimeout
from course.runtime.executor.quiescence import settle_executors
from course.runtime.requests.graph_queries import full_action, full_topic, why_no_service
from course.runtime.requests.hidden_node import Probe
from course.runtime.waiting import Deadline, poll_condition
from course.util import argument_checks

_FEEDBACK_DEPTH = 1000
SEND_GOAL = "/_action/send_goal"
"""Follows an action's name in that of the service that takes its goals (ROS 2 design: Actions)."""


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
    def goal_id(self) -> bytes:
        """The goal's id, 16 bytes; empty before the server has answered."""
        return b"" if self._handle is None else bytes(self._handle.goal_id.uuid)

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
        timeout = argument_checks.check_seconds(timeout)
        with self._probe.explaining():
            if not self.done_within(timeout):
                raise WaitTimeout(
                    f"The goal on {self.name} has no result after {timeout:g} s; "
                    f"its state is {self.status.name}, with {len(self.feedback)} feedback messages."
                )
        # Feedback and result come on separate topics: take what arrived before the result.
        settle_executors([self._probe.executor])
        return self.result

    def done_within(self, timeout: float) -> bool:
        """Return whether the goal is `done`, as soon as it is, or after `timeout` seconds."""
        return bool(poll_condition(lambda: self.done, timeout, self._probe.pulse))

    def cancel(self, timeout: float = 5.0) -> bool:
        """Ask the server to cancel the goal; return whether it agreed.

        The answer is in the response's `goals_canceling`: its return code is 0 in both cases.

        Raises:
            WaitTimeout: the server did not answer within `timeout` seconds.
        """
        timeout = argument_checks.check_seconds(timeout)
        if self._handle is None or not self.accepted:
            return False
        with self._probe.executor.hold_still():  # as in Goals.send
            future = self._handle.cancel_goal_async()
        with self._probe.explaining():
            response = self._probe.wait_for_result(
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
        self.feedback.append(message)
        if self._on_feedback is not None:
            self._on_feedback(message)

    def follow(self, handle: ClientGoalHandle) -> None:
        """Take the server's answer, and ask for the result of an accepted goal."""
        self.accepted, self._handle = bool(handle.accepted), handle
        if self.accepted:
            with self._probe.executor.hold_still():
                self._future = handle.get_result_async()


class _Action:
    """The client side of one action, shared by all goals sent to it."""

    def __init__(self, probe: Probe, action_type: Any, name: str) -> None:
        self._runs: weakref.WeakValueDictionary[bytes, GoalRun] = weakref.WeakValueDictionary()
        self.client = ActionClient(probe.node, action_type, name)
        # A subscription of our own: rclpy's client drops the feedback that it has not got round to
        # when the result comes.
        self._feedback = probe.subscribe(
            action_type.Impl.FeedbackMessage,
            full_topic(probe.node, f"{name}/_action/feedback"),
            self._hand_on,
            QoSProfile(depth=_FEEDBACK_DEPTH),
        )

    def is_ready(self) -> bool:
        return bool(self.client.server_is_ready() and self._feedback.get_publisher_count())

    def send(self, goal: Any, run: GoalRun) -> Any:
        goal_id = UUID(uuid=list(uuid.uuid4().bytes))
        self._runs[bytes(goal_id.uuid)] = run
        return self.client.send_goal_async(goal, goal_uuid=goal_id)

    def _hand_on(self, message: Any) -> None:
        run = self._runs.get(bytes(message.goal_id.uuid))
        if run is not None:
            run.take_feedback(message.feedback)


class Goals:
    """Sends goals through a probe; keeps one client for each action."""

    def __init__(self, probe: Probe) -> None:
        """Send through `probe`."""
        self._probe = probe
        self._actions: dict[tuple[Any, str], _Action] = {}

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
        probe, deadline = self._probe, Deadline(timeout)
        service = f"{full_action(probe.node, name)}{SEND_GOAL}"
        action = self._actions.get((action_type, name))
        if action is None:
            action = self._actions[action_type, name] = _Action(probe, action_type, name)
        if not poll_condition(action.is_ready, deadline.seconds_left, probe.pulse):
            reason = why_no_service(probe.node, service, action_type.Impl.SendGoalService)
            reason = reason.replace(SEND_GOAL, "")
            raise WaitTimeout(
                f"The action {name} was not ready in {timeout:g} s. {reason}", service
            )
        run = GoalRun(probe, name, on_feedback)
        # rclpy registers the request after it has sent it: no answer may come in between.
        with probe.executor.hold_still():
            future = action.send(goal, run)
        run.follow(probe.wait_for_result(future, deadline, f"{name} did not answer to the goal"))
        return run
