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

# %% [markdown] nbgrader={"grade": false, "grade_id": "parameters-task", "locked": true, "schema_version": 3, "solution": false}
# # Exercise 6.1: Parameters and timers
#
# A robot's heartbeat tells a supervisor that the robot is alive. How often it beats is for an operator
# to choose, while the robot runs. You write the node `Heartbeat`.
#
# | | Name | Type | What it does |
# |---|---|---|---|
# | publishes | `heartbeat` | `std_msgs/msg/Int32` | a count: 1, 2, 3, ... |
# | parameter | `rate` | double, 1.0 at first | beats a second, with a description |
# | serves | `heartbeat/pause` | `std_srvs/srv/SetBool` | `True` pauses the beats, `False` resumes them |
#
# 1. **The count** begins at 1 and has no gaps, through every change and every pause.
# 2. **The rate** may be changed at any time, to a number from 0.1 to 10, both included. The new one
#    holds within one period of the old one. Everything else is refused with a reason: a number out of
#    bounds, infinity, not-a-number, a text. A refused value changes nothing.
# 3. **While it is paused** nothing comes, also when it is paused twice or its rate is changed. Both
#    answers of the service are `success=True`.
# 4. **When the node is destroyed** by `destroy_node()`, nothing of it is left on the graph, and no
#    beat comes any more.
#
# The node is examined on simulated time, which goes by quickly: beats are timed by the node's clock,
# as a timer of the node is. A beat more or less in ten does no harm. How you write it is your choice:
# one timer or several, a thread, callbacks of any kind.
#
# **20 points:** 12 for the visible checks, 4 for checks that run when your work is graded, 4 for two
# written answers.

# %% nbgrader={"grade": false, "grade_id": "parameters-given", "locked": true, "schema_version": 3, "solution": false}
import math
import threading

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Int32
from std_srvs.srv import SetBool

# %% [markdown] nbgrader={"grade": false, "grade_id": "parameters-your-work", "locked": true, "schema_version": 3, "solution": false}
# ## Your node
#
# The cell below runs as it is: a node that is silent.

# %% nbgrader={"grade": false, "grade_id": "parameters-solution", "locked": false, "schema_version": 3, "solution": true}
class Heartbeat(Node):
    """Beats at the rate that its parameter says, unless it is paused."""

    def __init__(self):
        super().__init__('heartbeat')
        self.beats = self.create_publisher(Int32, 'heartbeat', 10)
        ### BEGIN SOLUTION
        self.count = 0
        self.paused = False
        about = ParameterDescriptor(description='Beats a second, from 0.1 to 10.')
        rate = self.declare_parameter('rate', 1.0, about).value
        self.timer = self.create_timer(1.0 / rate, self.beat)
        self.add_on_set_parameters_callback(self.check_rate)
        self.add_post_set_parameters_callback(self.change_rate)
        self.create_service(SetBool, 'heartbeat/pause', self.pause)

    def beat(self):
        self.count += 1
        self.beats.publish(Int32(data=self.count))

    def check_rate(self, parameters):
        for parameter in parameters:
            if parameter.name != 'rate':
                continue
            if parameter.type_ != Parameter.Type.DOUBLE or not 0.1 <= parameter.value <= 10.0:
                reason = 'rate is a number from 0.1 to 10'
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def change_rate(self, parameters):
        for parameter in parameters:
            if parameter.name == 'rate':
                self.destroy_timer(self.timer)
                self.timer = self.create_timer(1.0 / parameter.value, self.beat)
                if self.paused:
                    self.timer.cancel()

    def pause(self, request, response):
        if request.data:
            self.timer.cancel()
        elif self.paused:
            self.timer.reset()
        self.paused = request.data
        response.success = True
        return response
        ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "parameters-how-to-check", "locked": true, "schema_version": 3, "solution": false}
# ## Check it yourself
#
# `course.run(Heartbeat)` runs your node here; then try `%ros param set /heartbeat rate 4.0` and
# `%ros topic echo /heartbeat`. The next cell examines it.

# %% nbgrader={"grade": true, "grade_id": "parameters-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("parameters")

# %% [markdown] nbgrader={"grade": false, "grade_id": "parameters-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next cell is empty for you. When your work is graded, it examines the end of rule 3, and rule 4.

# %% nbgrader={"grade": true, "grade_id": "parameters-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("parameters", part="hidden")
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "parameters-question-callbacks", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your choices
#
# Two or three sentences each. An instructor reads this: each answer gives two points, or one if only
# a part of the question is answered.
#
# ### Two callbacks
#
# Why is a value checked in one callback and used in another? What could happen if the first one used
# it at once?

# %% [markdown] nbgrader={"grade": true, "grade_id": "parameters-explanation-callbacks", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# The first is asked before anything has changed, and others may still refuse: a node has several such
# callbacks, and several parameters may be set together, all or none. A timer that was changed in it
# would go by a rate that the parameter never gets. The second is called when the change is certain.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "parameters-question-clock", "locked": true, "schema_version": 3, "solution": false}
# ### The node's clock
#
# Why does the node beat by its own clock and not by `time.sleep`? What would a supervisor see on a
# robot that is simulated at half its speed?

# %% [markdown] nbgrader={"grade": true, "grade_id": "parameters-explanation-clock", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# All nodes of a robot share one time, which a simulation or a recording may move faster or slower
# than the wall clock. A beat by the wall clock would come twice as often as the rate says at half
# speed, and go on while the simulation is stopped. And sleep would keep the executor from running
# other callbacks, such as that of the service.
# ### END SOLUTION
