# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-task", "locked": true, "schema_version": 3, "solution": false}
# # Exercise 5: Error handling in a safety-critical robot
#
# ![A robot with a parcel in its gripper stands still in a hospital corridor, in front of a person: its wheels are jammed](error-handling.svg)
#
# A robot carries parcels through a hospital. Its gripper hangs, its wheels jam, requests are
# nonsense, servers die. You write four independent nodes that notice each failure, say so, and leave
# the robot standing. This takes about 150 minutes.

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-must-do", "locked": true, "schema_version": 3, "solution": false}
# ## What it must do
#
# - **A. `GripperClient`** has the gripper opened and closed: three tries of 1 s, pauses of 0.5 s
#   and 1 s, and one word for the outcome. Its heart beats every 0.5 s.
# - **B. `SpeedServer`** sets limits up to 1 m/s and 2 rad/s, and refuses nonsense with a reason.
# - **C. `NavigationClient`** sends the robot off; it gives up after 1 s without answer, or 2 s
#   without feedback.
# - **D. `NavigationServer`** drives 1 to 10 m at 1 m/s. A cancel ends the drive within 0.5 s,
#   jammed wheels or a shutdown within 1 s.
# - After each failure in C and each end in D a zero `Twist` on `cmd_vel` stops the robot.
# - All waiting is on the node's clock; no exception leaves a callback.

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-try-it", "locked": true, "schema_version": 3, "solution": false}
# ## Try it
#
# In a cell of your own, once the cells below have run:
#
# ```python
# import course
#
# world = course.world("corridor")
# for part in (GripperClient, SpeedServer, NavigationClient, NavigationServer):
#     course.run(part, threads=4)
# course.session().panel(world, "drive", "speed/set", "grip/outcome", "navigate/outcome")
# ```
#
# “Break something” does what the exam does. Ask your nodes by
#
# ```python
# %ros topic pub --once grip/request std_msgs/msg/Bool "data: true"
# %ros topic pub --once navigate/request std_msgs/msg/Int32 "data: 5"
# ```

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-fine-print", "locked": true, "schema_version": 3, "solution": false}
# <details><summary>What exactly is examined</summary>
#
# **All four nodes**
#
# - **By what they do.** An examiner in another process plays the gripper, the operators, the
#   navigator and the dispatchers, for one node at a time. How you write a node is your choice:
#   `async` callbacks, futures with callbacks, timers, threads; node names, helpers and QoS are free
#   (a best-effort heartbeat is heard as well). Every topic, service and action of the stub is there
#   when the constructor returns.
# - **Time.** It is simulated. All times here are in seconds of the node's clock, and each may be
#   0.2 s shorter or longer. "At once" means within 1 s. Timers fire when they are due. A thread
#   that sleeps on that clock, with `self.get_clock().sleep_for(duration)`, sees it move in steps of
#   0.1 s, and of 0.5 s where nothing is timed.
# - **Waiting.** No callback waits on the wall clock: no `time.sleep`, no `call(...)`, no
#   `wait_for_service(timeout_sec=...)`; naps of less than 0.1 s between two looks at the node's
#   clock do no harm. A callback may block on the node's clock if it is in a reentrant group or in a
#   group of its own: the node runs in an executor with 4 threads, and it holds one of them. In the
#   node's default group it would hold up the node's clock, which is heard there.
# - **Exceptions.** None leaves a callback. `execute` counts, too, although rclpy catches what
#   leaves it and aborts the goal. The first checks of A, B and D do not look for that, all others
#   do.
# - **Once more, in a plain program.** When your work is graded, the same is done in short to your
#   nodes in a program of rclpy. What leaves a callback ends it there. Times have wider bounds: an
#   answer after 0.7 s is in time, one after 1.5 s is late; the second try comes 1.05 s or more
#   after the first; a heartbeat every 0.27 to 0.85 s; a silent drive is canceled after 1.5 to 3 s,
#   and `lost` said after 0.7 to 1.6 s; a goal of 3 m takes 1.9 to 4.8 s, with commands at most
#   0.9 s apart; it is over 0.9 s after a cancel, and 1.9 s after a jam.
#
# **A. The gripper's client** (the next request comes when there is an outcome, perhaps right then)
#
# - **Done.** `gripper/set` is called at once with the `data` of the request, once. When it has
#   answered `success=True`, at once or after 0.7 s, `done` is published at once, and for 1.5 s
#   nothing else.
# - **Refused.** When the first or the second try is answered `success=False`, `refused` follows at
#   once, and an `Empty` on `arm/hold` at the latest 1 s later, after the refusal. For 1.5 s there
#   is no other outcome and no further call. Before that up to two grips may have gone well.
# - **Failed.** When nobody answers there are three tries, all with the same `data`. Each has 1 s.
#   The pause before the second is at least 0.5 s, and the one before the third at least 0.5 s
#   longer than that: 0.5 s and 1 s, say, or 2 s and 3 s. When the third has had its 1 s, `failed`
#   is published at once, within 10 s of the request, and an `Empty` on `arm/hold` after that try
#   was made and at the latest 1 s after the word. An answer that comes then changes nothing for
#   1.5 s. During the first pause the clock stands still for a second of wall time, and nothing may
#   happen. The next request is not answered either, and has tries and pauses of its own; the one
#   after it is answered at once; and the one 0.5 s later after 0.7 s, which is in time.
# - **Late answers** (hidden). An answer to a try whose 1 s is over is ignored, whether it comes in
#   the pause, during the next try, or during the next request, and whether it says yes or no. The
#   try that runs then is answered as usual, and that counts. Without another answer the word is
#   never `done`.
# - **No gripper** (hidden). The heart beats every 0.5 s from the beginning: in the first 2 s, while
#   there is no answer, and for 1 s after a refusal. No silence is longer than 0.7 s, and there are
#   no more beats than one every 0.3 s. If the gripper vanishes in the middle of a call, or is not
#   there at all, a try lasts 1 s just the same: `failed` and `arm/hold` come after 3.5 s at the
#   earliest, and within 10 s. One that comes back 1.8 s after the request is called by the next
#   try, and its `success=True` means `done`. The next requests are served as usual.
#
# **B. The server of speed limits**
#
# - **Good requests.** One limit or both, the bounds 0.0, 1.0 and 2.0 included: within 1 s
#   `successful=True`, and one call of `set_limits` with both limits, the one that is not named as
#   it was. Also if they have these values already. At first they are 0.5 and 1.0.
# - **Bad requests.** NaN, infinite, below 0, too large (1.01 m/s, 2.01 rad/s); a string, an
#   integer, a bool, an array, a parameter without a type; another name (`Linear` is one); a bad
#   parameter beside good ones, also before a good one of the same name; an empty list. Within 1 s
#   `successful=False` with a `reason` that is not blank, and nothing comes on `wheels/limits` or
#   `cmd_vel`. A good request after any of them is served as usual.
# - **Half-good requests and jammed wheels** (hidden). A request with one good and one bad limit, in
#   either order, changes nothing: the next one that names a single limit shows it. Wheels that
#   raise mean `successful=False` with a reason, and nothing on `wheels/limits` then or in the 1.5 s
#   after the jam; a stop on `cmd_vel` is allowed. The old limits hold.
# - Not examined: two good values of one name in one request.
#
# **C. The navigator's client** (the next request comes when there is an outcome)
#
# - **Arrived, rejected, aborted,** in any order. The goal is sent at once with the `order` of the
#   request; its word comes at once, and no other one for 2.5 s. With `rejected` and `aborted` a
#   zero `Twist` comes on `cmd_vel`, after the failure and at the latest 1 s after the word.
# - **Stalled.** A drive with feedback every 1.5 s, once the same twice, is left alone for 13.5 s,
#   and `arrived` when it succeeds. Without feedback for 2 s the goal is canceled, between 1.7 and
#   2.3 s after the last one. When that is accepted: `stalled` at once, a zero `Twist` after the
#   last feedback and at the latest 1 s after the word, and no other word for 2.5 s, also when the
#   goal ends.
# - **Lost and runaway** (hidden). A navigator that takes 0.7 s to accept, gives no feedback, is
#   asked to cancel 2 s after the acceptance, and refuses after another 0.7 s: `runaway` at once. No
#   answer to the goal, or to the request to cancel: `lost`, after 1 s (at the latest 1.4 s). A
#   navigator that dies on the way: `lost`, within 3.5 s. One that is not there: `lost`, within
#   1.4 s. Each with its zero `Twist`, and except for the last one watched for another 2.5 s:
#   feedback, acceptance or success that come later change nothing. You may cancel a goal that is
#   accepted after `lost`; you need not. A navigator that comes back is used as usual: one goal is
#   accepted at once, and the next one, sent 0.5 s after the outcome, after 0.7 s.
# - Not examined: a goal that somebody else cancels, a result that comes while you wait for the
#   answer to your cancel, and a cancel that is refused because the goal is over.
#
# **D. The drive's server** (a dispatcher sends the next goal when the last one is over)
#
# - **Goals.** 0, less, and 11 or more are rejected within 1 s, and nothing but stops is told to the
#   wheels. One of 3 to 5 m is accepted within 1 s, and the robot drives within another. On
#   `cmd_vel` there is `linear.x` from 0.95 to 1.05 m/s and no turning, or a stop. The goal succeeds
#   within 1 s of its length in seconds, sooner or later, with all marks as the result: `[1, 2, 3]`.
#   The feedbacks are `[1]`, then `[1, 2]`, and so on; they may come twice or be empty in between,
#   and each comes on the way: a mark with 2 s to go at the latest 1 s before the end.
# - **A stop after each drive.** At 0.5 s after the end (0.75 s are allowed) the last message on
#   `cmd_vel` is a zero `Twist`; one has come also if the robot never got to move. After each way
#   out a goal of 1 m is served as usual, with the marks `[1]`.
# - **Canceled.** A goal of 10 m, 0.1 s after its first mark, and one of 1 m, 0.3 s after it began
#   to drive: the request is accepted within 0.5 s, and then the goal is `canceled` within 0.5 s
#   (0.75 s are allowed). Not examined: a cancel just before the end.
# - **Aborted.** The wheels get a command at least every 0.5 s (0.75 s are allowed). When they jam
#   2.9 s after the beginning, the goal is `aborted` within 1.5 s: 0.5 s until the next command, and
#   1 s. One that comes while they are jammed is accepted, and aborted within 1 s. Each time a text
#   that is not blank comes on `drive/fault`.
# - **Shut down** (hidden). In the middle of a drive another thread calls `shutdown()`, while the
#   clock stands still. It does not wait (1 s of wall time, the fastest of up to three calls) and
#   does not raise. After it the last message on `cmd_vel` is a zero `Twist`, nothing but stops
#   follows, and the goal is `aborted` within 1 s. Called while no goal is under way it publishes a
#   zero `Twist`, too. A goal that comes afterwards may be rejected, aborted or left without an
#   answer, but nothing moves. When your work is graded, a program of its own does the same. You
#   need no lock: the call comes while your loop sleeps. (On a robot it may come between your look
#   at the flag and `drive()`.)
#
# </details>

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-tools", "locked": true, "schema_version": 3, "solution": false}
# ## Given: tools and hardware
#
# - `once(node, seconds, callback)` calls `callback` once, that many seconds later on the node's
#   clock. It returns a timer: `timer.reset()` begins anew, `timer.cancel()` calls it off.
# - `await sleep(node, seconds)` lets a coroutine wait. Other callbacks run meanwhile.
# - `Wheels(node)` is the motor controller. It notices a jam only when it gets a command, and then
#   raises `WheelError`; `stop()` always works.
# - The action is `test_msgs/action/Fibonacci`, which is installed everywhere. Here it means
#   driving: `order` is how many metres to drive, `sequence` lists the metre marks passed so far:
#   `[1, 2, 3]`.
#
# To wait for any future no longer than you want, cancel it when time is up: `await future` then
# ends, too, and gives `None`, and rclpy drops an answer that comes later. Three things to know:
# `future.cancel()` also runs the future's done callbacks, with the result `None`. In the cancel
# callback the goal is not canceling yet: say yes there, and let `execute` look at
# `is_cancel_requested`. And call no attribute `self.handle`: nodes of rclpy have one, which "cannot
# be modified".

# %% nbgrader={"grade": false, "grade_id": "safety-given", "locked": true, "schema_version": 3, "solution": false}
# %load_ext course

import math

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Twist
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Bool, Empty, Int32, String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci as Drive


def once(node, seconds, callback):
    """Call `callback` once, `seconds` from now on the node's clock; return the timer."""

    def fire():
        timer.cancel()
        callback()

    timer = node.create_timer(seconds, fire, callback_group=ReentrantCallbackGroup())
    return timer


async def sleep(node, seconds):
    """Wait for `seconds` on the node's clock, without blocking anything."""
    over = Future(executor=node.executor)
    timer = once(node, seconds, lambda: over.set_result(None))
    await over
    node.destroy_timer(timer)


class WheelError(Exception):
    """The wheels cannot do what they are told."""


class Wheels:
    """The motor controller. It notices a jam when it is given a command, and raises WheelError."""

    def __init__(self, node):
        self._jammed = False
        self._limits = node.create_publisher(Twist, 'wheels/limits', 10)
        self._speed = node.create_publisher(Twist, 'cmd_vel', 10)
        node.create_subscription(
            Bool, 'hardware/jammed', self._on_jammed, 10, callback_group=ReentrantCallbackGroup()
        )

    def _on_jammed(self, message):
        self._jammed = message.data

    def _require_free(self):
        if self._jammed:
            raise WheelError('the wheels are jammed')

    def set_limits(self, linear, angular):
        """Limit the speed from now on. It believes whatever it is told."""
        self._require_free()
        limits = Twist()
        limits.linear.x, limits.angular.z = linear, angular
        self._limits.publish(limits)

    def drive(self, speed=1.0):
        """Drive at `speed` m/s, until the next command."""
        self._require_free()
        command = Twist()
        command.linear.x = speed
        self._speed.publish(command)

    def stop(self):
        """Stand still: a zero Twist on cmd_vel. Works with jammed wheels, too."""
        self._speed.publish(Twist())


# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-about-gripper", "locked": true, "schema_version": 3, "solution": false}
# ## A. The gripper: a service client
#
# For each `Bool` on `grip/request` (true: close, false: open) call the service `gripper/set`
# (`std_srvs/SetBool`) with the same `data`, and publish exactly one word on `grip/outcome`, as soon
# as it is known. With every word but `done` the arm must hold still: publish an `Empty` on
# `arm/hold`. A gripper that is not there is one that does not answer: it may come back before the
# third try.
#
# | Outcome | When |
# |---|---|
# | `done` | the gripper answered `success=True` |
# | `refused` | it answered `success=False`: that is an answer, so do not try again |
# | `failed` | three tries in all went without an answer in time |

# %% nbgrader={"grade": false, "grade_id": "safety-solution", "locked": false, "schema_version": 3, "solution": true}
class GripperClient(Node):
    """Has the gripper closed and opened, and never waits for it in vain."""

    def __init__(self):
        super().__init__('gripper_client')
        self.group = ReentrantCallbackGroup()
        self.gripper = self.create_client(SetBool, 'gripper/set', callback_group=self.group)
        self.outcome = self.create_publisher(String, 'grip/outcome', 10)
        self.hold = self.create_publisher(Empty, 'arm/hold', 10)
        self.heartbeat = self.create_publisher(Empty, 'grip/heartbeat', 10)
        self.create_timer(0.5, lambda: self.heartbeat.publish(Empty()), callback_group=self.group)
        self.create_subscription(
            Bool, 'grip/request', self.on_request, 10, callback_group=self.group
        )

    async def on_request(self, request):
        """Have `request.data` carried out; publish the outcome."""
        ### BEGIN SOLUTION
        word = 'failed'
        for pause in (0.0, 0.5, 1.0):
            if pause:
                await sleep(self, pause)
            response = await self.ask(request.data)
            if response is not None:
                word = 'done' if response.success else 'refused'
                break
        if word != 'done':
            self.hold.publish(Empty())
        self.outcome.publish(String(data=word))

    async def ask(self, close):
        """Try once; return the gripper's answer, or None if there was none within 1 s."""
        answer = self.gripper.call_async(SetBool.Request(data=close))
        timer = once(self, 1.0, answer.cancel)
        response = await answer
        self.destroy_timer(timer)
        return response
        ### END SOLUTION


# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-about-speed", "locked": true, "schema_version": 3, "solution": false}
# ## B. The speed limits: a service server
#
# `SpeedServer` serves `speed/set` (`rcl_interfaces/SetParametersAtomically`): doubles named
# `linear` (m/s, 0.0 to 1.0, at first 0.5) or `angular` (rad/s, 0.0 to 2.0, at first 1.0) come in,
# one or both, and `result.successful` and `result.reason` go out. A good request is handed to
# `Wheels.set_limits` once, with both limits. One bad parameter, an empty list, or wheels that
# raise: the whole request is refused with a reason in words, and the old limits hold.

# %% nbgrader={"grade": false, "grade_id": "safety-speed", "locked": false, "schema_version": 3, "solution": true}
HIGHEST = {'linear': 1.0, 'angular': 2.0}  # m/s, rad/s


class SpeedServer(Node):
    """Lets operators set speed limits, and believes none of them."""

    def __init__(self):
        super().__init__('speed_server')
        self.wheels = Wheels(self)
        self.limits = {'linear': 0.5, 'angular': 1.0}
        self.create_service(SetParametersAtomically, 'speed/set', self.on_request)

    def on_request(self, request, response):
        """Check every parameter, then set the limits; answer in any case."""
        ### BEGIN SOLUTION
        try:
            if not request.parameters:
                raise ValueError('name at least one limit: linear or angular')
            limits = dict(self.limits)
            for parameter in request.parameters:
                name, value = parameter.name, parameter.value
                if name not in HIGHEST:
                    raise ValueError(f"there is no limit '{name}', only linear and angular")
                if value.type != ParameterType.PARAMETER_DOUBLE:
                    raise ValueError(f'{name} must be a double')
                # NaN compares false with everything, so this refuses it as well.
                if not 0.0 <= value.double_value <= HIGHEST[name]:
                    raise ValueError(f'{name} must lie between 0.0 and {HIGHEST[name]}')
                limits[name] = value.double_value
            self.wheels.set_limits(**limits)
        except (ValueError, WheelError) as error:
            response.result.reason = str(error)
        else:
            self.limits = limits
            response.result.successful = True
        ### END SOLUTION
        return response


# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-about-goals", "locked": true, "schema_version": 3, "solution": false}
# ## C. The navigator's client: an action client
#
# For each `Int32` on `navigate/request` send a goal with that `order` to the action `navigate`
# (`Drive`), and publish exactly one word on `navigate/outcome`, as soon as it is known; nothing
# that comes later changes it. The 2 s begin when the goal is accepted, and again with each
# feedback, so a long drive may take its time. With every word but `arrived` publish a zero `Twist`
# on `cmd_vel`.
#
# | Outcome | When |
# |---|---|
# | `arrived` | the goal succeeded |
# | `rejected` | the navigator did not accept the goal |
# | `aborted` | the navigator gave up on the way |
# | `stalled` | no feedback for 2 s: you asked to cancel, and the navigator accepted |
# | `runaway` | no feedback for 2 s: you asked to cancel, and the navigator refused |
# | `lost` | no answer for 1 s, to the goal or to the request to cancel. If nobody serves the action, you may also say so at once |

# %% nbgrader={"grade": false, "grade_id": "safety-goals", "locked": false, "schema_version": 3, "solution": true}
class NavigationClient(Node):
    """Sends the robot on its way, and stops it whenever that goes wrong."""

    def __init__(self):
        super().__init__('navigation_client')
        self.group = ReentrantCallbackGroup()
        self.navigator = ActionClient(self, Drive, 'navigate', callback_group=self.group)
        self.outcome = self.create_publisher(String, 'navigate/outcome', 10)
        self.cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(
            Int32, 'navigate/request', self.on_request, 10, callback_group=self.group
        )

    async def on_request(self, request):
        """Drive `request.data` metres; publish the outcome."""
        ### BEGIN SOLUTION
        word = await self.drive(request.data)
        if word != 'arrived':
            self.cmd_vel.publish(Twist())
        self.outcome.publish(String(data=word))

    async def drive(self, metres):
        """Send a goal and follow it to its end; return the outcome."""
        watchdog = None

        def on_feedback(_):
            # Of this goal alone: one that was given up as lost may still send some.
            if watchdog is not None and not watchdog.is_canceled():
                watchdog.reset()

        goal = Drive.Goal(order=metres)
        handle = await self.answer(self.navigator.send_goal_async(goal, on_feedback))
        if handle is None:
            return 'lost'
        if not handle.accepted:
            return 'rejected'
        result = handle.get_result_async()
        watchdog = once(self, 2.0, result.cancel)
        response = await result
        watchdog.cancel()
        if response is not None:
            return 'arrived' if response.status == GoalStatus.STATUS_SUCCEEDED else 'aborted'
        canceling = await self.answer(handle.cancel_goal_async())
        if canceling is None:
            return 'lost'
        return 'stalled' if canceling.goals_canceling else 'runaway'

    async def answer(self, future):
        """Return what `future` gives, or None if it gives nothing within 1 s."""
        timer = once(self, 1.0, future.cancel)
        answer = await future
        self.destroy_timer(timer)
        return answer
        ### END SOLUTION


# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-about-drive", "locked": true, "schema_version": 3, "solution": false}
# ## D. The drive: an action server
#
# `NavigationServer` offers the action `drive` (`Drive`): it rejects what is not 1 to 10 m, calls
# `Wheels.drive()` at least every 0.5 s, gives feedback after each metre with the marks passed so
# far, and has all marks in its result. If the wheels raise, the goal is aborted and the reason
# published on `drive/fault` (`String`), and the next goal is served as usual. `shutdown()` is
# called from another thread before the node is taken down: it stops the wheels and returns without
# waiting, from then on nothing drives, and the goal under way is aborted within 1 s.

# %% nbgrader={"grade": false, "grade_id": "safety-drive", "locked": false, "schema_version": 3, "solution": true}
class NavigationServer(Node):
    """Drives the robot, and lets it stand however the drive ends."""

    def __init__(self):
        super().__init__('navigation_server')
        self.group = ReentrantCallbackGroup()
        self.wheels = Wheels(self)
        self.closing = False
        self.fault = self.create_publisher(String, 'drive/fault', 10)
        self.server = ActionServer(
            self,
            Drive,
            'drive',
            execute_callback=self.execute,
            goal_callback=self.on_goal,
            cancel_callback=self.on_cancel,
            callback_group=self.group,
        )

    def on_goal(self, goal_request):
        """Accept or reject a goal before anything moves."""
        answer = GoalResponse.ACCEPT
        ### BEGIN SOLUTION
        if not 1 <= goal_request.order <= 10:
            answer = GoalResponse.REJECT
        ### END SOLUTION
        return answer

    def on_cancel(self, goal_handle):
        """Accept or refuse a request to cancel."""
        answer = CancelResponse.REJECT
        ### BEGIN SOLUTION
        answer = CancelResponse.ACCEPT
        ### END SOLUTION
        return answer

    async def execute(self, goal_handle):
        """Drive; end the goal as it ended, and stop the wheels in any case."""
        passed = []
        ### BEGIN SOLUTION
        try:
            while len(passed) < goal_handle.request.order:
                for _ in range(5):
                    if goal_handle.is_cancel_requested:
                        goal_handle.canceled()
                        return Drive.Result(sequence=passed)
                    if self.closing:
                        raise WheelError('the node is being shut down')
                    self.wheels.drive()
                    await sleep(self, 0.2)
                passed.append(len(passed) + 1)
                goal_handle.publish_feedback(Drive.Feedback(sequence=passed))
            goal_handle.succeed()
        except WheelError as error:
            self.fault.publish(String(data=str(error)))
            goal_handle.abort()
        finally:
            self.wheels.stop()
        ### END SOLUTION
        return Drive.Result(sequence=passed)

    def shutdown(self):
        """Stop the robot before the node is taken down."""
        ### BEGIN SOLUTION
        self.closing = True
        self.wheels.stop()
        ### END SOLUTION


# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-how-to-check", "locked": true, "schema_version": 3, "solution": false}
# ## Check it yourself
#
# The next cell starts an examiner in a process of its own, for ten seconds or so. It says for each
# check what was observed, what was needed, and why that matters on a robot;
# `check("safety", hint=2)` in a cell of your own helps more, `hint=3` most. There are 20 points: 10
# for these checks, 5 for checks at grading, 5 for your two answers.
#
# **Look inside**, in cells of your own after `import course`: `course.session().log_panel()` shows
# live what all nodes log and raise. After `course.run(NavigationServer, threads=4)` you are the
# dispatcher in `course.session().action("drive")`: send a goal, and cancel it.

# %% nbgrader={"grade": true, "grade_id": "safety-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("safety")

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next cell stays empty for you: when your work is graded, it examines what the fine print calls
# hidden.

# %% nbgrader={"grade": true, "grade_id": "safety-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("safety", part="hidden")
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-question-retries", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your choices
#
# Answer each question in three to five sentences. A person reads them: each gives 2.5 points, or a
# part of these if only a part of the question is answered.
#
# ### Retries
#
# Why three tries and not for ever, why pauses that grow, and why is a refusal not tried again? For
# which command to a robot would you not try a second time even without an answer?

# %% [markdown] nbgrader={"grade": true, "grade_id": "safety-explanation-retries", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# A hiccup is over after a try or two. A gripper that is gone does not come back because we ask more
# often, and somebody has to know in time that it is dead. Pauses that grow leave a busy server room
# to recover. A refusal is an answer: the gripper is well and has decided, perhaps because of
# fingers in between. A try without an answer may have been carried out all the same. “Close” twice
# does no harm, but “drive one metre further” or “hand over the next parcel” must not be repeated
# before one has looked what became of the first.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-question-stopping", "locked": true, "schema_version": 3, "solution": false}
# ### Stopping
#
# By which mechanism in your code is the last command a stop on every way out? Which failure does it
# not cover, and who would have to stop the robot then?

# %% [markdown] nbgrader={"grade": true, "grade_id": "safety-explanation-stopping", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# `finally` in `execute` covers every end of a goal: success, cancel, abort, an exception that
# nobody thought of. The flag that the loop looks at covers the shutdown. A process that is killed,
# a computer that loses power or a broken cable says nothing any more: the motor controller itself
# needs a watchdog that stops the wheels when commands cease, and the robot an emergency stop in
# hardware.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-hand-in", "locked": true, "schema_version": 3, "solution": false}
# **Hand in**: save this notebook, and hand in the file `error-handling.ipynb` in the way of your
# course.
