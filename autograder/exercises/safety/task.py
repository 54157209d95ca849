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
# A robot carries parcels through a hospital. Its gripper hangs, its wheels jam, requests are
# nonsense, a server dies in the middle of a job: **everything that can fail will fail**, with people
# around. You write four nodes that notice each failure, report it, and leave the robot standing.
#
# | | Your node | It talks to | What goes wrong |
# |---|---|---|---|
# | A | `GripperClient`, a service client | the gripper | no answer, a late answer, a refusal, no server |
# | B | `SpeedServer`, a service server | operators | nonsense in requests, jammed wheels |
# | C | `NavigationClient`, an action client | the navigator | goals rejected, aborted, stalled, lost |
# | D | `NavigationServer`, an action server | dispatchers, the wheels | bad goals, cancels, jammed wheels, shutdown |
#
# The parts do not depend on each other: begin with any of them. An examiner in another process
# plays the gripper, the operators, the navigator and the dispatchers, makes them fail, and watches
# **what your nodes do** on their topics, services and actions. How you write them is your choice:
# `async` callbacks, futures with callbacks, timers, threads; node names, QoS and helpers are free.
# Every topic, service and action of the task is there when a constructor returns, as in the stubs.
#
# Three rules hold for all four nodes.
#
# 1. **All waiting runs on the node's clock** (`self.create_timer`, `self.get_clock()`), never on the
#    wall clock (`time.sleep`, `wait_for_service(timeout_sec=...)`, `call(timeout_sec=...)`): the
#    examiner runs your robot on simulated time. Times in the task are in that time's seconds, and
#    0.2 s more or less do no harm. Timers fire when they are due; a thread of your own sees the
#    clock move in steps of 0.1 s or more, and sleeps on it with
#    `self.get_clock().sleep_for(duration)`.
# 2. **Nothing blocks.** Each node runs in an executor with 4 threads. While a callback waits,
#    everything else in its callback group waits too, and in the node's default group that is also
#    the clock itself. The stubs therefore use a reentrant group, `self.group`.
# 3. **Nothing leaves a callback as an exception.**
#
# **20 points:** 10 for the visible checks, 5 for checks that run when your work is graded, 5 for
# your explanations.

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-tools", "locked": true, "schema_version": 3, "solution": false}
# ## Given: tools and hardware
#
# - `once(node, seconds, callback)` calls `callback` once, that many seconds later on the node's clock.
#   It returns a timer: `timer.reset()` begins anew, `timer.cancel()` calls it off.
# - `await sleep(node, seconds)` lets a coroutine wait. Other callbacks run meanwhile.
# - `Wheels(node)` is the robot's motor controller. It raises `WheelError` while the wheels are jammed;
#   only `stop()` always works.
#
# A pattern that you can use with any future, a service's answer or an action's: cancel the future
# when time is up. Then `await future` ends too, and gives `None`; an answer that comes later is
# dropped by rclpy.
#
# The action is `test_msgs/action/Fibonacci`, which has the fields that you know from the chapter and
# is installed everywhere. Here it means driving: `order` is how many metres to drive, `sequence`
# lists the metre marks passed so far: `[1, 2, 3]`.

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
# A `Bool` on `grip/request` says: close (true) or open (false). `GripperClient` asks the service
# `gripper/set` (`std_srvs/SetBool`) with the same `data`. For **each request it publishes exactly
# one word** on `grip/outcome` (`String`):
#
# | Outcome | When |
# |---|---|
# | `done` | the gripper answered `success=True` |
# | `refused` | it answered `success=False`; that is an answer, so do not try again |
# | `failed` | three tries in all went without an answer |
#
# - A try without an answer for 1 s has failed. An answer within that time counts, a later one is
#   ignored: it is not the answer to the try that runs now.
# - Between a failed try and the next one there is a pause: at least 0.5 s before the second try, and
#   before the third at least 0.5 s longer than before the second. Within 10 s of the request there
#   is an outcome. The first try comes at once, and so does an outcome that is clear. A gripper that
#   is not there at all is treated the same way: it may come back.
# - With every outcome but `done`, the arm must hold still: publish an `Empty` on `arm/hold`.
# - All the time, whatever happens, an `Empty` on `grip/heartbeat` every 0.5 s shows that the node is
#   alive.
#
# The next request comes only after the outcome.

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
# `SpeedServer` serves `speed/set` (`rcl_interfaces/SetParametersAtomically`): a list of parameters
# comes in, `result.successful` and `result.reason` go out. The limits are `linear` (m/s, 0.0 to 1.0)
# and `angular` (rad/s, 0.0 to 2.0); at first they are 0.5 and 1.0. A request may name one or both.
#
# - **A good request** is handed to `Wheels.set_limits` once, with both limits (the one that is not
#   named keeps its value), and answered `successful=True`.
# - **A bad request** is answered `successful=False` with a reason in words, and nothing at all
#   reaches the wheels: NaN, infinite, negative or too large; a parameter that is no double
#   (`parameter.value.type`); any other name; an empty list. One bad parameter makes the whole
#   request bad, even if a good one of the same name follows.
# - **Wheels that raise** are answered `successful=False` with a reason, and the old limits hold.
# - Whatever came in, the next request is answered as if nothing had happened.

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
# An `Int32` on `navigate/request` says how many metres to drive. `NavigationClient` sends it as
# `order` to the action `navigate` (`Drive`). For **each request it publishes exactly one word** on
# `navigate/outcome` (`String`):
#
# | Outcome | When |
# |---|---|
# | `arrived` | the goal succeeded |
# | `rejected` | the navigator did not accept the goal |
# | `aborted` | the navigator gave up on the way |
# | `stalled` | no feedback for 2 s: you asked to cancel, and the navigator accepted |
# | `runaway` | no feedback for 2 s: you asked to cancel, and the navigator refused |
# | `lost` | no answer at all for 1 s: to the goal, or to the request to cancel (at once if nobody serves the action is right, too) |
#
# - The 2 s begin when the goal is accepted, and again with each feedback. A drive may take as long
#   as it likes while feedback comes in.
# - With every outcome but `arrived`, publish a zero `Twist` on `cmd_vel`: whatever the navigator
#   still does, the robot is told to stand.
# - When the outcome is clear, it is published at once. Nothing that comes later changes it.
#
# The next request comes only after the outcome.

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
# `NavigationServer` offers the action `drive` (`Drive`). A dispatcher sends one goal at a time.
#
# - A goal of 1 to 10 metres is accepted, any other is **rejected**, and the wheels do not move.
# - It drives at 1 m/s, so each metre takes 1 s. After each metre there is feedback with the marks
#   passed so far, and at the end a goal that **succeeded**, with all marks as the result.
# - The wheels notice a jam only when they get a command: call `Wheels.drive()` at least every 0.5 s.
# - A request to cancel is accepted, and within 0.5 s the goal is **canceled**.
# - If the wheels raise, the goal is **aborted** within 1 s, and the reason is published in words on
#   `drive/fault` (`String`). The next goal is served as usual.
# - Whoever takes the node down calls its method `shutdown()` first, in a thread of their own. It does
#   not wait: it stops the wheels, which are told nothing but to stop from then on, and the goal that
#   is under way, if there is one, is **aborted** within 1 s.
# - **However it ends** (succeeded, canceled, aborted, shut down), and even if it never got to move,
#   the robot is stopped: a zero `Twist` is the last message on `cmd_vel`, within 0.5 s of the end.

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
# The next cell starts an examiner in a process of its own. It takes a few seconds. For each check
# it says what was observed, what was needed, and why it matters on a robot. Ask for more help with
# `check("safety", hint=2)` or `hint=3` in a cell of your own. What your callbacks raised or printed
# is in `course.logs()` after you ran the node yourself with `course.run(GripperClient, threads=4)`.
#
# **Look inside**, in cells of your own after `import course`: `course.session(threads=4).log_panel()`
# shows live what all nodes log and raise. After `course.run(NavigationServer)` you are the dispatcher
# in `course.session().action("drive")`: send goals, several at once, and cancel them.

# %% nbgrader={"grade": true, "grade_id": "safety-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("safety")

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next cell is empty for you. When your work is graded, it examines the rest of the task: late
# answers and the heartbeat of part A, half-good requests and jammed wheels of part B, a navigator
# that is slow, is not there, dies or refuses to cancel in part C, and the shutdown in part D.

# %% nbgrader={"grade": true, "grade_id": "safety-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("safety", part="hidden")
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-question-timeouts", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your choices
#
# Say in two or three sentences each what you did, and why. An instructor reads this: each answer
# gives one point, or half a point if only a part of the question is answered.
#
# ### Time-outs
#
# How does your client wait for an answer without blocking, and what would stand still if it did?

# %% [markdown] nbgrader={"grade": true, "grade_id": "safety-explanation-timeouts", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# The answer is a future that the callback awaits, and a timer cancels it after 1 s. A blocking call
# would hold a thread, and in the default group also the heartbeat and the clock.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-question-retries", "locked": true, "schema_version": 3, "solution": false}
# ### Retries
#
# Why three tries and not for ever, with pauses that grow, and why is a refusal not tried again?

# %% [markdown] nbgrader={"grade": true, "grade_id": "safety-explanation-retries", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# A hiccup is over after a try or two; a gripper that is gone does not come back because we ask more
# often, and somebody has to know in time. Growing pauses leave a busy server room to recover. A
# refusal is an answer: the gripper is well and has decided.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-question-stale", "locked": true, "schema_version": 3, "solution": false}
# ### Stale answers
#
# How does your client keep a late answer apart from the present one, and what could happen
# otherwise?

# %% [markdown] nbgrader={"grade": true, "grade_id": "safety-explanation-stale", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Each try has a future of its own, and the cancelled one is forgotten, so that rclpy drops its
# answer. Otherwise the old answer "open" could count for the new command "close", and the parcel
# falls.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-question-errors", "locked": true, "schema_version": 3, "solution": false}
# ### Errors as answers
#
# What does the operator see if your service callback raises instead, and why does a bad request
# change nothing at all?

# %% [markdown] nbgrader={"grade": true, "grade_id": "safety-explanation-errors", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# If the callback raises, no response is sent: the operator waits for ever, and under a plain `spin`
# the node dies. A half-applied request leaves limits that nobody asked for.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "safety-question-stopping", "locked": true, "schema_version": 3, "solution": false}
# ### Stopping
#
# By which mechanism is the last command a stop on every way out, and which failure does it not
# cover (who would have to stop the robot then)?

# %% [markdown] nbgrader={"grade": true, "grade_id": "safety-explanation-stopping", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# `finally` in the execute callback covers each end of a goal, the flag that the loop looks at
# covers the shutdown. A process that is killed says nothing any more: the motor controller itself
# needs a watchdog that stops the wheels when commands cease.
# ### END SOLUTION
