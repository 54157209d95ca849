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
# ![A delivery robot sends camera frames, scans, IMU readings and stop events over Wi-Fi; at the other end they wait in four queues.](qos-design.svg)
#
# A delivery robot sends over Wi-Fi what its sensors see. Now and then the radio loses a packet, or a
# node is busy. For each sensor **you** decide what DDS then promises: reliability, durability,
# history and depth. This takes about 45 minutes.

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-must-do", "locked": true, "schema_version": 3, "solution": false}
# ## What it must do
#
# - **Camera** (`camera/image`, 10 Hz): a frame that the radio lost is not sent again to your
#   consumer. After a pause (it was busy) this goes on with at most the last 10 frames (1 s).
# - **LIDAR** (`scan`, 10 Hz): after a pause it acts on at most the last 5 scans (0.5 s).
# - **IMU** (`imu/data`, 100 Hz): all 5 readings of a pause of 50 ms are used, each once; of a longer
#   one at most the last 50 (0.5 s).
# - **Emergency stop** (`emergency/stop`): who asks for RELIABLE and who asks for BEST_EFFORT can both
#   listen. A RELIABLE consumer gets every event, once and in order, even if up to 100 pile up while
#   it is busy or out of radio range.
# - **Starting late**: a new node is handed no old camera, LIDAR or IMU readings.
# - `SensorDrivers` publishes each reading within 0.1 s, unchanged; `SensorConsumers` hands on what
#   it acts on.

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-try-it", "locked": true, "schema_version": 3, "solution": false}
# ## Try it
#
# The robot of the course publishes on these topics. Once the cells below have run, put your
# consumers beside it, in a cell of your own:
#
# ```python
# import course
#
# world = course.world("warehouse")
# course.run(SensorConsumers)              # your consumers listen to its sensors
# course.session().panel(world, "scan")    # drive with the arrow keys; see when scans arrive
# ```
#
# Press its stop, or take its radio away (`world.set_fault("radio", "gone")`), and see what arrives.

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-fine-print", "locked": true, "schema_version": 3, "solution": false}
# <details><summary>What exactly is examined</summary>
#
# Another process plays the hardware, keeps your consumer busy, joins late, and listens on the wire.
# Nobody reads your code: every design that does what stands here gets full marks.
#
# | Sensor | Type | In at the driver | Between the nodes | Out at the consumer |
# |---|---|---|---|---|
# | camera | `sensor_msgs/Image` | `hardware/camera` | `camera/image` | `consumer/camera` |
# | LIDAR | `sensor_msgs/LaserScan` | `hardware/lidar` | `scan` | `consumer/lidar` |
# | IMU | `sensor_msgs/Imu` | `hardware/imu` | `imu/data` | `consumer/imu` |
# | emergency stop | `std_msgs/String` | `hardware/emergency_stop` | `emergency/stop` | `consumer/emergency_stop` |
#
# **Both nodes** (no points; all else needs it)
#
# - `SensorDrivers()` and `SensorConsumers()` make their nodes without an error. When the constructors
#   have returned, each topic of the table has its publisher and its subscription, of this type,
#   whether or not anybody listens yet. The nodes' names are free.
#
# **The way of a reading** (no points; the other checks of that sensor need it)
#
# - What comes in at the driver goes over the topic in between and comes out at the consumer.
# - The driver publishes each reading as soon as it comes in. This is seen in 16 to 48 readings of
#   each sensor that come in one by one. Wrong is a driver that publishes two running only when more
#   come in, or 12 more than 0.15 s late, or of which 4 are still missing after 0.15 s while all its
#   threads sleep. A busy machine is not held against you.
# - The driver changes nothing but the header. The consumer may change the header, and clean the
#   content (cut off ranges, bring a rotation to length 1), but it hands on more than a header. A stop
#   event keeps its words on the whole way.
#
# **Camera**
#
# - Best effort (3 points): not both of the driver, which offers, and the consumer, which requests,
#   say RELIABLE; either of them is enough. What others get who ask for RELIABLE (a repair, or no
#   picture at all) is up to you.
# - A pause (2 points): your consumer is held for 1.5 s, in which 15 frames come in. Afterwards it
#   hands on the newest, none out of order, and none that is too old: one that is neither among the
#   last 10 nor younger than 1 s. It may skip frames. What it held already before the pause does not
#   count.
# - For the same points it keeps up afterwards, while frames come in at 10 Hz: from 0.8 s after the
#   pause on, one frame that is handed on within 0.2 s proves it. Wrong is a consumer that for 0.5 s
#   hands on only what is older than 2 s with more than 20 newer frames waiting, or for 3 s, and 8
#   frames, only what is older than 1 s with more than 10 waiting. So a list of your own counts as a
#   queue does.
# - For the same points the driver leaves out at most one of the frames that come in one by one; and
#   of up to 20 frames that differ in nothing but their stamps at least two are handed on.
# - A gap in the radio link (1 point, at grading): a consumer far away asks for the reliability that
#   all your own subscriptions ask for (RELIABLE only if all do). 5 frames go out while every packet
#   to it is lost, then one more when the link is up. It gets this one, and none of the first 4.
#
# **LIDAR**
#
# - A pause (2 points): as for the camera, with 5 scans and 0.5 s (and 10 and 1 s where there 20 and
#   2 s stand). Your consumer may skip scans: it need not act on each.
# - For the same points: keeping up, leaving out and reading alike as for the camera; and of 10 scans
#   that have beams without an echo (inf, nan) at least one is handed on.
# - Either reliability is right, and what a gap in the radio link does to scans is not examined.
#
# **IMU** (2 points, at grading, for all of this)
#
# - A pause of 0.9 s, in which 90 readings come in: afterwards as for the camera, with 50 readings and
#   0.5 s (and 100 and 1 s where there 20 and 2 s stand). The driver leaves out at most one of those
#   that come in one by one.
# - A pause in which 5 readings come in: all 5 are handed on, each once and in order. A depth of 5
#   suffices, there is no margin to add.
# - While readings come in at 100 Hz, each is handed on, one by one or in batches. Wrong is a consumer
#   that leaves some out more than ten times with at most 5 readings between one gap and the next.
# - Of three readings that differ in nothing but their stamps all three are handed on.
# - Either reliability is right, and what a gap in the radio link does to readings is not examined.
#
# **Emergency stop**
#
# - Everybody can listen (no points; the two checks below need it): one consumer that asks for
#   RELIABLE and one that asks for BEST_EFFORT both hear 5 events, each once and in order. The first 4
#   of them come in on `hardware/emergency_stop` while your driver is held: its queue there holds at
#   least 4 (`CABLE` holds all). At least one subscription of your own consumer asks for RELIABLE.
# - When one more consumer joins, those who were there hear none of the 5 again, and your consumer
#   hands none on again. The new one may be handed past events, or not: durability is up to you.
# - On `emergency/stop` comes nothing but the events.
# - A pause (3 points): 100 events come in in 1.5 s while your consumer is held. It hands on all of
#   them, each once and in order, and none of any event a second time later. No lifespan below an hour
#   is set at either end. The driver leaves out at most one of those that come in one by one.
# - For the same points: events may have the same words. After it five come that read as pressed,
#   released, pressed, pressed, released do, and all five are handed on. On `consumer/emergency_stop`
#   comes nothing but events.
# - A gap in the radio link (1 point, at grading): 100 events go out while every packet to a consumer
#   far away is lost, which asks for RELIABLE and was there before. When the link is up, it gets all
#   100, in order. DDS can only send again what the *publisher* still keeps.
#
# **Starting late** (1 point, at grading)
#
# - After 5 readings of camera, LIDAR and IMU two readers join each of their topics, one that asks for
#   the past (RELIABLE, TRANSIENT_LOCAL) and one that does not (BEST_EFFORT, VOLATILE). While nothing
#   new comes in, for 0.3 s at least, neither gets a reading: the driver publishes none a second time.
#
# **What you may do**: more nodes, timers, lists, other classes. While your consumer is held, its
# callbacks do not run, and at grading none of your threads does. A thread or an executor of your own
# is allowed; but in your notebook it cannot be held, and then the sensor's pause is “not examined”
# there. So is what this machine is too busy for; at grading a person looks at it, and it costs
# nothing.
#
# </details>

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
# The cell below runs as it is, but its four profiles are all the same: that is too much for some
# sensors, and too little for another. The drivers offer a profile, the consumers request one; they
# may be equal or differ, as long as DDS connects them. Keep the two class names and the topics, all
# else may change (a callback must be a function written in Python: for `deque.append` rclpy says "no
# signature found for builtin", so write `lambda reading: recent.append(reading)`).

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
# The next cell starts an examiner in a process of its own, for some seconds. It says for each check
# what was observed, what was needed, and why that matters on a robot; `check("qos", hint=2)` in a
# cell of your own helps more, `hint=3` most. There are 20 points: 10 for these checks, 5 for checks
# at grading, 5 for your two answers.
#
# **Look inside**, after `import course`:
# `course.session().qos_lab(offered=lidar_qos, requested=lidar_qos)` tries two profiles on a late
# joiner, a slow reader and a lossy link. After `course.run(SensorDrivers)` and
# `course.run(SensorConsumers)`, `course.session().graph()` shows in red what DDS refuses to connect.

# %% nbgrader={"grade": true, "grade_id": "qos-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("qos")

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next cell is empty for you: at grading it examines the IMU's burst, a gap in the radio link, and
# the node that starts late.

# %% nbgrader={"grade": true, "grade_id": "qos-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("qos", part="hidden")
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-question-loss", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your choices
#
# Answer each question in three to five sentences. A person reads them: each gives 2.5 points, or a
# part of these if only a part of the question is answered.
#
# ### A lost camera frame
#
# A colleague wants to record every frame, and asks you to make the camera's link to your consumer
# RELIABLE. Who would then re-send a lost frame, what would that do to the robot that drives by the
# picture while the Wi-Fi is bad, and how can both of you get what you need?

# %% [markdown] nbgrader={"grade": true, "grade_id": "qos-explanation-loss", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# The driver: its writer keeps each frame until it is acknowledged, and sends it again when the
# consumer says what it misses. DDS hands over in order, so newer frames wait for the old one: the
# picture freezes, then plays the past, and the repairs take bandwidth from a link that is bad
# already. The robot steers by what was there a second ago; without the repair the next frame is there
# after 100 ms. A connection is reliable only if both sides ask for it: the driver can offer RELIABLE,
# the recorder requests it with a deep queue, and the consumer that drives requests BEST_EFFORT with a
# short one. Better still the recorder runs on the robot, where nothing is lost.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-question-depth", "locked": true, "schema_version": 3, "solution": false}
# ### History and depth
#
# The robot gets a LIDAR of 40 Hz, and its state estimation may now be busy for 0.2 s. Which depths
# for `scan` and `imu/data` still keep the promises of this exercise, from which to which, and what
# goes wrong on the robot below and above them?

# %% [markdown] nbgrader={"grade": true, "grade_id": "qos-explanation-depth", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# LIDAR: 0.5 s at 40 Hz are 20 scans, so every depth from 1 to 20 keeps it; 1 is best, as only the
# present obstacles count. Above 20 the robot brakes for obstacles where they were half a second ago,
# and does not see those that have come. IMU: 0.2 s at 100 Hz are 20 readings, so the depth is 20 to
# 50. Below 20 (the 10 of before) the oldest are pushed out, each a piece of the turn, and the angle
# stays wrong from then on; above 50 the estimator works through more than the last 0.5 s after a long
# pause, and the controller steers by the past.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "qos-hand-in", "locked": true, "schema_version": 3, "solution": false}
# **Hand in**: save this notebook, and hand in the file `qos-design.ipynb` in the way of your course.
