"""Exercise 5: four nodes that notice each failure, report it, and leave the robot standing.

The examiner plays the other end of each service and action, on simulated time, and makes it fail.
Every bound below is a sentence of the task, with the 0.2 s that the task allows and the examiner's
own stride added to it.
"""

from __future__ import annotations

import itertools
import math
import time
from contextlib import suppress

from rclpy.action.server import ServerGoalHandle
from std_msgs.msg import Bool

from autograder.examination.exam import Exam, Failed
from autograder.exercises.safety import (
    drive_server,
    gripper_client,
    navigator_client,
    program_trials,
    shutdown,
    speed_limits,
)
from autograder.exercises.safety.drive_server import DRIVE_SERVER, SLACK_S, TOLERANCE_S
from autograder.exercises.safety.gripper_client import GRIPPER, GRIPPER_CLIENT, ExaminedGrip
from autograder.exercises.safety.navigator_client import NAVIGATION_CLIENT, ExaminedJourney
from autograder.exercises.safety.speed_limits import SPEED_SERVER, require_refused, require_set
from autograder.observe.examiner.actions import ActionServerEnd
from autograder.observe.examiner.services import ServiceServer
from autograder.observe.phrases import say_words
from autograder.observe.several_nodes.clock_bound_node import WallWait
from autograder.observe.several_nodes.multi_node_rig import Nodes, several_nodes

READ_SERVICES = "Chapter 5, “Services: synchronous request-response”: “Error handling”"
EXAM: Exam[Nodes] = Exam("safety", several_nodes(program_trials.TRIALS), read=READ_SERVICES)

COARSE_S = 0.5  # between two looks where it does not matter when exactly something happens
SLOW_S, LATE_S = 0.7, 1.3  # after a try: in time, or late, whatever the tolerance
APART_S = 0.5  # between requests; the second's answer takes so long that the first's 1 s is over
BACK_S = 1.8  # after a request in which the gripper comes back: a third try is still to come
LATER_S = 1.5  # in which a request that was refused might be made up for
METRES, FAR = (
    ("metres", 3, 2, 7),
    ("metres of a long drive", 40, 20, 90),
)  # and bounds
IN_A_ROW = (
    " That was at the second request in a row that got no answer; at the first all was right."
)
GRIP_LEFT = (
    f" The try for the request before, {APART_S:g} s earlier, had been answered at once: is its "
    "time-out called off then?"
)
GOAL_LEFT = (
    f" The goal before was sent {APART_S:g} s before this one, and answered at once: is its "
    "time-out called off?"
)

_READ_ACTIONS = "Chapter 5, “Actions: long-running operations with feedback”"
READ_GOALS = f"{_READ_ACTIONS}: “Goal, feedback, result”"
READ_CANCELS = f"{_READ_ACTIONS}: “Cancellation”"
READ_STATUS = f"{_READ_ACTIONS}: “Goal status”"
READ_ASYNC = "ROS 2 documentation, “Synchronous vs. asynchronous service clients”"
READ_GROUPS = "ROS 2 documentation, “Using callback groups”"


@EXAM.check(
    hints=(
        "Follow one request through your node: from grip/request to the service and to the word.",
        "`call_async` gives a future. Publish the outcome when it is done, not before.",
        "`future = self.gripper.call_async(SetBool.Request(data=request.data))`, "
        "`timer = once(self, 1.0, future.cancel)`, `answer = await future`: None is no answer.",
    ),
)
def gripper_answers(nodes: Nodes) -> None:
    """The gripper client reports a grip that the gripper carried out, also after 0.7 s.

    The rest of the robot waits for this word: the arm lifts only what is held.
    """
    node, draws = nodes.node(GRIPPER_CLIENT), nodes.draws
    with node.served_by(ServiceServer, GRIPPER) as gripper:
        close = draws.flag("the grip that is carried out")
        gripper_client.carry_out(node, gripper, close, 0.0)
        gripper_client.carry_out(node, gripper, not close, SLOW_S).require_once()
    nodes.require_times(program_trials.SLOW)


@EXAM.check(
    builds_on=("gripper_answers",),
    hints=(
        "Any try may be refused: what does your node publish then, and what does it not do?",
        "A refusal is an answer: leave the loop of tries, and command the arm to hold.",
        "On `success=False`: publish on arm/hold, then `refused` on grip/outcome, and return.",
    ),
)
def gripper_refuses(nodes: Nodes) -> None:
    """A grip that the gripper refuses is reported at once, and the arm holds still.

    The gripper has its reason, such as fingers in between: asking again is no way to overrule it.
    """
    node, draws = nodes.node(GRIPPER_CLIENT), nodes.draws
    with node.served_by(ServiceServer, GRIPPER) as gripper:
        for grip in range(draws.whole("grips before a refusal", 0, 0, 2)):
            gripper_client.carry_out(
                node, gripper, draws.flag(f"grip {grip} before a refusal"), 0.0
            )
        close = draws.flag("the grip that is refused")
        ExaminedGrip(node, gripper, close).refuse("When the gripper answered success=False")
        again = ExaminedGrip(node, gripper, not close)
        with suppress(WallWait):  # how it waits is another check's
            node.advance_until(again.has_gone_on, gripper_client.LONGEST_S, stride_s=COARSE_S)
        if len(again.tries) > 1:
            again.refuse(
                "When the gripper answered not the first try, but the second with success=False"
            )
        nodes.require_no_errors("refused")
    if len(again.tries) < 2:  # that is another check's
        nodes.discard_session()


@EXAM.check(
    builds_on=("gripper_answers",),
    hints=(
        "Write down, second by second, what your node does when nobody answers: each try, each "
        "pause, the arm, the word. And what of it is still under way at the next request?",
        "Loop over the pauses, such as 0.5 s and 1.0 s, on the node's clock; then give up.",
        "For each pause: `await sleep(self, pause)`, then a try of 1 s. After the third without an "
        "answer: publish on arm/hold, then `failed`.",
    ),
)
def gripper_retries(nodes: Nodes) -> None:
    """Without answers there are three tries with growing pauses, then a safe end.

    A hiccup is worth a second try. A client that tries for ever never tells anybody that the
    gripper is dead, and one that tries without pauses keeps it from recovering.
    """
    node = nodes.node(GRIPPER_CLIENT)
    with node.served_by(ServiceServer, GRIPPER) as gripper:
        close = nodes.draws.flag("the grip without an answer")
        grip = gripper_client.give_up(node, gripper, close, stands_still=True)
        grip.tries[2].answer(success=True)
        grip.require_once(f"{gripper_client.GIVEN_UP}, and a late answer to the third")
        try:
            gripper_client.give_up(node, gripper, not close)
        except Failed as failed:
            raise Failed(
                expected=failed.expected, actual=failed.actual + IN_A_ROW, picture=failed.picture
            ) from None
        gripper_client.carry_out(node, gripper, True, 0.0)
        node.advance(APART_S)
        gripper_client.carry_out(node, gripper, False, SLOW_S, aside=GRIP_LEFT)
        nodes.require_no_errors("unanswered")
    nodes.require_times(program_trials.PAUSE)


@EXAM.check(
    hints=(
        "Send yourself a request: `course.call(SetParametersAtomically, 'speed/set', ...)`.",
        "A good request goes to `Wheels.set_limits` with both limits, and sets `successful`.",
        "Keep the limits in a dictionary; the one that is not named keeps its value.",
    ),
)
def speed_serves(nodes: Nodes) -> None:
    """A good request sets the speed limits and says so.

    In a crowded ward operators slow the robot down, and have to know that it listened.
    """
    node, draw = nodes.node(SPEED_SERVER), nodes.draws.number
    first = draw("the first angular limit", 0.8, 1.05, 1.9)
    both = draw("a linear limit", 0.33, 0.26, 0.45), draw("an angular limit", 0.66, 0.3, 1.2)
    again = draw("the next linear limit", 0.21, 0.11, 0.25), draw("the next", 1.3, 1.25, 1.8)
    require_set(node, "At first", (0.5, first), angular=first)
    require_set(node, "Then", both, linear=both[0], angular=both[1])
    require_set(node, "Then", (both[0], 2.0), angular=2.0)
    # Of a request that names both, each has to be kept: only one might be.
    require_set(node, "Then", again, linear=again[0], angular=again[1])
    require_set(node, "Then", (0.0, again[1]), linear=0.0)
    require_set(node, "Then", (0.0, 2.0), angular=2.0)
    require_set(node, "Then", (1.0, 2.0), linear=1.0)
    when = "When linear and angular have these values already,"
    require_set(node, when, (1.0, 2.0), linear=1.0, angular=2.0)


@EXAM.check(
    builds_on=("speed_serves",),
    hints=(
        "Take the request that is named above: which line of yours meets it first, and what has "
        "been changed by then?",
        "Comparisons with NaN are all false, so test for what is right, not for what is wrong.",
        "`if not 0.0 <= value <= highest:` refuses NaN too; answer with `reason`, set nothing.",
    ),
)
def speed_refuses(nodes: Nodes) -> None:
    """Each bad request is answered with a reason, and changes nothing.

    NaN compares false with every limit: a check that forgets it lets the robot drive at any speed.
    And an exception in the callback answers nobody.
    """
    node, draws = nodes.node(SPEED_SERVER), nodes.draws
    linear = draws.number("a linear limit after nonsense", 0.4, 0.05, 0.95)
    angular = draws.number("an angular limit after nonsense", 0.8, 0.05, 1.95)
    requests = [*enumerate(speed_limits.bad_requests(draws))]
    last, _ = (order := draws.shuffled("nonsense", requests))[-1]
    for number, parameters in order:
        require_refused(node, parameters)
        if number == last or draws.flag(f"something good after {number}", usual=False):
            require_set(node, "After nonsense", (linear, angular), linear=linear, angular=angular)
    nodes.require_no_errors("bad")


@EXAM.check(
    hints=(
        "Follow the goal that is named above: was it accepted, how did it end, and what did your "
        "node do then, and once?",
        "`goal_handle.accepted` answers the first, `response.status` of the result the second.",
        "Only STATUS_SUCCEEDED is `arrived`. With any other word publish `Twist()` on cmd_vel.",
    ),
    read=READ_STATUS,
)
def goals_end(nodes: Nodes) -> None:
    """Arrived, rejected, aborted: each end of a goal is told apart, and failures stop the robot.

    A result arrives for an aborted goal too. Whoever takes every result for success unloads the
    parcel in the corridor.
    """
    node, draws = nodes.node(NAVIGATION_CLIENT), nodes.draws
    metres, far = draws.whole(*METRES), draws.whole(*FAR)
    ends = (
        ("When the goal succeeded", metres, ServerGoalHandle.succeed, "arrived"),
        ("When the navigator rejected the goal", far, None, "rejected"),
        ("When the navigator aborted the goal", metres - 1, ServerGoalHandle.abort, "aborted"),
    )
    with node.served_by(ActionServerEnd, navigator_client.NAVIGATE) as navigator:
        for when, length, end, word in draws.shuffled("ends of goals", ends):
            accepts = end is not None
            goal = ExaminedJourney(node, navigator, length, accepts=accepts, holds_goal=not accepts)
            if accepts:
                goal.send_feedback(1)
            goal.forget_stop()  # what came by now is no answer to what comes next
            navigator.decide()
            if end is not None:
                navigator.end_goal(end)
            goal.require_end(when, word)
        nodes.require_no_errors("ended")


@EXAM.check(
    builds_on=("goals_end",),
    hints=(
        "What tells a slow navigator from one that hangs, and what is to be done about each?",
        "Feedback is the sign of life: start a timer of 2 s at acceptance, and again with each.",
        "When it fires: `cancel_goal_async()`, a zero Twist, then `stalled`. Cancel it at the end.",
    ),
    read=READ_CANCELS,
)
def goals_stall(nodes: Nodes) -> None:
    """A drive without feedback for 2 s is canceled, a long one with feedback is not.

    A limit on the whole drive is too short for a long corridor and too long for a hung navigator.
    """
    node = nodes.node(NAVIGATION_CLIENT)
    with node.served_by(ActionServerEnd, navigator_client.NAVIGATE) as navigator:
        goal = ExaminedJourney(node, navigator, navigator_client.BREATHS[-1] + 1)
        goal.breathe()
        navigator.end_goal(ServerGoalHandle.succeed)
        goal.require_outcome("When a slow drive succeeded", "arrived")
        goal = ExaminedJourney(node, navigator, nodes.draws.whole(*METRES))
        node.advance(1.0)
        goal.send_feedback(1)
        goal.require_cancel("the last feedback")
        when = "When feedback ceased for 2 s, and the cancel was accepted"
        goal.require_outcome(when, "stalled")
        navigator.end_goal(ServerGoalHandle.canceled)
        goal.require_once(when, "stalled")
        nodes.require_no_errors("stalled")
    nodes.require_times(program_trials.STALL)


@EXAM.check(
    hints=(
        "Send a goal of your own: `course.send_goal(Drive, 'drive', Drive.Goal(order=2))`.",
        "The goal callback decides about the order: in `execute` it is too late to reject one. A "
        "good goal is driven, told of and stopped there.",
        "For each metre a few times: command the wheels, `await sleep`, 1 s in all. Then feedback; "
        "at the end succeed, and stop.",
    ),
    read=READ_GOALS,
)
def drive_arrives(nodes: Nodes) -> None:
    """A valid goal is driven with feedback and ends in a stop, an invalid one is rejected.

    The wheels keep doing what they were told last: a drive that ends without a stop does not end.
    """
    node, draws = nodes.node(DRIVE_SERVER), nodes.draws
    metres = draws.whole("metres of the drive", 4, 3, 5)
    behind = draws.whole("a goal behind", -2, -9, -1)
    far = draws.whole("a goal too far away", 11, 11, 99)
    for bad in draws.shuffled("bad goals", (0, behind, far)):
        drive_server.require_rejection(node, bad)
    goal = drive_server.start_drive(node, metres)
    goal.require_end("succeeded", metres + SLACK_S, TOLERANCE_S)
    took_s = node.now_s - goal.sent.sent_at_s
    node.require_that(
        took_s >= metres - SLACK_S,
        f"{goal.what} takes {metres} s, at 1 m/s.",
        f"It was over after {took_s:.1f} s.",
    )
    drive_server.require_marks(node, goal.sent, metres)
    drive_server.require_speed(node)
    drive_server.require_stop(node)
    drive_server.require_one_metre(node, "after a longer one")
    nodes.require_times(program_trials.WHOLE)


@EXAM.check(
    builds_on=("drive_arrives",),
    hints=(
        "Who decides whether a request to cancel is accepted, who has to act on it, and what is "
        "left of the drive for the next goal?",
        "Accept it in the cancel callback, and look at `goal_handle.is_cancel_requested` often.",
        "In the loop: if requested, `goal_handle.canceled()` and return; `finally` stop wheels.",
    ),
    read=READ_CANCELS,
)
def drive_cancels(nodes: Nodes) -> None:
    """A canceled drive ends within 0.5 s, and the robot stands.

    Somebody steps in front of the robot: whoever cancels means now.
    """
    node = nodes.node(DRIVE_SERVER)
    goal = drive_server.start_drive(node, drive_server.LONGEST_M)
    # Who looks for a cancel at each mark only has then most of a metre before the next look.
    node.advance_until(lambda: any(f.sequence for f in goal.sent.feedback), 1.0 + SLACK_S)
    node.advance(0.1)
    drive_server.cancel_drive(node, goal, "A canceled goal")
    goal = drive_server.start_drive(node, 1, "after a canceled one")
    node.advance(0.3)
    drive_server.cancel_drive(node, goal, "A goal that is canceled before the first mark")
    drive_server.require_one_metre(node, "after two canceled ones")
    nodes.require_no_errors("canceled")
    nodes.require_times(program_trials.CANCELED)


@EXAM.check(
    builds_on=("drive_arrives",),
    hints=(
        "Follow a jam: which command meets it, and how soon? Who catches what that raises, and "
        "what is said and done before `execute` ends?",
        "Catch WheelError around the whole loop: say why on drive/fault, then abort the goal.",
        "`except WheelError as error:` publish it, `goal_handle.abort()`; `finally:` stop.",
    ),
    read=READ_STATUS,
)
def drive_aborts(nodes: Nodes) -> None:
    """Jammed wheels abort the drive with a reason, the robot stands, and later goals are served.

    When the jam comes loose, wheels that were not stopped start to turn again.
    """
    node, abort_s = nodes.node(DRIVE_SERVER), drive_server.ABORT_S
    goal = drive_server.start_drive(node, drive_server.LONG_M)
    node.advance(2.9)  # to most of the third metre: a node is seen to go on as it began
    jammed_s = node.now_s
    node.send(speed_limits.JAMMED, Bool(data=True))  # the wheels raise at the next command
    limit_s = drive_server.COMMAND_S + abort_s
    drive_server.require_abort(node, goal, "A goal whose wheels jam", limit_s)
    drive_server.require_commands(node, jammed_s)
    goal = drive_server.send_goal(node, 1, "while the wheels are jammed")
    goal.require_accepted(drive_server.PROMPT_S)
    what = "A goal whose wheels are jammed from the start"
    drive_server.require_abort(node, goal, what, abort_s)
    node.send(speed_limits.JAMMED, Bool(data=False))
    drive_server.require_one_metre(node, "after the jam, with free wheels,")
    nodes.require_no_errors("aborted")
    nodes.require_times(program_trials.ABORTED, program_trials.COMMANDS)


@EXAM.check(
    builds_on=("gripper_answers",),
    hints=(
        "A try's time is up, and then its answer arrives: in the pause, in the next try, or in the "
        "next request. Where does it end up in your node?",
        "Each try has a future of its own. Forget the old one when its time is up.",
        "`future.cancel()` (or `client.remove_pending_request(future)`) when the 1 s is over.",
    ),
    read=READ_ASYNC,
)
def gripper_stale(nodes: Nodes) -> None:
    """An answer that comes too late is not taken for the answer to the present try.

    The late answer is about the past. Taken for the present one, it says `done` while the gripper
    is still moving, or reports one grip twice.
    """
    node = nodes.node(GRIPPER_CLIENT)
    with node.served_by(ServiceServer, GRIPPER) as gripper:
        grip = ExaminedGrip(node, gripper, True)
        node.advance(LATE_S)
        grip.require_patience()
        late_by = f"first try comes {LATE_S:g} s after it"
        grip.tries[0].answer(success=False)
        grip.require_ignored(late_by)
        # Who looks at an answer only when the next try is due takes it for one then.
        node.advance_until(grip.has_gone_on, gripper_client.LONGEST_S)
        if grip.outcomes[:1] == ["refused"]:
            grip.require_ignored(late_by)
        grip.answer_again()
        grip.require_once("When the second try was answered, after a late answer to the first")

        grip = ExaminedGrip(node, gripper, False)
        grip.require_second_try()
        grip.tries[0].answer(success=False)
        grip.require_ignored("first try comes when the second one is under way")
        grip.answer_again()

        before = ExaminedGrip(node, gripper, True)
        late = before.tries[0]
        before.answer_again()
        grip = ExaminedGrip(node, gripper, True)
        late.answer(success=False)
        grip.require_ignored("first try for the last request comes when the next one is under way")
        grip.tries[0].answer(success=True)
        when = "When a try was answered with success=True, after a late answer from before"
        grip.require_outcome(when, "done")

        grip = ExaminedGrip(node, gripper, True)
        grip.require_second_try()
        grip.tries[0].answer(success=True)
        node.advance_until(grip.is_over, gripper_client.DEADLINE_S, stride_s=COARSE_S)
        node.require_that(  # that anything is said at all is another check's
            grip.outcomes[:1] != ["done"],
            "An answer to the first try that comes during the second one is ignored, also when no "
            "other comes: then “failed” is due.",
            "It said “done”.",
        )
        nodes.require_no_errors("stale")
    nodes.require_times(program_trials.LATE)


@EXAM.check(
    builds_on=("gripper_answers",),
    hints=(
        "What goes on in your node while nobody answers, or nobody is there: which tries, for how "
        "long each, and does the heart's timer run?",
        "Waiting in a callback (`wait_for_service`, `call`, `time.sleep`) stops its whole group.",
        "Await futures and `sleep(node, ...)` in a reentrant group; the heartbeat's timer goes on.",
    ),
    read=READ_GROUPS,
)
def gripper_absent(nodes: Nodes) -> None:
    """A gripper that dies in mid-call or is absent is reported, while the heart goes on beating.

    A node that blocks looks dead to the safety monitor, which then stops the whole robot.
    """
    node = nodes.node(GRIPPER_CLIENT, new_session=True)
    with node.served_by(ServiceServer, GRIPPER) as gripper:
        began = time.monotonic()
        node.advance(2.0)
        watched_s = time.monotonic() - began
        gripper_client.require_beats(
            node, when="Before the first request", since_s=0.0, watched_s=watched_s
        )
        grip = ExaminedGrip(node, gripper, True)
    with node.unserved(GRIPPER):
        grip.require_failure("When the gripper died in the middle of a call", node.now_s)
        grip = ExaminedGrip(node, None, True)
        grip.require_failure("When there was no gripper at all", grip.began_s)
        grip = ExaminedGrip(node, None, False)
        node.advance(BACK_S)
    with node.served_by(ServiceServer, GRIPPER) as gripper:
        grip.gripper = gripper
        when = f"When the gripper was not there, and came back {BACK_S:g} s after the request"
        node.require_that(
            node.advance_until(grip.has_begun, gripper_client.DEADLINE_S - BACK_S),
            f"{when}, it is called: the third try comes 3.5 s after the request or later.",
            f"It was never called. {say_words(grip.outcomes)}",
        )
        grip.require_data()
        grip.tries[-1].answer(success=True)
        grip.require_outcome(f"{when} and answered success=True", "done")
        grip = ExaminedGrip(node, gripper, True)
        grip.tries[0].answer(success=True)
        grip.require_outcome("When the gripper had come back and answered success=True", "done")
        grip = ExaminedGrip(node, gripper, True)
        grip.tries[0].answer(success=False)  # what it says then is another check's
        refused_s = node.now_s
        node.advance(1.0)
        gripper_client.require_beats(node, when="After a refusal", since_s=refused_s)
        nodes.require_no_errors("absent")
    nodes.require_times(program_trials.BEAT)


@EXAM.check(
    builds_on=("speed_serves",),
    hints=(
        "When do you store a new limit: before or after everything about the request is known?",
        "Work on a copy, and let it take the place of the limits after `set_limits` has returned.",
        "Copy `self.limits`, check all, `try: self.wheels.set_limits(**copy)`, and then store.",
    ),
)
def speed_atomic(nodes: Nodes) -> None:
    """A half-good request, or wheels that raise, leave the old limits as they were.

    Half of a request is a state that nobody asked for, and that the next good request makes real.
    """
    node, draw = nodes.node(SPEED_SERVER, fresh=True), nodes.draws.number
    linear = draw("a linear limit that stays", 0.4, 0.31, 0.49)
    half = draw("a half-good linear limit", 0.2, 0.05, 0.29)
    angular = draw("an angular limit after a half-good one", 1.5, 1.2, 1.95)
    later = draw("an angular limit after a jam", 1.1, 0.3, 1.15)
    require_set(node, "At first", (linear, 1.0), linear=linear)
    for parameters in itertools.permutations([("linear", half), ("angular", math.nan)]):
        require_refused(node, parameters)
    require_set(node, "After a half-good request", (linear, angular), angular=angular)
    node.send(speed_limits.JAMMED, Bool(data=True))
    require_refused(node, [("linear", 0.9)], " with jammed wheels")
    node.send(speed_limits.JAMMED, Bool(data=False))
    node.advance(LATER_S, stride_s=COARSE_S)
    reached = node.end.values(speed_limits.LIMITS)
    node.require_that(
        not reached,
        "A request that was refused is over: when the wheels work again, the old limits hold.",
        f"Within {LATER_S:g} s after the jam, what reached the wheels: "
        f"{speed_limits.describe_limits(reached)}.",
    )
    require_set(node, "After the jam", (linear, later), angular=later)
    nodes.require_no_errors("atomic")


@EXAM.check(
    builds_on=("goals_end",),
    hints=(
        "A client waits for three answers: to the goal, of the drive, to the cancel. What does "
        "your node do if one of them is no, late, or never comes?",
        "The goal's answer, the result and the cancel's answer: none of them may wait for ever.",
        "Cancel each future after its time, then `lost`; empty `goals_canceling` means `runaway`.",
    ),
    read=READ_STATUS,
)
def goals_lost(nodes: Nodes) -> None:
    """A navigator that refuses to cancel, dies on the way or is absent is reported, with a stop.

    Just when the navigator does not obey or does not answer, nobody else stops the robot.
    """
    node, draws = nodes.node(NAVIGATION_CLIENT), nodes.draws
    metres, far = draws.whole(*METRES), draws.whole(*FAR)
    with node.served_by(ActionServerEnd, navigator_client.NAVIGATE) as navigator:
        goal = ExaminedJourney(
            node, navigator, far, cancels=False, holds_goal=True, holds_cancel=True
        )
        goal.answer_slowly("the goal")
        goal.require_cancel()
        goal.answer_slowly("the request to cancel")
        when = "When the navigator refused to cancel"
        goal.require_outcome(when, "runaway")
        goal.send_feedback(2)
        navigator.end_goal(ServerGoalHandle.succeed)
        goal.require_once(f"{when}, and reported success later", "runaway")

        goal = ExaminedJourney(node, navigator, metres, holds_goal=True)
        goal.forget_stop()  # what came with the request does not answer the silence
        when = "When the navigator did not answer the goal for 1 s"
        goal.require_outcome(when, "lost", navigator_client.LOST_S)
        navigator.decide()
        if node.advance_until(lambda: navigator.goals, 1.0):
            goal.send_feedback(1)
            navigator.end_goal(ServerGoalHandle.succeed)
        goal.require_once(f"{when}, then accepted it and arrived", "lost")

        goal = ExaminedJourney(node, navigator, metres + 1, holds_cancel=True)
        goal.require_cancel()
        when = "When the navigator did not answer the request to cancel for 1 s"
        goal.require_outcome(when, "lost", navigator_client.LOST_S)
        navigator.decide()
        node.rest()
        navigator.end_goal(ServerGoalHandle.canceled)
        goal.require_once(f"{when}, then accepted it", "lost")
        goal = ExaminedJourney(node, navigator, metres)
    with node.unserved(navigator_client.NAVIGATE):
        when = "When the navigator died on the way"
        goal.require_outcome(when, "lost", navigator_client.DIED_S)
        goal.require_once(when, "lost")
        goal = ExaminedJourney(node, navigator, metres)
        goal.require_outcome("When there was no navigator", "lost", navigator_client.LOST_S)
    with node.served_by(ActionServerEnd, navigator_client.NAVIGATE) as navigator:
        goal = ExaminedJourney(node, navigator, metres)
        navigator.end_goal(ServerGoalHandle.succeed)
        when = "When the navigator had come back, and the goal succeeded"
        goal.require_outcome(when, "arrived")
        node.advance(APART_S)
        goal = ExaminedJourney(node, navigator, metres - 1, holds_goal=True)
        goal.answer_slowly("the goal", GOAL_LEFT)
        navigator.end_goal(ServerGoalHandle.succeed)
        when = "When the goal was accepted late, but in time, and succeeded"
        goal.require_outcome(when, "arrived")
        nodes.require_no_errors("absent", "lost")
    nodes.require_times(program_trials.GOAL, program_trials.CANCEL)


@EXAM.check(
    builds_on=("drive_arrives",),
    hints=(
        "Which of your lines run when somebody calls `shutdown()`, on the way or not, and which "
        "may tell the wheels something after that?",
        "A stop alone does not last: the loop drives on. Tell the loop, too.",
        "Set a flag, and stop the wheels; the loop looks at the flag, aborts the goal, returns.",
    ),
    read="Chapter 5, “Nodes: the processing units”: “Lifecycle management”",
)
def drive_shutdown(nodes: Nodes) -> None:
    """A node that is shut down in the middle of a drive leaves the robot standing.

    An update, Ctrl-C, a launch file that ends: nodes go down while the robot drives, and nobody
    is left to tell the wheels.
    """
    shutdown.require_stop_on_the_way(nodes)
    shutdown.require_stop_while_idle(nodes)
    shutdown.require_stop_unasked(nodes)
