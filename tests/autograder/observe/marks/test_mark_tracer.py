"""How many marks are enough, and when a goal counts as turned away: mostly without DDS."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest
from geometry_msgs.msg import PoseArray, Twist
from rclpy.duration import Duration
from rclpy.qos import LivelinessPolicy, QoSProfile
from sensor_msgs.msg import Image, LaserScan
from test_msgs.action import NestedMessage

from autograder.examination.exam import Failed
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.graph.graph_reader import read_graph
from autograder.observe.graph.ros_graph import End, RosGraph
from autograder.observe.marks import mark_tracer, marked_publishers
from autograder.observe.marks.mark_trace import Trace
from autograder.observe.marks.mark_tracer import MarkTracer
from autograder.observe.marks.marked_goals import MarkedGoals
from autograder.observe.marks.marked_publishers import fitting_qos
from course import Design, Session
from course.design import message_tags
from course.errors import WaitTimeout
from course.runtime.requests.actions import GoalState

MOTORS = "/motors/command"


class FakeRun:
    """A goal: whether it was taken, is over, and says yes when it is cancelled."""

    def __init__(self, accepted: bool, done: bool, yields: bool) -> None:
        self.accepted, self.done, self._yields = accepted, done, yields
        self.status = GoalState.ABORTED if done else GoalState.EXECUTING

    def done_within(self, _: float) -> bool:
        return self.done

    def cancel(self, _: float) -> bool:
        self.done = self.done or self._yields
        return self._yields


class FakeServer:
    """A session in which nothing takes time, and an action server that does as it is told."""

    def __init__(self, *, accepts: Callable[[int], bool], ends: bool, yields: bool) -> None:
        self.marks: list[int] = []
        self._accepts, self._ends, self._yields = accepts, ends, yields
        self.on_mark: Callable[[int], object] = lambda mark: None

    def send_goal(self, _type: Any, _name: str, goal: Any, timeout: float) -> FakeRun:
        assert timeout
        accepted = self._accepts(len(self.marks))
        self.marks.append(cast("int", message_tags.read_tag(goal)))
        if accepted:
            self.on_mark(self.marks[-1])
        return FakeRun(accepted, self._ends, self._yields)

    def until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        if not condition():
            raise WaitTimeout(f"Waited {timeout} s for {what}.")


def bench_of(session: Any) -> Any:
    return SimpleNamespace(
        session=session,
        subject=SimpleNamespace(errors=list),
        outside=None,
        note_step=lambda step: None,
    )


def trace_goals(
    *, accepts: Callable[[int], bool] = lambda _: True, ends: bool = True, yields: bool = True,
    arrives: Callable[[int], bool] = lambda _: True,
) -> tuple[Trace, MarkedGoals]:  # fmt: skip
    server = FakeServer(accepts=accepts, ends=ends, yields=yields)
    tracer = MarkTracer(bench_of(server), cast("Any", None), RosGraph())
    server.on_mark = lambda mark: tracer.seen[
        MOTORS if arrives(len(server.marks)) else "/velocity"
    ].add(mark)
    goals = MarkedGoals(cast("Any", server), "/navigate_to", NestedMessage)
    return tracer.trace_goals(goals, [MOTORS]), goals


def test_two_marks_are_enough_and_one_goal_more_is_sent() -> None:
    trace, goals = trace_goals()
    assert trace.is_enough
    assert len(trace.arrived) == 2
    assert (goals.sent, goals.turned_away) == (3, 0)


def test_one_mark_is_enough_of_a_goal_that_goes_on() -> None:
    trace, goals = trace_goals(accepts=lambda number: number == 0, ends=False, yields=False)
    assert trace.is_enough
    assert len(trace.arrived) == 1
    assert not goals.turned_away


def test_one_mark_is_not_enough_of_goals_that_end() -> None:
    trace, goals = trace_goals(arrives=lambda number: number == 1)
    assert not trace.is_enough
    assert goals.sent == len(mark_tracer.GOALS_S)
    assert trace.finding("a goal").actual.startswith(
        "Of 8 marks 1 was seen on /motors/command; the others were seen on /velocity, but never "
        "there"
    )
    assert goals.remark.startswith("; 8 goals ended as aborted")


def test_a_server_that_takes_no_second_goal_turns_it_away() -> None:
    trace, goals = trace_goals(accepts=lambda number: number == 0)
    assert not trace.is_enough
    assert goals.turned_away == goals.sent - 1
    with pytest.raises(Failed, match="after that was over it rejected 7 others"):
        goals.require_next_taken()


def test_a_server_that_never_took_a_goal_turns_none_away() -> None:
    trace, goals = trace_goals(accepts=lambda _: False)
    assert not trace.sent
    assert not goals.turned_away
    assert goals.remark == "; the server of /navigate_to rejected each of 8 goals"


def test_a_publisher_offers_what_each_subscription_asks_for() -> None:
    asked = [
        QoSProfile(depth=1, deadline=Duration(seconds=seconds), liveliness=liveliness)
        for seconds, liveliness in (
            (0, LivelinessPolicy.AUTOMATIC),
            (2, LivelinessPolicy.MANUAL_BY_TOPIC),
            (1, LivelinessPolicy.AUTOMATIC),
        )
    ]
    offered = fitting_qos([End("/reader", "", qos) for qos in asked])
    assert offered.deadline == Duration(seconds=1)
    assert offered.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC
    assert offered.liveliness_lease_duration == Duration()


def test_what_is_periodic_waits_for_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(marked_publishers.time, "monotonic", lambda: now[0])
    acts: list[float] = []
    act = marked_publishers.Periodic(1.0, lambda: acts.append(now[0]))
    for now[0] in (0.5, 1.0, 1.5, 2.0):
        act()
    act.put_off()
    for now[0] in (2.5, 3.0):
        act()
    assert acts == [1.0, 2.0, 3.0]


def test_a_mark_is_followed_through_real_nodes() -> None:
    with Session() as subject, Session(domain_id=subject.domain_id) as examiner:
        design = Design()
        design.node("detector").subscribes("scan", LaserScan).publishes("obstacles", PoseArray)
        design.node("controller").subscribes("obstacles", PoseArray).publishes("motors", Twist)
        design.node("camera").publishes("image", Image)
        design.run(subject)
        node = examiner.run(QuietNode, "examiner")
        examiner.until(lambda: len(read_graph(node).topics) == 4, timeout=20)
        graph = read_graph(node)
        tracer = MarkTracer(bench_of(examiner), node, graph)
        trace = tracer.trace_messages([graph.topic("/scan")], ["/motors"])
        assert trace.is_enough
        assert tracer.seen_on(["/obstacles"], trace.arrived) == trace.arrived
        assert not tracer.seen_on(["/image"], trace.arrived)
