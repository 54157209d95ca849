"""All goals of one action, from any client: their states, feedback, and results."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from rclpy.qos import QoSProfile, qos_profile_action_status_default
from unique_identifier_msgs.msg import UUID  # type: ignore[import-untyped]

from course.errors import CourseError
from course.messages import values
from course.runtime.core_session import CoreSession
from course.runtime.requests.actions import GoalState
from course.watch import forms, goal_progress

KEPT_GOALS = 40
"""Goals that are kept with all that is known of them: those that run before those that are over."""

POINTS = 100
"""Of how many of its latest feedback messages a goal keeps how far it had come."""

ANSWER_TIMEOUT_S = 10.0
"""Seconds within which a server gives the result of a goal that is over, unless it is busy."""

TRIES = 3
"""How often it is asked: its only thread may be working on the next goal."""

OVER = (GoalState.SUCCEEDED, GoalState.CANCELED, GoalState.ABORTED)


@dataclass
class Goal:
    """One goal: the states that it went through with their times (s since it was first seen).

    ``way`` is how far it had come, as `goal_progress.measure_progress` tells: the number's name,
    and (s since the goal was first seen, number) of the latest feedback messages. ``problem`` says
    why it never began; ``note`` what else there is to say about it.
    """

    number: int
    states: list[tuple[GoalState, float]] = field(default_factory=list)
    feedback: int = 0
    latest: dict[str, Any] = field(default_factory=dict)
    way: tuple[str, deque[tuple[float, float]]] | None = None
    result: dict[str, Any] | None = None
    asked: dict[str, Any] | None = None
    problem: str = ""
    note: str = ""
    seen: float = 0.0

    @property
    def state(self) -> GoalState:
        """The latest state."""
        return self.states[-1][0] if self.states else GoalState.UNKNOWN

    @property
    def is_over(self) -> bool:
        """Whether it has ended."""
        return self.state in OVER or bool(self.problem)


class GoalBoard:
    """Watches the status and feedback of one action, sends goals of its own, and cancels any."""

    def __init__(self, session: CoreSession, action_type: Any, name: str) -> None:
        """Watch the action ``name`` of ``session``'s graph."""
        self.name = name
        self.action_type = action_type
        self._session = session
        self._goals: dict[bytes, Goal] = {}
        self._let_go: set[bytes] = set()  # of what the server still lists
        self._stopped = False
        self._rejected: list[Goal] = []
        self._count = 0
        self._lock = threading.Lock()
        self._asker = ThreadPoolExecutor(1, "ROS goal results")
        self._subscriptions = [
            session.watch(
                GoalStatusArray, f"{name}/_action/status", self._on_status,
                qos_profile_action_status_default,
            ),
            session.watch(
                action_type.Impl.FeedbackMessage, f"{name}/_action/feedback", self._on_feedback,
                QoSProfile(depth=100),
            ),
        ]  # fmt: skip

    def stop(self) -> None:
        """Watch no more. Idempotent."""
        with self._lock:
            self._stopped = True
            self._asker.shutdown(wait=False, cancel_futures=True)
        for subscription in self._subscriptions:
            self._session.unwatch(subscription)

    @property
    def latest_goals(self) -> list[Goal]:
        """The latest goals, oldest first (a snapshot)."""
        with self._lock:
            both = [*self._goals.values(), *self._rejected]
            return sorted(both, key=lambda goal: goal.number)[-KEPT_GOALS:]

    def send(self, typed: Mapping[str, Any], timeout: float = 5.0) -> None:
        """Send a goal made of what was typed into the form; its answer is awaited in a thread.

        Raises:
            MisfitError: something does not fit its field.
        """
        goal = forms.build_message(self.action_type.Goal, typed)
        threading.Thread(
            target=self._follow_goal, args=(goal, timeout), name="ROS goal", daemon=True
        ).start()

    def cancel(self, number: int, timeout: float = 5.0) -> None:
        """Ask the server to cancel a goal, no matter which client sent it.

        Raises:
            WaitTimeout: the server does not answer.
        """
        with self._lock:
            wanted = [(key, goal) for key, goal in self._goals.items() if goal.number == number]
        for key, goal in wanted:
            request = CancelGoal.Request()
            request.goal_info.goal_id = UUID(uuid=list(key))
            response = self._session.call(
                CancelGoal, f"{self.name}/_action/cancel_goal", request, timeout
            )
            agreed = any(bytes(info.goal_id.uuid) == key for info in response.goals_canceling)
            goal.note = "" if agreed or goal.is_over else "The server refused to cancel."

    def _follow_goal(self, goal: Any, timeout: float) -> None:
        asked = values.to_data(goal)
        try:
            run = self._session.send_goal(self.action_type, self.name, goal, timeout=timeout)
        except CourseError as error:
            self._add_rejected(asked, str(error))
            return
        except Exception as error:  # noqa: BLE001 - the session may end under it
            self._add_rejected(asked, f"{type(error).__name__}: {error}")
            return
        if not run.accepted:
            self._add_rejected(asked, "The server rejected this goal.")
            return
        with self._lock:
            kept = self._get_goal(run.goal_id)
            if kept is not None:
                kept.asked = asked

    def _request_result(self, key: bytes, goal: Goal, tries: int = TRIES) -> None:
        """Have the result of a goal that is over fetched; called with the lock held."""
        if not self._stopped:
            self._asker.submit(self._fetch_result, key, goal, tries)

    def _fetch_result(self, key: bytes, goal: Goal, tries: int) -> None:
        service = self.action_type.Impl.GetResultService
        request = service.Request(goal_id=UUID(uuid=list(key)))
        try:
            response = self._session.call(
                service, f"{self.name}/_action/get_result", request, ANSWER_TIMEOUT_S
            )
        except Exception:  # noqa: BLE001 - whatever it is, there is no result yet
            goal.note = "Its server has not given its result yet."
            with self._lock:
                if tries > 1 and key in self._goals:
                    self._request_result(key, goal, tries - 1)
            return
        goal.note = ""
        if response.status in OVER:
            goal.result = values.to_data(response.result)
        else:
            goal.note = "Its server has not kept the result."

    def _add_rejected(self, asked: dict[str, Any], problem: str) -> None:
        with self._lock:
            self._count += 1
            self._rejected.append(Goal(self._count, asked=asked, problem=problem))
            del self._rejected[:-KEPT_GOALS]

    def _get_goal(self, key: bytes) -> Goal | None:
        """Return the goal of an id, None if it was let go of; called with the lock held."""
        if key in self._let_go:
            return None
        if key not in self._goals:
            self._count += 1
            self._goals[key] = Goal(self._count, seen=time.monotonic())
        return self._goals[key]

    def _on_status(self, message: Any) -> None:
        now = time.monotonic()
        listed = {bytes(status.goal_info.goal_id.uuid): status for status in message.status_list}
        with self._lock:
            for key, status in listed.items():
                goal = self._get_goal(key)
                if goal is None:
                    continue
                state = GoalState(status.status)
                if goal.state != state:
                    goal.states.append((state, max(0.0, now - goal.seen)))
                    if goal.is_over:
                        goal.note = ""
                        self._request_result(key, goal)
            # A server lists goals for minutes after their end: these are not new ones.
            self._let_go &= listed.keys()
            oldest = sorted(self._goals, key=lambda key: not self._goals[key].is_over)
            for key in oldest[: max(0, len(oldest) - KEPT_GOALS)]:
                del self._goals[key]
                self._let_go |= {key} & listed.keys()

    def _on_feedback(self, message: Any) -> None:
        with self._lock:
            goal = self._get_goal(bytes(message.goal_id.uuid))
            if goal is not None:
                goal.feedback += 1
                goal.latest = values.to_data(message.feedback)
                if (found := goal_progress.measure_progress(message.feedback)) is not None:
                    if goal.way is None or goal.way[0] != found.name:
                        goal.way = found.name, deque(maxlen=POINTS)
                    goal.way[1].append((time.monotonic() - goal.seen, found.value))
