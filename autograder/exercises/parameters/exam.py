"""Chapter 6, exercise 1: a heartbeat whose rate is a parameter, and that can be paused."""

from __future__ import annotations

import math

from std_msgs.msg import Int32
from std_srvs.srv import SetBool

from autograder.examination.exam import Exam
from autograder.observe import ObservedNode, Parameter, Service, Topic, one_node

BEATS = Topic("heartbeat", Int32, value=lambda message: message.data)
RATE = Parameter("rate", 1.0)
PAUSE = Service("heartbeat/pause", SetBool)
EXAM: Exam[ObservedNode] = Exam(
    "parameters",
    one_node("Heartbeat", publishes=[BEATS], serves=[PAUSE], parameters=[RATE]),
    read="Chapter 6, “Timers”",
)
PARAMETERS = "Chapter 6, “Parameters”"


@EXAM.check(hints=("Compare it with the table.", "`declare_parameter(…, about)`"), read=PARAMETERS)
def node_starts(node: ObservedNode) -> None:
    """The node starts with its topic, its service, and a parameter that says what it is for.

    An operator who finds a node on a robot's graph has nothing but these to understand it by.
    """
    node.require_endpoints()
    node.require(RATE, 1.0)
    node.require_described(RATE)


@EXAM.check(needs=("node_starts",), hints=("Who tells it the time?", "`self.create_timer(1.0, …)`"))
def beats_count(node: ObservedNode) -> None:
    """One beat a second comes, and counts from 1 on without a gap.

    A supervisor that hears beat 7 after beat 5 knows that it has lost one.
    """
    span = node.advance(5.0)
    span.require_rate(BEATS, hz=1.0)
    span.require_count(BEATS, first=1)


@EXAM.check(
    builds_on=("beats_count",),
    hints=("When is it told?", "`add_post_set_parameters_callback`"),
)
def period_follows(node: ObservedNode) -> None:
    """A new rate holds within one old period, and no beat is lost or added on the way.

    An operator who slows a robot down does not want to restart it first.
    """
    node.advance(2.0)
    fast = float(node.draws.whole("a fast rate", 4, 3, 5))
    for rate, before in ((fast, 1.0), (0.5, fast)):
        node.set(RATE, rate).require_accepted()
        change = node.advance(1.0 / before, f"While the rate changes to {rate:g}")
        change.require_at_most(BEATS, math.ceil(rate / before) + 1)
        span = node.advance(10.0, f"At a rate of {rate:g}")
        span.require_rate(BEATS, hz=rate)
        span.require_count(BEATS)


@EXAM.check(
    needs=("node_starts",),
    hints=("What of a rate of 0, and of 10?", "`add_on_set_parameters_callback` may say no."),
    read=PARAMETERS,
)
def rate_is_bounded(node: ObservedNode) -> None:
    """A rate from 0.1 to 10 is accepted; all else is refused with a reason, and the old one stays.

    A typing mistake must not make the heart of a robot race, or stop it.
    """
    for good in (0.1, 10.0, node.draws.number("a rate", 2.5, 1.5, 9.5)):
        node.set(RATE, good).require_accepted()
        for bad in (0.0, -1.0, 0.09, 10.5, math.inf, math.nan, "fast"):
            node.set(RATE, bad).require_refused()


@EXAM.check(builds_on=("beats_count",), hints=("`timer.cancel()`", "and then `timer.reset()`"))
def pauses_and_resumes(node: ObservedNode) -> None:
    """The service pauses the beats, also twice, and resumes them where the count was.

    Maintenance needs silence; the supervisor must not take it for a restart.
    """
    last = node.advance(2.0).last_value(BEATS)
    for _ in range(2):
        node.require_success(PAUSE, data=True)
        node.advance(3.0, "While it is paused").require_silence(BEATS)
    node.require_success(PAUSE, data=False)
    span = node.advance(5.0, "After it was resumed")
    span.require_rate(BEATS, hz=1.0)
    span.require_count(BEATS, first=last + 1)


@EXAM.check(builds_on=("pauses_and_resumes", "period_follows"), hints=("Is a new timer paused?",))
def stays_paused(node: ObservedNode) -> None:
    """A change of the rate does not end a pause; it holds from the resume on.

    Two operators may turn the same robot's knobs.
    """
    node.require_success(PAUSE, data=True)
    node.set(RATE, 2.0).require_accepted()
    node.advance(3.0, "While it is paused and its rate was changed").require_silence(BEATS)
    node.require_success(PAUSE, data=False)
    node.advance(5.0, "After it was resumed").require_rate(BEATS, hz=2.0)


@EXAM.check(needs=("node_starts",), builds_on=("beats_count",), hints=("What of it still runs?",))
def ends_with_its_node(node: ObservedNode) -> None:
    """After `destroy_node` nothing of it is left, and nothing more comes.

    A heart that beats on after its node tells the supervisor that all is well.
    """
    node.destroy()
    node.require_gone()
    node.advance(3.0, "After `destroy_node`").require_silence(BEATS)
