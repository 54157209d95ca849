"""Exercise 5: four nodes that notice each failure, report it, and leave the robot standing.

The examiner plays the other end of each service and action, on simulated time, and makes it fail.
Every bound below is a sentence of the task, with the 0.2 s that the task allows and the examiner's
own stride added to it.
"""

from __future__ import annotations

from autograder.examination.exam import Exam
from autograder.exercises.safety import (
    drive_server,
    gripper_client,
    late_answers,
    navigator_client,
    shutdowns,
    speed_service,
)
from autograder.exercises.safety.rig import RobotRig, robot_rig

EXAM: Exam[RobotRig] = Exam("safety", robot_rig)

READ_SERVICES = "Chapter 5, “Services: error handling”"
READ_GOALS = "Chapter 5, “Actions: goal, feedback, result”"
READ_CANCELS = "Chapter 5, “Actions: cancellation”"
READ_STATUS = "Chapter 5, “Actions: goal status”"
READ_ASYNC = "ROS 2 documentation, “Synchronous vs. asynchronous service clients”"
READ_GROUPS = "ROS 2 documentation, “Using callback groups”"


@EXAM.check(
    hints=(
        "Follow one request through your node: from grip/request to the service and to the word.",
        "`call_async` gives a future. Publish the outcome when it is done, not before.",
        "`future = self.gripper.call_async(SetBool.Request(data=request.data))`, "
        "`timer = once(self, 1.0, future.cancel)`, `answer = await future`: None is no answer.",
    ),
    read=READ_SERVICES,
)
def gripper_answers(rig: RobotRig) -> None:
    """The gripper client reports a grip that the gripper carried out, also after 0.7 s.

    The rest of the robot waits for this word: the arm lifts only what is held.
    """
    rig.run_once(gripper_client.carried_out)


@EXAM.check(
    needs=("gripper_answers",),
    hints=(
        "What does `response.success` say?",
        "A refusal is an answer: leave the loop of tries, and command the arm to hold.",
        "On `success=False`: publish on arm/hold, then `refused` on grip/outcome, and return.",
    ),
    read=READ_SERVICES,
)
def gripper_refuses(rig: RobotRig) -> None:
    """A grip that the gripper refuses is reported at once, and the arm holds still.

    The gripper has its reason, such as fingers in between: asking again is no way to overrule it.
    """
    gripper_client.examine_refusals(rig)


@EXAM.check(
    needs=("gripper_answers",),
    hints=(
        "Count: how many tries, how long until each is given up, how long the pauses in between?",
        "Loop over the pauses, such as 0.5 s and 1.0 s, on the node's clock; then give up.",
        "After the third try without an answer: publish on arm/hold, then `failed`.",
    ),
    read=READ_SERVICES,
)
def gripper_retries(rig: RobotRig) -> None:
    """Without answers there are three tries with growing pauses, then a safe end.

    A hiccup is worth a second try. A client that tries for ever never tells anybody that the
    gripper is dead, and one that tries without pauses keeps it from recovering.
    """
    gripper_client.examine_silence(rig)


@EXAM.check(
    hints=(
        "Send yourself a request: `course.call(SetParametersAtomically, 'speed/set', ...)`.",
        "A good request goes to `Wheels.set_limits` with both limits, and sets `successful`.",
        "Keep the limits in a dictionary; the one that is not named keeps its value.",
    ),
    read=READ_SERVICES,
)
def speed_serves(rig: RobotRig) -> None:
    """A good request sets the speed limits and says so.

    In a crowded ward operators slow the robot down, and have to know that it listened.
    """
    rig.run_once(speed_service.examine_good_requests)


@EXAM.check(
    needs=("speed_serves",),
    hints=(
        "List what can be wrong with a name, with a type, and with a number.",
        "Comparisons with NaN are all false, so test for what is right, not for what is wrong.",
        "`if not 0.0 <= value <= highest:` refuses NaN too; answer with `reason`, set nothing.",
    ),
    read=READ_SERVICES,
)
def speed_refuses(rig: RobotRig) -> None:
    """Each bad request is answered with a reason, and changes nothing.

    NaN compares false with every limit: a check that forgets it lets the robot drive at any speed.
    And an exception in the callback answers nobody.
    """
    speed_service.examine_bad_requests(rig)


@EXAM.check(
    hints=(
        "There are two questions to an action server: did it accept, and how did it end?",
        "`goal_handle.accepted` answers the first, `response.status` of the result the second.",
        "Only STATUS_SUCCEEDED is `arrived`. With any other word publish `Twist()` on cmd_vel.",
    ),
    read=READ_STATUS,
)
def goals_end(rig: RobotRig) -> None:
    """Arrived, rejected, aborted: each end of a goal is told apart, and failures stop the robot.

    A result arrives for an aborted goal too. Whoever takes every result for success unloads the
    parcel in the corridor.
    """
    rig.run_once(navigator_client.examine_ends)


@EXAM.check(
    needs=("goals_end",),
    hints=(
        "What tells a slow navigator from one that hangs?",
        "Feedback is the sign of life: start a timer of 2 s at acceptance, and again with each.",
        "When it fires: `cancel_goal_async()`, a zero Twist, then `stalled`. Cancel it at the end.",
    ),
    read=READ_CANCELS,
)
def goals_stall(rig: RobotRig) -> None:
    """A drive without feedback for 2 s is canceled, a long one with feedback is not.

    A limit on the whole drive is too short for a long corridor and too long for a hung navigator.
    """
    navigator_client.examine_stalls(rig)


@EXAM.check(
    hints=(
        "Send a goal of your own: `course.send_goal(Drive, 'drive', Drive.Goal(order=2))`.",
        "Reject bad orders in the goal callback: in `execute` it is too late, it was accepted.",
        "For each metre a few times: command the wheels, `await sleep`, 1 s in all. Then feedback; "
        "at the end succeed, and stop.",
    ),
    read=READ_GOALS,
)
def drive_arrives(rig: RobotRig) -> None:
    """A valid goal is driven with feedback and ends in a stop, an invalid one is rejected.

    The wheels keep doing what they were told last: a drive that ends without a stop does not end.
    """
    rig.run_once(drive_server.examine_arrival)


@EXAM.check(
    needs=("drive_arrives",),
    hints=(
        "Who decides whether a request to cancel is accepted, and who has to act on it?",
        "Accept it in the cancel callback, and look at `goal_handle.is_cancel_requested` often.",
        "In the loop: if requested, `goal_handle.canceled()` and return; `finally` stop wheels.",
    ),
    read=READ_CANCELS,
)
def drive_cancels(rig: RobotRig) -> None:
    """A canceled drive ends within 0.5 s, and the robot stands.

    Somebody steps in front of the robot: whoever cancels means now.
    """
    drive_server.examine_cancels(rig)


@EXAM.check(
    needs=("drive_arrives",),
    hints=(
        "What happens to the robot between the exception and the end of `execute`?",
        "Catch WheelError around the whole loop: say why on drive/fault, then abort the goal.",
        "`except WheelError as error:` publish it, `goal_handle.abort()`; `finally:` stop.",
    ),
    read=READ_STATUS,
)
def drive_aborts(rig: RobotRig) -> None:
    """Jammed wheels abort the drive with a reason, the robot stands, and later goals are served.

    When the jam comes loose, wheels that were not stopped start to turn again.
    """
    drive_server.examine_jams(rig)


@EXAM.check(
    needs=("gripper_answers",),
    hints=(
        "Your second try is out, and the answer to the first one arrives. Where does it end up?",
        "Each try has a future of its own. Forget the old one when its time is up.",
        "`future.cancel()` (or `client.remove_pending_request(future)`) when the 1 s is over.",
    ),
    read=READ_ASYNC,
)
def gripper_stale(rig: RobotRig) -> None:
    """An answer that comes too late is not taken for the answer to the present try.

    The late answer is about the past. Taken for the present one, it says `done` while the gripper
    is still moving, or reports one grip twice.
    """
    late_answers.examine_late_answers(rig)


@EXAM.check(
    needs=("gripper_answers",),
    hints=(
        "What does your node do while it waits for a server that is not there?",
        "Waiting in a callback (`wait_for_service`, `call`, `time.sleep`) stops its whole group.",
        "Await futures and `sleep(node, ...)` in a reentrant group; the heartbeat's timer goes on.",
    ),
    read=READ_GROUPS,
)
def gripper_absent(rig: RobotRig) -> None:
    """A gripper that dies in mid-call or is absent is reported, while the heart goes on beating.

    A node that blocks looks dead to the safety monitor, which then stops the whole robot.
    """
    gripper_client.examine_absence(rig)


@EXAM.check(
    needs=("speed_serves",),
    hints=(
        "When do you store a new limit: before or after everything about the request is known?",
        "Work on a copy, and let it take the place of the limits after `set_limits` has returned.",
        "Copy `self.limits`, check all, `try: self.wheels.set_limits(**copy)`, and then store.",
    ),
    read=READ_SERVICES,
)
def speed_atomic(rig: RobotRig) -> None:
    """A half-good request, or wheels that raise, leave the old limits as they were.

    Half of a request is a state that nobody asked for, and that the next good request makes real.
    """
    speed_service.examine_atomicity(rig)


@EXAM.check(
    needs=("goals_end",),
    hints=(
        "Which futures of an action client may never be done?",
        "The goal's answer, the result and the cancel's answer: none of them may wait for ever.",
        "Cancel each future after its time, then `lost`; empty `goals_canceling` means `runaway`.",
    ),
    read=READ_STATUS,
)
def goals_lost(rig: RobotRig) -> None:
    """A navigator that refuses to cancel, dies on the way or is absent is reported, with a stop.

    Just when the navigator does not obey or does not answer, nobody else stops the robot.
    """
    navigator_client.examine_losses(rig)


@EXAM.check(
    needs=("drive_arrives",),
    hints=(
        "Which of your lines run when somebody calls `shutdown()` in the middle of a drive?",
        "A stop alone does not last: the loop drives on. Tell the loop, too.",
        "Set a flag, and stop the wheels; the loop looks at the flag, aborts the goal, returns.",
    ),
    read="Chapter 5, “Nodes: lifecycle management”",
)
def drive_shutdown(rig: RobotRig) -> None:
    """A node that is shut down in the middle of a drive leaves the robot standing.

    An update, Ctrl-C, a launch file that ends: nodes go down while the robot drives, and nobody
    is left to tell the wheels.
    """
    shutdowns.examine_shutdown(rig)
