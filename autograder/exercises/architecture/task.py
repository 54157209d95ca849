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

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-task", "locked": true, "schema_version": 3, "solution": false}
# # Exercise 2: Node architecture
#
# The delivery robot gets a waypoint and drives there, around whatever stands in its way. You decide
# **which nodes** it has, **what connects them**, and **by which pattern**: topic, service or action.
# You declare the design; the library brings it up as real ROS 2 nodes and draws it.
#
# Only the robot's boundary is fixed:
#
# | Name | Type | What it is |
# |---|---|---|
# | `scan` | topic, `sensor_msgs/LaserScan` | what the LIDAR sees |
# | `camera/image` | topic, `sensor_msgs/Image` | what the camera sees |
# | `wheel/odometry` | topic, `nav_msgs/Odometry` | what the wheel encoders count |
# | `map` | topic, `nav_msgs/OccupancyGrid` | the map of the warehouse, which a node of yours publishes (or serves, as `nav_msgs/GetMap`) |
# | `navigate_to` | action, `NavigateTo` below or any other that is installed | a person sends a waypoint, follows the progress, may cancel |
# | `motors/command` | topic, `geometry_msgs/Twist` | the motors' electronics carries it out |
#
# Six jobs have to be done:
#
# 1. **Drivers** publish the readings of all three sensors.
# 2. **State estimation** reads one sensor or more (an IMU that you add is one, too), or is the driver
#    of one, and publishes the robot's pose: as `Odometry` or one of the Pose types (`Pose`,
#    `PoseStamped`, `PoseWithCovariance`, `PoseWithCovarianceStamped`), on a topic other than
#    `wheel/odometry`. The navigation node does not do this.
# 3. **Obstacle detection** reads `scan` or `camera/image` and publishes obstacle information: of
#    another type than a reading (so no `LaserScan` and no `Image`), not a velocity, a pose, a path
#    or diagnostics, able to say where or how far (a `Bool`, a time, a colour or a bare `Header` is
#    not), and with room for a 32-bit number or a text (a `UInt16` has none). Another node reads it.
#    Navigation and control do not do the detection.
# 4. **Path planning** is a service. Its node knows the map: it reads it, or is the one that hands it
#    out. Another node, which has the goal, calls it, and the request (or a topic) brings the goal.
# 5. **Navigation** is the server of the action `navigate_to` and accepts its goals: whenever one is
#    over, the next. Topics bring it what the sensors see: readings, obstacle information, or the
#    pose.
# 6. **Control**: exactly one node publishes `motors/command`. From the navigation node links lead to
#    it: topics, services or action goals, whichever you like.
#
# And four rules for the whole:
#
# - A node takes on at most **two** of the six jobs. Any further nodes are welcome.
# - What obstacle detection finds reaches the motors **as a stream**: over topics or action goals,
#    without anybody having to ask a service for it.
# - **Nothing dangles**: every topic has a writer and a reader, whoever calls a service or sends
#   goals finds one server, and the QoS of the two sides fits, that of services, too. Every node has
#   a name of its own. Only `motors/command` is read, and `navigate_to` used, by someone outside
#   your design.
# - Use message types that are installed (`std_msgs`, `geometry_msgs`, `sensor_msgs`, `nav_msgs`,
#   `diagnostic_msgs`, …).
#
# Your design is examined as it comes up on the ROS graph. At the end dye is poured in: a marked
# goal and a marked scan (a marked image, if the node that detects obstacles does not read the scan),
# which each node of the design passes on along its links. Both marks must reach `motors/command`.
# The nodes that the library makes do that by themselves. A node that you write yourself passes a
# mark on by copying the header of what it received, or with `course.design.carry(received, sent)`,
# just before it sends. A mark stands in a message's `frame_id` or, where there is none, in its text
# or its numbers, so turn no message away because of these. While scans are poured in, a goal is
# under way; before another goal is sent, the one before is cancelled.
#
# So that this can be seen from outside, nodes that you write yourself keep to the following. All
# endpoints are there when the constructor returns. A node works on each message that comes in, or
# at least twice a second on the newest, also if nothing has changed. While the wheels report, the
# pose is published. A goal gets to the motors within two seconds. And a further node that one of
# yours makes for itself counts as one more node: what the two hand each other in Python is no link.
#
# **20 points:** 10 for the visible checks, 5 for checks that run when your work is graded, 5 for
# your explanations.

# %% nbgrader={"grade": false, "grade_id": "architecture-given", "locked": true, "schema_version": 3, "solution": false}
# %load_ext course

import course
from course.interfaces import InterfaceError, define
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import (
    Point,
    PointStamped,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    Twist,
)
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from nav_msgs.srv import GetMap, GetPlan
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from sensor_msgs.msg import Image, Imu, LaserScan, PointCloud2
from std_msgs.msg import Float32, Float32MultiArray, String
from std_srvs.srv import Trigger

try:
    NavigateTo = define(
        'robot_msgs/action/NavigateTo',
        """\
geometry_msgs/PoseStamped waypoint
---
bool arrived
string message
---
float32 distance_left
""",
    )
except InterfaceError:  # no compiler here: an installed action stands in
    from test_msgs.action import NestedMessage as NavigateTo

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-how", "locked": true, "schema_version": 3, "solution": false}
# ## How to declare a design
#
# `design.node(name)` declares a node. Its methods add endpoints, and can be chained:
#
# | Method | The node |
# |---|---|
# | `.publishes(topic, type, qos)` | publishes on a topic |
# | `.subscribes(topic, type, qos)` | subscribes to a topic |
# | `.serves(service, type)` | answers a service's requests |
# | `.calls(service, type)` | calls a service |
# | `.action_server(action, type)` | carries out an action's goals |
# | `.action_client(action, type)` | sends goals to an action |
#
# `qos` is a `QoSProfile` or a depth, and can be left out (reliable, volatile, the last 10).
# `print(design)` lists the design and what is worth another look; `design.run()` brings it up in this
# notebook. If you prefer plain data, see `help(course.Design.from_data)`, and if you would rather
# write a node yourself, `help(course.Design.node)`.
#
# ## Your design
#
# The cell below runs as it is: one driver that nobody listens to. Make it a robot. Keep the name
# `design`.

# %% nbgrader={"grade": false, "grade_id": "architecture-solution", "locked": false, "schema_version": 3, "solution": true}
design = course.Design(outside=['motors/command', 'navigate_to'])

design.node('lidar_driver').publishes('scan', LaserScan, qos_profile_sensor_data)

### BEGIN SOLUTION
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

(design.node('camera_driver')
    .publishes('camera/image', Image, qos_profile_sensor_data))
(design.node('wheel_driver')
    .publishes('wheel/odometry', Odometry))
(design.node('map_server')
    .publishes('map', OccupancyGrid, latched))
(design.node('state_estimation')
    .subscribes('wheel/odometry', Odometry)
    .subscribes('scan', LaserScan, qos_profile_sensor_data)
    .publishes('pose', PoseWithCovarianceStamped))
(design.node('obstacle_detection')
    .subscribes('scan', LaserScan, qos_profile_sensor_data)
    .subscribes('camera/image', Image, qos_profile_sensor_data)
    .publishes('obstacles', PoseArray))
(design.node('path_planner')
    .subscribes('map', OccupancyGrid, latched)
    .serves('plan_path', GetPlan))
(design.node('navigation')
    .action_server('navigate_to', NavigateTo)
    .subscribes('pose', PoseWithCovarianceStamped)
    .subscribes('obstacles', PoseArray)
    .calls('plan_path', GetPlan)
    .publishes('velocity', Twist))
(design.node('controller')
    .subscribes('velocity', Twist)
    .publishes('motors/command', Twist))
### END SOLUTION

# %% nbgrader={"grade": false, "grade_id": "architecture-drawing", "locked": true, "schema_version": 3, "solution": false}
design

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-how-to-check", "locked": true, "schema_version": 3, "solution": false}
# ## Check it yourself
#
# Above, round shapes are nodes, boxes topics, hexagons services, and framed boxes actions.
#
# The next cell starts an examiner in a process of its own, which brings the design up and reads the
# ROS graph. For each check it says what was observed, what was needed, and why it matters on a
# robot. Ask for more help with `check("architecture", hint=2)` or `hint=3` in a cell of your own.
#
# **Look inside**, in cells of your own after `import course`: `design.run()`, and then
# `course.session().graph()` draws the nodes as they really came up, with what is not connected in
# red; `course.session().diagnose()` says in words what is wrong with it.

# %% nbgrader={"grade": true, "grade_id": "architecture-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("architecture")

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next cell is empty for you. When your work is graded, it examines the first two rules and pours
# in the dye.

# %% nbgrader={"grade": true, "grade_id": "architecture-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("architecture", part="hidden")
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-question-nodes", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your design
#
# Defend your design in two or three sentences each. An instructor reads this: each answer gives one
# point, or half a point if only a part of the question is answered.
#
# ### Nodes
#
# Why is the work divided where it is? Name one case in which that pays (a new sensor, a crash, a
# test).

# %% [markdown] nbgrader={"grade": true, "grade_id": "architecture-explanation-nodes", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Each sensor has a driver, so that a new LIDAR means one new node. State estimation and obstacle
# detection turn readings into a pose and obstacles; both can be tested with recordings. Navigation
# decides, the controller only turns its decision into wheel speeds, so that there is one place that
# commands the motors.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-question-action", "locked": true, "schema_version": 3, "solution": false}
# ### Action
#
# Why is navigation an action, and what would it lose as a service or as a topic?

# %% [markdown] nbgrader={"grade": true, "grade_id": "architecture-explanation-action", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Driving takes minutes: the person who sent the goal wants to see progress and to cancel. A service
# would keep the caller waiting without a word; a topic would have no result.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-question-service", "locked": true, "schema_version": 3, "solution": false}
# ### Service
#
# Why is planning a service, and what does the caller do while it waits?

# %% [markdown] nbgrader={"grade": true, "grade_id": "architecture-explanation-service", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# A path is needed once a goal, or when the way is blocked: one question, one answer. Navigation
# calls asynchronously and goes on reading obstacles meanwhile.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-question-topics", "locked": true, "schema_version": 3, "solution": false}
# ### Topics
#
# How does obstacle information get to the motors, and why does nobody ask for it?

# %% [markdown] nbgrader={"grade": true, "grade_id": "architecture-explanation-topics", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Scans become obstacles ten times a second, and navigation slows down or turns with each of them.
# If it had to ask, an obstacle would be as old as the last question.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-question-links", "locked": true, "schema_version": 3, "solution": false}
# ### QoS or failure
#
# Name one link whose QoS you chose and say why, or say what the robot does when one of your nodes
# is gone, and why that is safe.

# %% [markdown] nbgrader={"grade": true, "grade_id": "architecture-explanation-links", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# The map is transient local: it is published once, and a planner that restarts still gets it. Scans
# are best effort, because the next one is better than a late one.
# ### END SOLUTION
