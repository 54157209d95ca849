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

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-task", "locked": true, "schema_version": 3, "solution": false}
# # Exercise 3: Communication pattern selection
#
# ![A robot on a line of stations, 1 m apart; on an operator's panel its position, its picture, the station to drive to, its highest speed and its battery level.](patterns.svg)
#
# A delivery robot drives along a line of stations 0, 1, 2, ..., 1 m apart. Others deal with it in five
# ways. You **choose** a pattern for each, then **build** the node that offers all five. This takes
# about 90 minutes.

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-must-do", "locked": true, "schema_version": 3, "solution": false}
# ## What it must do
#
# - **Position** (`robot/position`): a node that needs it has it in metres, at most 0.5 s old.
# - **Camera** (`robot/camera`): 10 pictures a second.
# - **Navigation** (`robot/navigate`): somebody names a station further on, and the robot drives there
#   at `max_speed`. They hear at each station all those passed, and all at the end, when it has
#   stopped. It waits in a blocked aisle. Called off, it stops within 0.5 s.
# - **Parameters** (`max_speed`): at first 0.5 m/s. 0.1 to 1.0 is accepted, from the next drive on;
#   all else is refused with a reason.
# - **Battery** (`robot/battery`): listeners know a new level within 1 s, also those who join later.
# - While it drives, the other four go on.

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-try-it", "locked": true, "schema_version": 3, "solution": false}
# ## Try it
#
# In a cell of your own, once the cells below have run:
#
# ```python
# import course
#
# world = course.world("aisle")  # its robot is the hardware; it stands at station 0
# robot = course.run(RobotInterface, threads=4)
# course.session().panel(
#     world, "robot/navigate", "robot/position", robot, "robot/battery", "robot/camera"
# )
# ```
#
# Each instrument is what you have built; a topic takes `%ros topic pub --once robot/navigate
# std_msgs/msg/Int32 "data: 3"`. Drag something into the aisle.

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-fine-print", "locked": true, "schema_version": 3, "solution": false}
# <details><summary>What exactly is examined</summary>
#
# Another process plays the hardware (`hardware/position`, `hardware/charge` and `hardware/speed`, all
# `std_msgs/Float64`) and the rest of the system. It looks up in the ROS graph what each name really
# is, then uses it. Nobody reads your code: every design that does what stands here gets full marks.
#
# **Your node** (no points; all but your choices needs it)
#
# - `RobotInterface()` makes its node without an error. All five names of the list are there 1 s
#   later. Only what tells the battery level may be made when the hardware reports the first level;
#   until then it tells nothing, or 1.0. What the node is called is free, and so is whether there are
#   several. A name may be offered in more than one way: then one that works is used.
# - All times are those of the node's clock: `create_timer` and `self.get_clock()` go by it,
#   `time.sleep` goes by the wall's. The examiner moves the node's clock in steps, of 0.01 s as a rule,
#   of 0.5 s at most where it waits for long, each as soon as your node has nothing left to do. So the
#   two clocks have no fixed ratio. A loop that looks every few milliseconds with `time.sleep` is
#   right: before something must not have happened it gets 0.3 s of the wall's clock, to stop a drive
#   that was called off 0.6 s.
# - Four threads run your callbacks. Of one callback group only one callback runs at a time, and all
#   that you create is in the node's own group unless you say otherwise: there one that waits holds up
#   the others. A callback that never pauses, or waits for another one of its group, is an error.
#
# **Your choices** (1 point, and at grading 0.4 points each)
#
# - Each scenario has one of the three words. Where more than one pattern fits, each of them earns the
#   points. They count whatever you build.
#
# **Position** (2 points)
#
# - The hardware says three times where the robot is, within the first metre, once each. Within 0.5 s
#   a node that asks, or has listened, knows each to within 5 cm. So does one that begins to listen
#   after the last, while the robot stands.
# - An answer has `success=True` and the number in its `message`, alone or among words: of up to 12
#   numbers in the first 1000 characters one is right.
#
# **Camera** (2 points)
#
# - 9 to 11 pictures a second, counted for at least 2 s, and for up to 12 s as long as pictures that
#   were lost on the way leave it open. While the node's clock stands still, for 0.6 s of the wall's,
#   at most one comes.
# - A picture has a width, and as many bytes of data as its height times its step, not none.
#
# **Parameters** (1 point)
#
# - `max_speed` is 0.5 at first. Then 1.0, 0.1 and two values between are set, each is accepted, and
#   where the value can be read it has changed. While the robot has no goal, this moves nothing:
#   `hardware/speed` says 0 or nothing.
# - A value below 0, 0.0, one from 0.01 to 0.09, 5.0 and one from 1.01 to 1.3 are refused: with a
#   `reason` that is not empty, and the old value stays. Each request gets one result.
# - All values come as floating-point numbers, under the name `max_speed`, also to a service of your
#   own. Whole numbers, NaN and infinity are not sent.
#
# **Battery**
#
# - A new level (1 point): four come, higher and lower ones, at least 0.02 apart. Within 1 s of each
#   who listens from the beginning has it as `percentage`, to within 0.001.
# - Who joins later (1 point, at grading; needs the first): somebody who joins 8 s after the last
#   change has the level within 1 s, in the newest message. Either it is kept for them (then they ask
#   for it: TRANSIENT_LOCAL and RELIABLE on both sides; who does not ask gets nothing, and that is
#   right), or it comes again within 1 s, for two who join one after the other (the second time within
#   1.05 s).
#
# **Navigation** (3 points)
#
# - One goal at a time, always a station further on, and each is accepted: first from one of the
#   stations 1 to 6 three stations on, then from there about one metre on. A goal behind the robot, or
#   while another is driven to, is not sent. Its reports are RELIABLE, as it is if you say nothing.
# - The robot moves only while `hardware/speed` says more than 0; it has 10 s to say so. It may come
#   to its speed slowly, halt at stations, and slow down in front of the last. Where it is tells
#   `hardware/position`, and not the time: every few centimetres, so hardly ever just at a station.
# - A station is passed when the robot is there, or beyond it; up to 5 cm before it is near enough,
#   0.1 m is not. At each station, within 10 s, a report lists all that the robot has passed so
#   far on this drive, in that order, so that the list grows and its last number is this station; it
#   is never ahead. The lists may begin with the station where the drive began, or that lay behind it
#   then.
# - After the first station the aisle is blocked, for 20 s in all: 0.7 of the way to the next one,
#   then, after a little, 0.8 and 0.9 of it. The goal goes on, and no report comes. Meanwhile the
#   other four go on, if they worked before: the position within 0.5 s, twice, just after it has
#   changed; 8 to 12 pictures a second; a new level within 1 s; `max_speed` accepted.
# - Of the last metre the robot is held up for 0.6 s, 0.1 m before the station: it still wants to
#   drive there. Then it is 4 cm beyond it. How far it would roll on is not looked at.
# - There, within 10 s, it is told to stop (`hardware/speed` is 0.0), and then the goal ends as a
#   success; for 2.5 s it is told nothing else. What comes with the end lists all stations of the
#   drive, in order.
#
# **A new speed limit** (1 point, at grading; needs navigation and parameters)
#
# - A drive before any change is at 0.5 m/s, to within 0.01. After a change to a value from 0.2 to 0.4,
#   and then from 0.6 to 0.9, each with a bad one refused after it, the next drive comes to that speed
#   within 30 s, and is never faster, at its start and after its first station. A change may also hold
#   at once.
#
# **Calling off** (1 point, at grading; needs navigation)
#
# - A goal 40 to 60 stations away is called off between two stations, and the next one before its
#   first station. That is accepted, within 0.5 s `hardware/speed` says 0.0, the goal ends as one that
#   was called off, and for 2.5 s nothing else is said. Which stations are listed then is up to you.
# - After the first, position, camera, battery and parameters go on as in a blocked aisle, and the
#   robot stands when the limit is changed. After the second it is sent about a metre on, from where
#   it is, and that drive is as good as any.
#
# **Once more in a plain program** (at grading): your node runs with four threads in a program of its
# own, whose `/clock` the examiner publishes. What was right is seen there again, with more slack: 6.3
# to 15.4 pictures a second, a position within 0.7 s, a level within 1.4 s, also for who joins later,
# a blocked aisle for 15 s, and a stop within 0.7 s. What cannot be seen there a person looks at.
#
# </details>

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-choose", "locked": true, "schema_version": 3, "solution": false}
# ## First half: choose
#
# Write `"topic"`, `"service"` or `"action"` for each of these: requesting the robot's current
# **position**, publishing **camera** images, sending a **navigation** goal, updating robot
# **parameters** (here the highest speed), and broadcasting the **battery** level.

# %% nbgrader={"grade": false, "grade_id": "patterns-answers", "locked": false, "schema_version": 3, "solution": true}
choices = {
    'position': None,
    'camera': None,
    'navigation': None,
    'parameters': None,
    'battery': None,
}
### BEGIN SOLUTION
choices = {
    'position': 'service',
    'camera': 'topic',
    'navigation': 'action',
    'parameters': 'service',
    'battery': 'topic',
}
### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-build", "locked": true, "schema_version": 3, "solution": false}
# ## Second half: build
#
# `Robot`, in the next cell, is the hardware: it keeps `self.position` and `self.charge` up to date
# and lets you `drive(speed)` and `take_picture()`. Derive your `RobotInterface` from it, or write
# everything from scratch on the same `hardware/...` topics. Which type you need follows from the
# pattern that you choose:
#
# - *On topics:* `sensor_msgs/Image` for pictures, `sensor_msgs/BatteryState` for the battery (its
#   `percentage` is 1.0 when full), `std_msgs/Float64` for metres and for metres per second,
#   `std_msgs/Int32` for a station.
# - *Services:* `std_srvs/Trigger` asks for something; its answer has `success` and a text `message`.
#   `rcl_interfaces/SetParameters` changes parameters: every node answers it for those that it
#   declares. A service of your own of this type is called `robot/max_speed`.
# - *Actions:* `Fibonacci` from the chapter, so that nothing needs to be compiled: a goal (`order`, the
#   station), feedback and a result (`sequence`, the stations passed). On your own robot this would be
#   a type of its own, such as Nav2's `NavigateToPose`.

# %% nbgrader={"grade": false, "grade_id": "patterns-given", "locked": true, "schema_version": 3, "solution": false}
# %load_ext course

import threading
import time

from example_interfaces.action import Fibonacci
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from sensor_msgs.msg import BatteryState, Image
from std_msgs.msg import Float64, Int32
from std_srvs.srv import Trigger


class Robot(Node):
    """The robot's hardware: where it is, how full its battery is, what makes it drive."""

    def __init__(self, name):
        super().__init__(name)
        self.position = 0.0  # m along the line; station 3 is at 3.0
        self.charge = 1.0  # 1.0 is full
        beside_all_others = ReentrantCallbackGroup()
        self.create_subscription(
            Float64, 'hardware/position', self._moved, 10, callback_group=beside_all_others
        )
        self.create_subscription(
            Float64, 'hardware/charge', self._charged, 10, callback_group=beside_all_others
        )
        self._motors = self.create_publisher(Float64, 'hardware/speed', 10)

    def drive(self, speed):
        """Drive at `speed` (m/s) from now on; 0.0 stops the robot."""
        self._motors.publish(Float64(data=float(speed)))

    def take_picture(self):
        """Return what the camera sees, as a message."""
        size = 16
        stamp = self.get_clock().now().to_msg()
        picture = Image(height=size, width=size, step=size, encoding='mono8')
        picture.header.stamp, picture.header.frame_id = stamp, 'camera'
        picture.data = bytes(range(size)) * size
        return picture

    def position_changed(self):
        """Called after `position` has changed; override it if you like."""

    def charge_changed(self):
        """Called after `charge` has changed; override it if you like."""

    def _moved(self, msg):
        self.position = msg.data
        self.position_changed()

    def _charged(self, msg):
        self.charge = msg.data
        self.charge_changed()


# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-your-work", "locked": true, "schema_version": 3, "solution": false}
# ## Your node
#
# The node below runs, and for it everything is a topic: try it, then change what does not fit. Keep
# the class name and the names of the list; the node's own name is free.

# %% nbgrader={"grade": false, "grade_id": "patterns-solution", "locked": false, "schema_version": 3, "solution": true}
class RobotInterface(Robot):
    """The robot as the rest of the system sees it. For now, everything is a topic."""

    def __init__(self):
        super().__init__('robot_interface')
        self.speed_limit = 0.5
        self.positions = self.create_publisher(Float64, 'robot/position', 10)
        self.pictures = self.create_publisher(Image, 'robot/camera', 10)
        self.levels = self.create_publisher(BatteryState, 'robot/battery', 10)
        self.create_subscription(Int32, 'robot/navigate', self.on_goal, 10)
        self.create_subscription(Float64, 'robot/max_speed', self.on_max_speed, 10)
        self.create_timer(2.0, self.publish_all)

    def publish_all(self):
        self.positions.publish(Float64(data=self.position))
        self.pictures.publish(self.take_picture())
        self.levels.publish(BatteryState(percentage=self.charge))

    def on_goal(self, msg):
        self.drive(self.speed_limit)

    def on_max_speed(self, msg):
        self.speed_limit = msg.data


### BEGIN SOLUTION
class RobotInterface(Robot):
    """The robot as the rest of the system sees it: each thing by the pattern that fits it."""

    def __init__(self):
        super().__init__('robot_interface')
        self.create_service(Trigger, 'robot/position', self.answer_position)

        self.camera = self.create_publisher(Image, 'robot/camera', qos_profile_sensor_data)
        self.create_timer(0.1, self.publish_picture)

        limits = FloatingPointRange(from_value=0.1, to_value=1.0)
        described = ParameterDescriptor(floating_point_range=[limits])
        self.declare_parameter('max_speed', 0.5, described)

        # Durable: a node that joins late is handed the last level at once.
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.battery = self.create_publisher(BatteryState, 'robot/battery', latched)

        self.navigation = ActionServer(
            self, Fibonacci, 'robot/navigate', self.navigate, cancel_callback=self.call_off
        )

    def answer_position(self, request, response):
        response.success, response.message = True, f'{self.position:.2f}'
        return response

    def publish_picture(self):
        self.camera.publish(self.take_picture())

    def charge_changed(self):
        self.battery.publish(BatteryState(percentage=self.charge))

    def call_off(self, goal_handle):
        return CancelResponse.ACCEPT

    def navigate(self, goal_handle):
        station, passed = int(self.position), []
        self.drive(self.get_parameter('max_speed').value)
        while station < goal_handle.request.order and not goal_handle.is_cancel_requested:
            if int(self.position) > station:
                station += 1
                passed.append(station)
                goal_handle.publish_feedback(Fibonacci.Feedback(sequence=passed))
            time.sleep(0.01)
        self.drive(0.0)
        if goal_handle.is_cancel_requested:
            goal_handle.canceled()
        else:
            goal_handle.succeed()
        return Fibonacci.Result(sequence=passed)
### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-how-to-check", "locked": true, "schema_version": 3, "solution": false}
# ## Check it yourself
#
# The next cell starts an examiner in a process of its own, for some seconds. It says for each check
# what was observed, what was needed, and why that matters on a robot; `check("patterns", hint=2)` in
# a cell of your own helps more, `hint=3` most. There are 20 points: 10 for these checks, 5 at grading
# (2 of them for your choices), 5 for your two answers.
#
# **Look inside**, in cells of your own after `import course`: `course.run(RobotInterface, threads=4)`
# (so it answers others, too, while a goal is under way), and then use it as an operator would.
# `course.session().service(name)` and `course.session().action(name)` are forms for a service and an
# action, `course.session().timeline(name)` shows a topic's messages,
# `course.session().parameters("robot_interface")` a node's parameters: whichever you chose. Without a
# world no motor turns, so a drive ends when you cancel it, or move the robot yourself:
# `%ros topic pub --once /hardware/position std_msgs/msg/Float64 "data: 3.0"` puts it at 3 m.

# %% nbgrader={"grade": true, "grade_id": "patterns-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("patterns")

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next two cells are empty for you: at grading the first examines a new speed limit, the battery
# level for who joins late, and a goal that is called off, and the second your five choices.

# %% nbgrader={"grade": true, "grade_id": "patterns-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("patterns", part="hidden")
### END HIDDEN TESTS

# %% nbgrader={"grade": true, "grade_id": "patterns-choices", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your choices are graded.
### BEGIN HIDDEN TESTS
check(
    "patterns",
    part="choices",
    key={
        "position": ["service", "topic"],
        "camera": ["topic"],
        "navigation": ["action"],
        "parameters": ["service"],
        "battery": ["topic"],
    },
)
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-question-position", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your choices
#
# Answer each question in three to five sentences. A person reads them: each gives 2.5 points, or a
# part of these if only a part of the question is answered.
#
# ### Position
#
# A planner needs the position once a minute, a controller 50 times a second, both over Wi-Fi. Which
# pattern suits each, and what would go wrong on the robot if each had the other's?

# %% [markdown] nbgrader={"grade": true, "grade_id": "patterns-explanation-position", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# The planner asks a service: it gets one answer, as fresh as its question, and pays nothing in
# between. If it had to listen to 50 messages a second for the one that it needs, it would fill the
# Wi-Fi and its own queue, and, once the link is gone, go on with the last one without knowing how old
# it is, whereas a call that is not answered says so. The controller listens to a topic: the newest
# message is there whenever it needs one, and nobody waits for anybody. With a service it would send
# 50 requests a second and wait each time for the way there and back, longer than its period of 20 ms
# when the Wi-Fi is slow; it would then steer late or stand still, and every further asker would make
# it worse.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-question-navigation", "locked": true, "schema_version": 3, "solution": false}
# ### Navigation
#
# “A plain topic with the number of the station would be simpler”, says the colleague who writes the
# fleet manager, “and a service would at least answer.” Which three things would each of the two lack
# on the robot, and what would you have to invent to make up for it?

# %% [markdown] nbgrader={"grade": true, "grade_id": "patterns-explanation-navigation", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Progress, the end, and calling off. With a topic nobody knows whether the goal was even heard, let
# alone accepted: the fleet manager sends the robot off and cannot tell “on its way” from “stuck” or
# “arrived”, and a stop for one drive may hit the next. A service call does answer, but only at the
# end, in minutes: until then no word of the stations passed, no way to take it back when somebody
# steps into the aisle, and a time-out in between leaves both sides in doubt whether the robot still
# drives. One would have to invent a number for each drive, a topic for progress, one for results, and
# a second service that cancels by that number: which is what an action is, with states that all tools
# know.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-hand-in", "locked": true, "schema_version": 3, "solution": false}
# **Hand in**: save this notebook, and hand in the file `patterns.ipynb` in the way of your course.
