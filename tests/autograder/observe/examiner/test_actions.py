"""Both ends of an action on real DDS: one that the examiner serves, one that it sends goals to."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from rclpy.action.server import ServerGoalHandle
from test_msgs.action import Fibonacci

from autograder.observe import Action
from autograder.observe.examiner.actions import ActionServerEnd, SentGoal
from autograder.observe.examiner.examiner_end import ExaminerEnd
from course import Session

COUNT = Action("count", Fibonacci)


class Ends:
    """A server that is played, and a client, which see each other."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.server: ActionServerEnd = session.run(lambda: ActionServerEnd(COUNT, lambda: 1.5))
        self.client = session.run(ExaminerEnd).action_client(COUNT)
        session.until(self.client.is_ready)

    def send(self, **plan: bool) -> SentGoal:
        self.server.plan(**plan)
        return self.client.send(order=3)

    def until(self, condition: Callable[[], object]) -> None:
        """Wait, and give each answer that waits for the client to be at rest."""
        self.session.until(lambda: (self.server.release(), condition())[1])


def test_a_goal_is_accepted_and_ends_with_what_came_before() -> None:
    with Session() as session:
        ends = Ends(session)
        goal = ends.send()
        ends.until(lambda: goal.accepted and ends.server.goals)
        ends.server.send_feedback(sequence=[1])
        ends.until(lambda: goal.feedback)
        ends.server.end_goal(ServerGoalHandle.succeed)
        ends.until(lambda: goal.end)
        assert [list(message.sequence) for message in goal.feedback] == [[1]]
        assert (goal.end, ends.server.requested[0].order) == ("succeeded", 3)


def test_an_answer_waits_until_it_is_decided() -> None:
    with Session() as session:
        ends = Ends(session)
        goal = ends.send(accepts=False, holds_goal=True)
        ends.until(lambda: ends.server.requested)
        for _ in range(3):
            ends.server.release()
            assert goal.accepted is None
        ends.server.decide()
        ends.until(lambda: goal.accepted is not None or ends.server.decide())
        assert goal.accepted is False


@pytest.mark.parametrize("cancels", [True, False])
def test_a_request_to_cancel_is_answered_as_planned(cancels: bool) -> None:
    with Session() as session:
        ends = Ends(session)
        goal = ends.send(cancels=cancels)
        ends.until(lambda: goal.accepted and ends.server.goals)
        ends.client.cancel(goal)
        ends.until(lambda: goal.cancel_accepted is not None)
        assert goal.cancel_accepted is cancels
        assert ends.server.cancels_at_s == [1.5]
