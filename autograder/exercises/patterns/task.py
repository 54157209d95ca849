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
# A delivery robot follows a line through a warehouse. Stations 0, 1, 2, ... lie along it, one metre
# apart. The rest of the system (a map display, a remote control, a fleet manager) deals with the
# robot in five ways:
#
# 1. **position**: requesting the robot's current position;
# 2. **camera**: publishing camera images;
# 3. **navigation**: sending a navigation goal, a station to drive to;
# 4. **parameters**: updating robot parameters, here the highest speed;
# 5. **battery**: broadcasting the battery level.
#
# You do this exercise in two halves. First you **choose** for each scenario the most appropriate
# communication pattern: topic, service or action. Then you **build** the node that offers all five.
#
# Your node is examined by what it **does**. Another process plays the hardware and the rest of the
# system: it looks up in the ROS graph which pattern each of the five really is, and then uses it.
#
# **20 points:** 10 for the visible checks, 5 for what is examined when your work is graded (your
# five choices, and three more checks of your node), 5 for your explanations.

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-choose", "locked": true, "schema_version": 3, "solution": false}
# ## First half: choose
#
# Write `"topic"`, `"service"` or `"action"` for each scenario. The reasons come at the end.

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
# everything from scratch on the same `hardware/...` topics.
#
# | | Name | What the others rely on |
# |---|---|---|
# | position | `robot/position` | Whoever wants to know gets the robot's position in metres, never older than 0.5 s: also who begins to listen while the robot stands still and the hardware has nothing new. |
# | camera | `robot/camera` | 10 pictures a second (9 to 11). |
# | navigation | `robot/navigate` | Somebody names a station further along the line, and the robot drives there at `max_speed`. At each station they hear all stations that it has passed so far on this drive, in the order passed, and at the end, when it has stopped, all of the whole drive. They can call it off, at any moment: then the robot stops where it is, within 0.5 s, and does not wait for the next station; which stations the result then has is up to you. It stays there until the next goal, which begins there. All the others in this table go on while it drives, and after that. The aisle may be blocked for a while; then the robot waits, and where it is tells `hardware/position`, not the time. That comes every few centimetres, so hardly ever just at a station: one is passed when the robot is there, to within 5 cm, or beyond it. |
# | parameters | `max_speed` | The highest speed in m/s, 0.5 at the start. Whoever changes it hears whether the new value holds. Values from 0.1 to 1.0 are good; any other is refused with a reason, and the old one stays. A new value counts from the next goal on, or sooner. |
# | battery | `robot/battery` | Everyone who is interested knows a new level within 1 s. So does whoever joins later, within 1 s: the hardware reports the level only when it changes. |
#
# All five are there within 1 s after the node has started; what tells the battery level may wait for
# the first one. All times are those of the node's clock: `create_timer` and `self.get_clock()` go by it,
# `time.sleep` does not. The examiner moves that clock faster than the one on the wall.
#
# **Types.** Which one you need follows from the pattern that you choose.
#
# - *On topics:* `sensor_msgs/Image` for pictures, `sensor_msgs/BatteryState` for the battery (its
#   `percentage` is 1.0 when full), `std_msgs/Float64` for metres and for metres per second,
#   `std_msgs/Int32` for a station.
# - *Services:* `std_srvs/Trigger` asks for something; the answer has `success` and a text `message`,
#   which may hold a number, such as `'2.5'`. `rcl_interfaces/SetParameters` changes parameters: every
#   node answers it under `<name of the node>/set_parameters` for the parameters that it declares. A
#   service of your own of this type is called `robot/max_speed`.
# - *Actions:* `Fibonacci`, known from the chapter. It has what any action has, so that nothing needs
#   to be compiled here: a goal (`order`, the station), feedback and a result (`sequence`, the
#   stations passed). On your own robot this would be a type of its own, such as Nav2's
#   `NavigateToPose`.
#
# Four threads run the callbacks of your node, so one that sleeps does not hold up the others.

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
# The node below runs, and it follows the myth of the chapter: everything is a topic. Try it, then
# change what does not fit. Keep the class name and the names of the table.

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

        # Durable: whoever joins late is handed the last level at once.
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
# The next cell starts an examiner in a process of its own. For each check it says what was
# observed, what was needed, and why it matters on a robot. Ask for more help with
# `check("patterns", hint=2)` or `hint=3` in a cell of your own.
#
# **Look inside**, in cells of your own after `import course`: `course.run(RobotInterface, threads=4)`
# (so it answers others, too, while a goal is under way), and then use it as an operator would.
# `course.session().service(name)` and `course.session().action(name)` are forms for a service and an
# action, `course.session().timeline(name)` shows a topic's messages,
# `course.session().parameters("robot_interface")` a node's parameters: whichever you chose. No motor
# turns here, so a drive ends when you cancel it, or move the robot yourself:
# `%ros topic pub --once /hardware/position std_msgs/msg/Float64 "data: 3.0"` puts it at 3 m.

# %% nbgrader={"grade": true, "grade_id": "patterns-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("patterns")

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next two cells are empty for you. When your work is graded, the first examines three more
# lines of the table: a new speed limit takes effect, a late joiner learns the battery level, and a
# goal that is called off stops the robot. The second looks at your five choices.

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
# For each of the five scenarios say in one or two sentences why you chose this pattern, and what
# would go wrong on the robot with another one. An instructor reads this: each answer gives one
# point, or half a point if only a part of the question is answered.
#
# ### Position
#
# Who asks, and how often? What may an asker do with the answer?

# %% [markdown] nbgrader={"grade": true, "grade_id": "patterns-explanation-position", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# A service: one node asks now and then and goes on with the one answer, which is as fresh as the
# question. As a topic, which most robots have as well, the newest message answers the same question
# without asking; an action would need a goal handle for an answer that is there at once.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-question-camera", "locked": true, "schema_version": 3, "solution": false}
# ### Camera
#
# Who waits for whom? Think of several subscribers, and of none.

# %% [markdown] nbgrader={"grade": true, "grade_id": "patterns-explanation-camera", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# A topic: pictures come all the time and any number of nodes looks at them. The driver must wait
# for none of them; with a service each viewer would have to ask ten times a second.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-question-navigation", "locked": true, "schema_version": 3, "solution": false}
# ### Navigation
#
# How long does it take? What are feedback and cancelling needed for?

# %% [markdown] nbgrader={"grade": true, "grade_id": "patterns-explanation-navigation", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# An action: the drive takes minutes. Whoever sent the robot wants to see how far it is and must be
# able to call it off; a service call would hang until the end, a message on a topic would tell
# nobody whether the robot ever arrived.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-question-parameters", "locked": true, "schema_version": 3, "solution": false}
# ### Parameters
#
# What does whoever changes a value have to hear back? What if nobody said it?

# %% [markdown] nbgrader={"grade": true, "grade_id": "patterns-explanation-parameters", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# A service: quick, and the answer matters, as the value is taken, or refused with a reason. ROS 2's
# own parameter services are made for this. On a topic a bad value would be dropped without a word.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "patterns-question-battery", "locked": true, "schema_version": 3, "solution": false}
# ### Battery
#
# How does everybody learn the level? How does one who joins late?

# %% [markdown] nbgrader={"grade": true, "grade_id": "patterns-explanation-battery", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# A topic: everyone may listen and nobody needs to ask. The last level stays available for those who
# join late: transient local, or published again every second.
# ### END SOLUTION
