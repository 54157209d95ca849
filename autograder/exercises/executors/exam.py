"""Chapter 6, exercise 2: a safety loop that slow work on the same node must not hold up."""

from __future__ import annotations

from std_msgs.msg import Int32, String
from std_srvs.srv import Trigger

from autograder.examination.exam import Exam
from autograder.observe import ObservedNode, Service, Topic, one_node

BEATS = Topic("safety/beat", Int32, value=lambda message: message.data)
INSPECT = Topic("inspect", String)
REPORTS = Topic("report", String, value=lambda message: message.data)
SCANS = Topic("scan", Int32)
RESULTS = Topic("result", Int32, value=lambda message: message.data)
HANDLED = Topic("handled", Int32, value=lambda message: message.data)
INSPECTION = Service("inspection", Trigger)
EXAM: Exam[ObservedNode] = Exam(
    "executors",
    one_node(
        "Guard", publishes=[BEATS, REPORTS, RESULTS, HANDLED], subscribes=[INSPECT, SCANS],
        calls=[INSPECTION], threads=4,
    ),
    read="Chapter 6, “Executors”",
)  # fmt: skip
GROUPS = "Chapter 6, “Callback groups”"
FEW, MANY = 2, 6
"""Pieces of work that come at once: fewer, and more, than the executor has threads."""


@EXAM.check(hints=("Compare your node with the table.",))
def guard_starts(node: ObservedNode) -> None:
    """The node starts with all its topics and its client.

    What is not there when the robot starts is missing when it is needed.
    """
    node.require_endpoints()


@EXAM.check(needs=("guard_starts",), hints=("`self.create_timer(0.05, ...)`",))
def loop_beats(node: ObservedNode) -> None:
    """The safety loop beats 20 times a second, and counts.

    Whoever stops the motors when it falls silent must be able to rely on it.
    """
    span = node.advance(3.0)
    span.require_rate(BEATS, hz=20.0)
    span.require_count(BEATS, first=1)


@EXAM.check(needs=("guard_starts",), hints=("Who takes the answer?", "`call_async`, then `await`"))
def inspections_are_reported(node: ObservedNode) -> None:
    """What an inspection answers is reported.

    An inspection that nobody hears of is none.
    """
    node.answer_after(INSPECTION, 0.5, success=True, message="bumper is fine")
    node.send(INSPECT, String(data="bumper"))
    node.advance(1.5).require_values(REPORTS, ["bumper is fine"])


@EXAM.check(needs=("guard_starts",), hints=("`analyse(self, scan)`",), read=GROUPS)
def scans_are_analysed(node: ObservedNode) -> None:
    """Every scan is analysed, and its result published.

    The wall that was in the scan that got lost is the one that is hit.
    """
    for scan in range(3):
        node.send(SCANS, Int32(data=scan))
    node.advance(3.0).require_values(RESULTS, [0, 2, 4], ordered=False)


@EXAM.check(
    builds_on=("loop_beats", "inspections_are_reported"),
    hints=("How many threads wait for an answer?", "A callback that waits for one holds a thread."),
)
def slow_service_holds_nothing_up(node: ObservedNode) -> None:
    """While six inspections take three seconds, the loop beats on, and all are reported.

    A service of somebody else's may be slow for any reason.
    """
    node.answer_after(INSPECTION, 3.0, success=True, message="fine")
    for number in range(MANY):
        node.send(INSPECT, String(data=f"part {number}"))
    node.advance(2.5, "While inspections wait", once=True).require_rate(BEATS, hz=20.0)
    node.advance(3.0, "After all answers").require_values(REPORTS, ["fine"] * MANY)


@EXAM.check(
    needs=("scans_are_analysed",),
    builds_on=("loop_beats",),
    hints=("In which group is each callback?", "The timer needs a group of its own."),
    read=GROUPS,
)
def slow_callback_holds_nothing_up(node: ObservedNode) -> None:
    """While six scans are analysed, half a second each, the loop beats on.

    A heavy computation is no reason to let go of the brakes.
    """
    for scan in range(MANY):
        node.send(SCANS, Int32(data=scan))
    node.advance(2.5, "While scans are analysed", once=True).require_rate(BEATS, hz=20.0)


@EXAM.check(
    builds_on=("inspections_are_reported", "scans_are_analysed"),
    hints=("What if another callback writes between your reading and your writing?",),
    read=GROUPS,
)
def nothing_is_lost(node: ObservedNode) -> None:
    """Of inspections and scans that come together, each is counted once.

    Two callbacks that read 7 and both write 8 have lost one.
    """
    node.answer_after(INSPECTION, 0.4, success=True, message="fine")
    for number in range(FEW):
        node.send(SCANS, Int32(data=number))
        node.send(INSPECT, String(data=f"part {number}"))
    node.advance(8.0).require_values(HANDLED, range(1, 2 * FEW + 1), ordered=False)
