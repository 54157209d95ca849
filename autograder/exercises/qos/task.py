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

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-task", "locked": true, "schema_version": 3, "solution": false}
# # Exercise 1: QoS profile design
#
# A delivery robot drives through a warehouse with a camera, a LIDAR, an IMU and an emergency stop
# button. Their readings travel over four topics, and for each of them **you** decide what DDS
# promises: reliability, durability, history and depth.
#
# | Sensor | Topic | Type | What the robot needs |
# |---|---|---|---|
# | camera | `camera/image` | `sensor_msgs/Image`, 10 Hz | A live picture over Wi-Fi. A lost frame is gone: nothing newer may wait for it, and after a gap in the radio link none is sent again. After a pause a consumer goes on with the newest frames, at most the last 10 (1 s). |
# | LIDAR | `scan` | `sensor_msgs/LaserScan`, 10 Hz | Obstacle avoidance wants the latest scan. After a pause nothing older than 0.5 s (5 scans) is acted on. |
# | IMU | `imu/data` | `sensor_msgs/Imu`, 100 Hz | State estimation may be busy for 50 ms (5 readings) and must still see each of them, once, but never more than the last 0.5 s (50 readings). |
# | emergency stop | `emergency/stop` | `std_msgs/String`, on each press and release; one press reads like another | Every event, once and in order, at every consumer, whichever reliability it asks for. Up to 100 events can queue up while a consumer is busy or out of radio range; whoever comes back into range gets all that it missed. A driver that is busy for a moment finds up to 4. |
#
# And one rule for camera, LIDAR and IMU together: a node that starts late must not be handed old
# readings, not even if it asks for them; nor does a driver publish a reading again. Whether the
# emergency stop remembers its last event for late joiners is up to you.
#
# The drivers publish each reading as soon as the hardware delivers it, at most 0.1 s later, with
# its content unchanged; the consumers hand on, in order, what they act on: they may change its
# header and clean its content, but not leave it out, not even if it reads like the one before. On
# `emergency/stop` and `consumer/emergency_stop` come stop events and nothing else. What a consumer
# already held before a pause does not count against it. And it keeps up while readings come in: a
# list that fills faster than it is emptied, or is always full, is a queue, too, and the same bounds
# hold for it.
#
# Each node has all its publishers and subscriptions once its constructor has returned, whether or
# not anybody listens yet.
#
# Your work is examined by what your nodes **do**. Another process plays the hardware, keeps your
# consumer busy, joins late, and listens on the wire. How you write it is your choice; every design
# that does what the table says gets full marks.
#
# **20 points:** 10 for the visible checks, 5 for checks that run when your work is graded, 5 for
# your explanations.

# %% nbgrader={"grade": false, "grade_id": "qos-given", "locked": true, "schema_version": 3, "solution": false}
# %load_ext course

from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from sensor_msgs.msg import Image, Imu, LaserScan
from std_msgs.msg import String

# Inside the robot readings travel over a cable that loses nothing. This profile is given.
CABLE = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)


class Relay(Node):
    """A node that passes messages on: what arrives on one topic leaves on another."""

    def relay(self, msg_type, source, target, *, source_qos=CABLE, target_qos=CABLE):
        """Subscribe to `source`, publish each message on `target`."""
        publisher = self.create_publisher(msg_type, target, target_qos)
        return self.create_subscription(msg_type, source, publisher.publish, source_qos)


# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-your-work", "locked": true, "schema_version": 3, "solution": false}
# ## Your design
#
# The cell below runs as it is, but its profiles are all the same: every loss is repaired, the last
# 80 are kept, and who comes late is handed them. That is too much for some sensors, and too little
# for another. Give each what it needs. The drivers offer a profile, the consumers request one; they
# may be equal or differ, as long as DDS connects them.
#
# Keep the two class names and the topic names. Everything else may change: you can drop `Relay`
# and write both nodes from scratch.

# %% nbgrader={"grade": false, "grade_id": "qos-solution", "locked": false, "schema_version": 3, "solution": true}
camera_qos = QoSProfile(depth=80, durability=DurabilityPolicy.TRANSIENT_LOCAL)
lidar_qos = QoSProfile(depth=80, durability=DurabilityPolicy.TRANSIENT_LOCAL)
imu_qos = QoSProfile(depth=80, durability=DurabilityPolicy.TRANSIENT_LOCAL)
stop_qos = QoSProfile(depth=80, durability=DurabilityPolicy.TRANSIENT_LOCAL)
### BEGIN SOLUTION
camera_qos = QoSProfile(
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
    history=HistoryPolicy.KEEP_LAST,
    depth=5,
)
lidar_qos = QoSProfile(
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
)
imu_qos = QoSProfile(
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
    history=HistoryPolicy.KEEP_LAST,
    depth=10,
)
stop_qos = QoSProfile(
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
    history=HistoryPolicy.KEEP_ALL,
)
### END SOLUTION


class SensorDrivers(Relay):
    """Publishes what the hardware delivers."""

    def __init__(self):
        super().__init__('sensor_drivers')
        self.relay(Image, 'hardware/camera', 'camera/image', target_qos=camera_qos)
        self.relay(LaserScan, 'hardware/lidar', 'scan', target_qos=lidar_qos)
        self.relay(Imu, 'hardware/imu', 'imu/data', target_qos=imu_qos)
        self.relay(String, 'hardware/emergency_stop', 'emergency/stop', target_qos=stop_qos)


class SensorConsumers(Relay):
    """Hands each sensor's readings to the part of the robot that needs them."""

    def __init__(self):
        super().__init__('sensor_consumers')
        self.relay(Image, 'camera/image', 'consumer/camera', source_qos=camera_qos)
        self.relay(LaserScan, 'scan', 'consumer/lidar', source_qos=lidar_qos)
        self.relay(Imu, 'imu/data', 'consumer/imu', source_qos=imu_qos)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=stop_qos)


# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-how-to-check", "locked": true, "schema_version": 3, "solution": false}
# ## Check it yourself
#
# The next cell starts an examiner in a process of its own. It takes a few seconds. For each check
# it says what was observed, what was needed, and why it matters on a robot. Ask for more help with
# `check("qos", hint=2)` or `hint=3` in a cell of your own.
#
# **Look inside**, in cells of your own after `import course`.
# `course.session().qos_lab(offered=lidar_qos, requested=lidar_qos)` tries two profiles on a late
# joiner, a slow reader and a lossy link. And after `course.run(SensorDrivers)` and
# `course.run(SensorConsumers)`, `course.session().graph()` shows in red what DDS refuses to connect.

# %% nbgrader={"grade": true, "grade_id": "qos-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("qos")

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next cell is empty for you. When your work is graded, it examines the rest of the table: the
# IMU's burst, a gap in the radio link, in which every packet is lost, and the node that starts late.

# %% nbgrader={"grade": true, "grade_id": "qos-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("qos", part="hidden")
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-question-loss", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your choices
#
# Say in two or three sentences each what you chose, why, and what would happen on the robot with
# the opposite choice. An instructor reads this: each answer gives one point, or half a point if
# only a part of the question is answered.
#
# ### A lost camera frame
#
# Who re-sends it, if anybody does, and why is a late frame worse than a lost one?

# %% [markdown] nbgrader={"grade": true, "grade_id": "qos-explanation-loss", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Nobody: the camera is best effort, volatile, keep last 5. A lost frame is replaced by the next one
# 100 ms later. A reliable writer would send it again until it is acknowledged, which holds up newer
# frames and freezes the picture.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-question-stop", "locked": true, "schema_version": 3, "solution": false}
# ### A lost stop event
#
# What may never happen, and which policies prevent it?

# %% [markdown] nbgrader={"grade": true, "grade_id": "qos-explanation-stop", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# No event may get lost on the way or in a queue, or the robot drives on. Reliable sends it again
# until it has arrived, and keep all holds each one until a busy consumer has handled it; with a
# short queue a later event would push the stop out.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-question-durability", "locked": true, "schema_version": 3, "solution": false}
# ### Durability
#
# What does a node that starts late get, and why is old sensor data a danger?

# %% [markdown] nbgrader={"grade": true, "grade_id": "qos-explanation-durability", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Nothing that was sent before: all four are volatile, and it begins with the next reading. A scan
# of a minute ago shows free way where somebody stands by now. For the stop, transient local is
# right as well: the state counts, and who starts late should know it.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-question-depth", "locked": true, "schema_version": 3, "solution": false}
# ### History and depth
#
# What does a busy consumer find in its queue, for the LIDAR and for the IMU, and why the
# difference?

# %% [markdown] nbgrader={"grade": true, "grade_id": "qos-explanation-depth", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# LIDAR, keep last 1: the newest scan and no other, because only the present obstacles count. IMU,
# keep last 10: the readings of 100 ms, each of which is a part of the angle; enough for a busy
# estimator, too little to steer by the past.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-question-compatibility", "locked": true, "schema_version": 3, "solution": false}
# ### Compatibility
#
# What happens if a consumer asks for more than the driver offers, and where did you have to think
# of that?

# %% [markdown] nbgrader={"grade": true, "grade_id": "qos-explanation-compatibility", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# DDS refuses the connection, and nothing arrives at all. A driver that offers RELIABLE also serves
# consumers that ask for BEST_EFFORT, so stop, IMU and LIDAR offer it; the camera is best effort, so
# no consumer may insist on RELIABLE there.
# ### END SOLUTION
