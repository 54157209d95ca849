"""One action, live: every goal's way through its states, feedback, result, and a cancel button."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from course.errors import CourseError
from course.messages.yaml_text import format_count, one_line
from course.runtime.core_session import CoreSession
from course.views.shared import truncate
from course.views.shared.live_view import Frame, LiveView
from course.watch import forms
from course.watch.goals import Goal, GoalBoard

MAX_BYTES = 700
"""Bytes of a goal, its feedback and its result that are shown of each."""


class ActionView(LiveView):
    """Shows all goals of an action, from any client, and sends and cancels goals itself."""

    label = "Action view"
    script = "action"
    shared = ("forms",)

    def __init__(self, session: CoreSession, action_type: Any, name: str) -> None:
        """Watch the action ``name``."""
        super().__init__(session, name)
        self._board = GoalBoard(session, action_type, name)
        self.resources.callback(self._board.stop)
        self._problem = ""

    @property
    def goals(self) -> list[Goal]:
        """The latest goals, oldest first."""
        return self._board.latest_goals

    def send(self, **typed: Any) -> None:
        """Send a goal with values by field, as the form does.

        Raises:
            MisfitError: a value that does not fit its field.
        """
        self._board.send({path.replace("__", "."): value for path, value in typed.items()})

    def cancel(self, number: int) -> None:
        """Ask the server to cancel a goal.

        Raises:
            WaitTimeout: the server does not answer.
        """
        self._board.cancel(number)

    def handle_control(self, message: dict[str, Any]) -> None:
        """Send or cancel a goal."""
        try:
            if isinstance(message.get("goal"), dict):
                self._board.send(message["goal"])
            elif isinstance(message.get("cancel"), int):
                self._board.cancel(message["cancel"])
            self._problem = ""
        except CourseError as error:
            self._problem = str(error)

    def make_frame(self) -> Frame:
        """Return the form and the goals."""
        return {
            "title": f"Action {self._board.name}",
            "fields": [asdict(field) for field in forms.form_fields(self._board.action_type.Goal)],
            "problem": self._problem,
            "goals": [_goal_data(goal) for goal in self.goals],
        }

    def words(self) -> str:
        """Return the goals as text."""
        lines = [f"Action {self._board.name}, {format_count(len(self.goals), 'goal')}"]
        for goal in self.goals:
            shown = _goal_data(goal)
            states = " -> ".join(f"{name} ({when})" for name, when in shown["states"])
            told = (*shown["text"], _describe_progress(goal), shown["outcome"])
            parts = (f"goal {goal.number}: {states}", *told)
            lines.append("  " + "; ".join(part for part in parts if part))
        return "\n".join([*lines, *([self._problem] if self._problem else [])])


def _goal_data(goal: Goal) -> dict[str, Any]:
    text = [f"asked: {_shorten_line(goal.asked)}"] if goal.asked is not None else []
    text += [f"feedback {goal.feedback}: {_shorten_line(goal.latest)}"] if goal.feedback else []
    result = f"result: {_shorten_line(goal.result)}" if goal.result is not None else ""
    return {
        "number": goal.number,
        "states": [[state.name, f"{when:.1f} s"] for state, when in goal.states],
        "text": text,
        "way": {"text": _describe_progress(goal), "points": _progress_points(goal)}
        if goal.way
        else None,
        "outcome": goal.problem or result or goal.note,
        "bad": bool(goal.problem or (goal.note and not goal.is_over)),
        "over": goal.is_over,
    }


def _describe_progress(goal: Goal) -> str:
    """Return how far a goal has come, in words."""
    if goal.way is None:
        return ""
    name, points = goal.way
    first, last = points[0][1], points[-1][1]
    return f"{name}: {first:g} to {last:g}" if len(points) > 1 else f"{name}: {last:g}"


def _progress_points(goal: Goal) -> list[list[float]]:
    """Return the same to be drawn: (s since the goal was first seen, number); all finite."""
    points = goal.way[1].copy() if goal.way else ()
    return [[round(when, 2), value] for when, value in points if math.isfinite(value)]


def _shorten_line(data: Any) -> str:
    return one_line(truncate.cut_data(data, MAX_BYTES))
