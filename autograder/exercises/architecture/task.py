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
# ![A robot drives to a waypoint around a shelf; above it six jobs are joined by arrows, from the sensors to the motors.](architecture.svg)
#
# **You** declare the nodes that drive the robot to a waypoint, around obstacles. This takes about 60
# minutes.

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-must-do", "locked": true, "schema_version": 3, "solution": false}
# ## What it must do
#
# - **Drivers** publish `scan`, `camera/image` and `wheel/odometry`.
# - **State estimation** reads a sensor and publishes the robot's pose.
# - **Obstacle detection** reads `scan` or `camera/image`, and publishes what is in the way. That gets
#   to the motors unasked.
# - **Path planning** is a service. Its node knows the `map`, and a node that has the goal calls it.
# - **Navigation** is the server of the action `navigate_to`, and topics tell it what the sensors see.
# - **Control**: exactly one node publishes `motors/command`, and navigation leads to it.
#
# A node does at most **two** of these jobs; further nodes are welcome. Nothing dangles: each topic
# has a writer and a reader, each service and action a server, and QoS fits.

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-try-it", "locked": true, "schema_version": 3, "solution": false}
# ## Try it
#
# Once the cells below have run, in a cell of your own:
#
# ```python
# world = course.world("warehouse"); world.add_obstacle(6.4, 1.3, 0.25); display(world)
# design.drive(world, to="dock")   # it says what your nodes cannot do
# ```
#
# `course.session().graph()` draws the nodes, and `course.session().diagnose()` finds faults.

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-fine-print", "locked": true, "schema_version": 3, "solution": false}
# <details><summary>What exactly is examined</summary>
#
# Another process brings the design up and reads the ROS graph. Nobody reads your code, and inside the
# robot nodes, topics and services may be called anything. Only its boundary is fixed:
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
# **The design comes up** (no points; all else needs it): each node that `design` declares is on the
# graph, and so are all its endpoints when its constructor has returned.
#
# **Drivers** (1 point): each of the three sensors' topics has a publisher of its type.
#
# **Navigation** (2 points)
#
# - Exactly one node is the server of `navigate_to`.
# - A topic brings it what the sensors see: a reading, obstacle information or the pose; one of them
#   is enough. A topic that can say only that somebody is there (a `Bool`, an `Empty`) is not.
#
# **Obstacle detection** (2 points)
#
# - A node that reads `scan` or `camera/image` publishes obstacle information, another node reads
#   that, and from there links lead to the motors.
# - Types that fit are `PointCloud2`, `PoseArray`, `PointStamped`, `PolygonStamped`, `OccupancyGrid`,
#   `Range`, `Float32`, `Float32MultiArray`, `String` and most others. Not these: a reading again
#   (`LaserScan`, `Image`, `CompressedImage`, `CameraInfo`, `Imu`, `Odometry`), one robot's pose
#   (`Pose`, `PoseStamped`, `PoseWithCovariance`, `PoseWithCovarianceStamped`), a velocity (the four
#   `Twist` types), a `Path`, a `DiagnosticArray`; nor `Bool`, `Empty`, `Header`, `ColorRGBA`, `Time`
#   and `Duration`, which cannot say where. It needs a number of 32 bits or more, or a text, as its
#   way is followed at the end; so `UInt16` and smaller do not do. The type is an installed one.
# - The node of navigation and that of the motors may read the sensors, too, as a collision monitor
#   does. But that is no detection: another node does it.
#
# **State estimation** (1 point)
#
# - A node that reads a sensor, or is the driver of one, publishes the pose: as `Odometry` or one of
#   the four Pose types above, on a topic other than `wheel/odometry`. Another sensor than the three
#   (an IMU) is one as well. Navigation's node does not do it.
# - If that node reads nothing but odometry, scans and the map, a pose comes while the wheels report.
#
# **Path planning** (1 point)
#
# - A node that knows the map (it reads it, asks for it, or hands it out) serves planning. A service
#   that hands out or loads the map is another one.
# - Another node calls it, one that the goal can get to from `navigate_to`. The goal comes with the
#   request, which then has a number or a text in it, or over topics.
#
# **Control** (2 points): one node, and no other, publishes `motors/command`, as `Twist`. From
# navigation topics, services or goals lead to it. Navigation and control may be one node: these are
# two jobs.
#
# **Links** (1 point)
#
# - Every topic has a writer and a reader, and at least one leads from one node to another; each
#   client of a service or an action finds one server; and the QoS of both sides fits, that of services,
#   too. Only `motors/command` is read, and `navigate_to` used, by somebody outside.
# - Each node has a full name of its own: `/front/driver` beside `/rear/driver` is right.
#
# **At grading** (5 points)
#
# - From obstacle information to `motors/command` there is a way of topics and action goals alone (1).
# - No node does more than two of the six jobs. Where several publish what looks like a pose or like
#   obstacles, that job counts for the one that has the least else to do (1).
# - A goal that is sent to `navigate_to` comes out at `motors/command`, the next is taken when the one
#   before is over or cancelled, and planning answers (1).
# - A scan comes out in obstacle information, and what is published there comes out at the motors,
#   on a topic that their node reads or with goals (an image, if the detection reads no scan). What
#   comes up meanwhile keeps to the same rules (2).
#
# For the last two, dye is poured in: messages and goals that bear a mark, in a `frame_id`, a text or a
# number. Eight are sent one after the other, and two that arrive are enough. A mark has 1 s; of the
# eight goals the last three have 4 s. The nodes that the library makes pass marks on by themselves.
# **Only for nodes that you write yourself**:
#
# - Pass a mark on by copying the header of what you received, or with
#   `course.design.carry(received, sent)` just before you send.
# - Turn no message away because of its `frame_id`, a text or its numbers.
# - Work on each message that comes in, or at least twice a second on the newest, also if nothing has
#   changed. A driver of your own may go on publishing: a marked reading comes right after its own.
# - A node that yours makes for itself counts as one more node, and what two nodes hand each other in
#   Python is no link.
#
# </details>

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
# notebook as the examiner does: its nodes only pass marks on. `design.drive(...)` lets them work. If you prefer plain data, see `help(course.Design.from_data)`, and if you would rather
# write a node yourself, `help(course.Design.node)`.
#
# ## Your design
#
# The cell below runs as it is: one driver that nobody listens to. Make it a robot. Keep the name
# `design`. The drawing below it has round shapes for nodes, boxes for topics, hexagons for services,
# and framed boxes for actions.

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
# The next cell starts an examiner in a process of its own, for some seconds. It says for each check
# what was observed, what was needed, and why that matters on a robot; `check("architecture", hint=2)`
# in a cell of your own helps more, `hint=3` most. There are 20 points: 10 for these checks, 5 at
# grading, 5 for your two answers.

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
# Two answers of two to four sentences each. An instructor reads them: 2.5 points each, and a part of
# the question answered is a part of the points.
#
# ### Nodes and patterns
#
# Why is the work divided where it is, and why is navigation an action but planning a service? Name
# one case in which that pays: a new sensor, a crash, a test.

# %% [markdown] nbgrader={"grade": true, "grade_id": "architecture-explanation-nodes", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Each sensor has a driver, so that a new LIDAR means one new node; detection can be tested with
# recorded scans and restarted while the robot goes on; one controller alone commands the motors.
# Driving takes minutes, so the sender of a goal wants to see progress and to cancel: an action. A
# path is needed once a goal, or when the way is blocked: one question, one answer, a service.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-question-links", "locked": true, "schema_version": 3, "solution": false}
# ### When a part fails
#
# Choose two of your nodes. What does the robot do when each of them is gone, how do the others notice
# it, and why is that safe, or what would you add?

# %% [markdown] nbgrader={"grade": true, "grade_id": "architecture-explanation-links", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Without the LIDAR's driver no obstacles come. Navigation reads them ten times a second: after half a
# second of silence it must stop and abort its goal, as no obstacle heard is not the same as none
# there. Without the planner a call is not answered: navigation waits with a time-out and keeps to
# the path that it has, or stops. If navigation itself dies, no velocity comes any more, and the
# controller should stop the motors by itself after a time-out.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "architecture-hand-in", "locked": true, "schema_version": 3, "solution": false}
# **Hand in**: save this notebook, and hand in the file `architecture.ipynb` in the way of your course.
