# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Chapter 5: Nodes, Topics, Services - The Building Blocks of ROS 2
#
# Run the cell with **Shift+Enter**, click on the floor, and drive with the arrow keys. *The chapter
# takes about 3 hours, its part 1 takes 20 minutes.*

# %% tags=["notebook-only"]
# %load_ext course
import course
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

seen = {}
def look(scan):
    seen["nearest"] = min(scan.ranges)

watcher = course.run(Node, "watcher")
watcher.create_subscription(LaserScan, "scan", look, 10)
course.world("warehouse")

# %% [markdown]
# ## 1. A robot, and a node that listens (20 minutes)
#
# ### Introduction
#
# You have just run a robot and a **node**, `watcher`. The robot measures 360 distances, ten times a
# second, and publishes them on a **topic**, `scan`; your node listens there, and keeps the smallest
# in `seen`. Both are real ROS 2, on the same network protocol that a robot in a hall would use.
#
# ROS 2 is the nervous system of a Physical AI system. A nervous system is made of a few kinds of
# cell, neurons, synapses and pathways, and its rich behaviour comes from how these simple parts are
# joined. ROS 2 has four building blocks:
#
# - **nodes** do the work, each one a small unit with one function;
# - **topics** let nodes share information continuously;
# - **services** answer a request with a response, synchronously;
# - **actions** run a long operation and report on it while it runs.
#
# The chapter has seven parts, which you can take one at a time. Running a cell again is always
# safe: a node that is already there is replaced, never doubled.
#
# **Yours.** The robot listens, too: on `cmd_vel`, for a speed. Make it drive: put `0.3` in place of
# `0.0`, and run the cell.

# %% tags=["notebook-only", "try"]
from course.lessons import building_blocks as check
from geometry_msgs.msg import Twist

session = course.session()  # it runs your nodes in the background
session.until(lambda: seen, timeout=30.0, what="the first scan")
print(f"The nearest thing that the robot sees is {seen['nearest']:.2f} m away.")

track = session.record("wheel/odometry", timeout=30.0)
command = Twist()
command.linear.x = 0.0  # YOURS: metres a second, straight ahead
session.publish("cmd_vel", command)
check.robot_drives(session, track)

# %% [markdown]
# ### Learning objectives
#
# When you have worked through this chapter you can
#
# - **explain** how a ROS 2 node is built, how it lives and ends, and what part it plays in a
#   Physical AI system;
# - **describe** publish-subscribe, and say which QoS profile a given topic needs;
# - **implement** nodes that communicate through topics, services and actions;
# - **analyse** what each communication pattern costs and what it gives in a robotic system;
# - **evaluate** which pattern fits a particular robotic task and its requirements.
#
# **You need** basic Python. It helps to know what Physical AI means (a program that senses and acts
# in the world), the three tiers of a robot's software (planning, sequencing, control), and that
# ROS 2 is the layer through which their programs talk.
#
# Now see who talks to whom. Round shapes are nodes, boxes are topics; point at one for more.

# %% tags=["notebook-only"]
session.graph()

# %% [markdown]
# ### Hook
#
# Follow one camera image through a robot.
#
# The camera driver, a node, publishes the image on a topic. Perception, another node, receives it,
# finds the objects in the picture, and publishes the detections on a second topic. It neither knows
# nor cares who reads them: today navigation and manipulation do, tomorrow a logger may.
#
# Navigation now wants to know where the robot is. That is a question with one answer, so it calls a
# service of the localization system. Then the robot has to drive somewhere. That takes a while, so
# a goal is sent to the navigation system's action, and feedback about the progress flows back until
# the robot arrives.
#
# Three patterns, one image, and no node that does everything. Like the specialised cells of a body,
# each part is simple; the skill is in joining them. A robot that is joined well is robust and can
# be maintained.
#
# This robot's camera publishes, too. Here is the next image, as a message:

# %% tags=["notebook-only"]
from sensor_msgs.msg import Image

image = session.next_message(Image, "camera/image", timeout=30.0)
print(f"{image.width} x {image.height} pixels, {len(image.data)} bytes, frame {image.header.frame_id}")

# %% [markdown]
# ### Before you learn this
#
# Five sentences to carry with you:
#
# - A **node** is the basic processing unit of ROS 2; it performs one specific function.
# - A **topic** shares data continuously, by publish-subscribe.
# - A **service** is request-response, for synchronous operations.
# - An **action** is for long-running operations: it has goals that are managed, and feedback.
# - A **QoS profile** controls reliability, durability and other traits of the communication.
#
# ### Concept
#
# The four building blocks are specialised, like the cell types of a body. Each was designed for one
# kind of interaction. We take them in turn.
#
# ### Nodes: the processing units
#
# A node is to ROS 2 what a neuron is to a nervous system. It does one job, and it reaches other
# nodes through the ROS 2 middleware.
#
# **Single responsibility.** A node has one clear purpose, as a specialised cell has. The camera
# driver handles camera data and nothing else; the localization node estimates the position and
# nothing else.
#
# **Yours.** `watcher` keeps what it finds to itself. Let this node tell everybody: replace the
# three dots by the line in the comment. Most nodes are a class of their own, as here.

# %% tags=["notebook-only", "try"]
from std_msgs.msg import Float32


class Nearest(Node):
    def __init__(self):
        super().__init__("nearest")
        self.publisher = self.create_publisher(Float32, "nearest", 10)
        self.create_subscription(LaserScan, "scan", self.look, 10)

    def look(self, scan):
        ...  # YOURS: self.publisher.publish(Float32(data=min(scan.ranges)))


session.run(Nearest)
check.nearest_is_published(session)

# %% [markdown]
# **Lifecycle management.** A node lives through three phases:
#
# | Phase | What the node does |
# | --- | --- |
# | initialization | creates its publishers, subscribers, services and actions |
# | running | processes data and communicates with other nodes |
# | cleanup | releases its resources properly |
#
# In yours the first is `__init__`, and the second is `look`, ten times a second.
#
# **Resource management.** A node owns its timers, callbacks and communication endpoints. It must
# set them up and take them down with care; what is forgotten is a memory leak at best, and an
# unstable system at worst.
#
# **Yours.** End the life of `nearest`, and see that nothing of it stays on the network.
#
# <details><summary>More: a second meaning of "lifecycle"</summary>
#
# A *managed* node (`LifecycleNode`) has named states such as *inactive* and *active*, and is moved
# between them from outside. The nodes in this chapter are ordinary nodes; the three phases hold for
# both kinds. Source: ROS 2 design, "Managed nodes".
#
# </details>

# %% tags=["notebook-only", "try"]
# YOURS: session.stop("nearest")

check.node_is_gone(session, "nearest")

# %% [markdown]
# *That was part 1. The next, on topics, takes 50 minutes and is the longest.*
#
# ## 2. Topics, and how well they deliver (50 minutes)
#
# ### Topics: continuous data sharing (publish-subscribe)
#
# A topic is for a stream of data that several nodes need. Think of a sensory neuron: it fires, and
# several centres in the brain receive the signal.
#
# **Publishers and subscribers.** Publishers send to a topic, subscribers receive from it. Several
# publishers on one topic are allowed, but uncommon; several subscribers are the normal case.
#
# **Asynchronous communication.** A publisher does not wait for anybody's response, and a subscriber
# need not know who published. Neither depends on the other being there. This is called *loose
# coupling*, and it is why you can add a logger to a robot without touching the robot.
#
# **Message types.** Each topic has exactly one message type, which fixes the structure of its data.
# That makes the exchange type-safe and predictable.
#
# **Yours.** This logger hears nothing, and nobody complains: loose coupling again. The line
# `%ros topic list` shows the names that there are. Mend the logger's.

# %% tags=["notebook-only"]
# %ros topic list

# %% tags=["notebook-only", "try"]
topic = "scans"  # YOURS


class Logger(Node):
    def __init__(self):
        super().__init__("logger")
        self.count = 0
        self.create_subscription(LaserScan, topic, self.note, 10)

    def note(self, scan):
        self.count += 1


logger = session.run(Logger)
check.logger_hears(session, logger, topic)

# %% [markdown]
# ### Quality of Service (QoS) profiles
#
# Not every topic needs the same treatment, so each end of a topic has a **QoS profile**: it says
# how the topic behaves. Three policies matter most: durability, reliability and history.
#
# #### QoS profiles: durability
#
# Does a late joiner get messages that were published before it came (`TRANSIENT_LOCAL`), or only
# new ones (`VOLATILE`)? Settings, parameter information for instance, are a case for
# `TRANSIENT_LOCAL`: whoever starts late still learns the current values.
#
# #### Experiment 1: the late joiner
#
# A notice board posts five notices *before* anybody subscribes, and keeps the last three. Then your
# reader joins, and the sixth is posted. **Yours:** let the reader have the old ones, too.

# %% tags=["notebook-only", "try"]
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

wanted = DurabilityPolicy.VOLATILE  # YOURS


def texts(recorder):
    """The text of each message that a recorder has kept."""
    return [stamped.message.data for stamped in recorder.messages]


with course.Session() as bench:
    board = bench.run(Node, "notice_board")
    keep_three = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    notices = board.create_publisher(String, "notices", keep_three)
    for number in range(1, 6):
        notices.publish(String(data=f"notice {number}"))
    late = bench.record("notices", String, qos=QoSProfile(depth=10, durability=wanted))
    bench.until(notices.get_subscription_count, timeout=30.0, what="the reader to be matched")
    found = check.late_reader_remembers(bench, late)
    notices.publish(String(data="notice 6"))
    bench.until(lambda: "notice 6" in texts(late), timeout=30.0, what="the new notice")

print("The reader has:", texts(late))
found

# %% [markdown]
# A transient-local reader gets notices 3, 4 and 5, which were published before it existed; a
# volatile one does not. Notices 1 and 2 are gone for everybody: the publisher's depth is 3, so it
# kept three. A replay is never longer than the smaller of the two depths, and *both* sides have to
# be `TRANSIENT_LOCAL`.
#
# <details><summary>More: what parameters really do</summary>
#
# The *parameters* of ROS 2 nodes do not travel on a transient-local topic: they are read and
# written through services. Transient-local topics are used for things like a map or a robot's
# description, which are published once and needed by whoever comes later. Source: ROS 2
# documentation, "Parameters" and "Quality of Service settings".
#
# </details>
#
# #### QoS profiles: reliability
#
# Must messages be delivered (`RELIABLE`), or is some loss acceptable (`BEST_EFFORT`)?
# Safety-critical data should use `RELIABLE`; for sensor data `BEST_EFFORT` is often the better
# choice.
#
# <details><summary>More: what RELIABLE does not promise</summary>
#
# `RELIABLE` means that a lost message is sent again *while the publisher still has it in its
# history*. It is not "every message, always": a reader that is slower than the publisher still
# loses what its queue cannot hold. Source: DDS 1.4, sections 2.2.3.14 RELIABILITY and 2.2.3.18
# HISTORY.
#
# </details>
#
# #### Experiment 2: two ends that do not fit
#
# A publisher **offers** a QoS, a subscriber **requests** one. If the offer is weaker than the
# request, DDS does not connect the two. There is no exception and no crash; nothing arrives.
#
# A camera offers `BEST_EFFORT`, and this display asks for more. **Yours:** make it see the five
# images.

# %% tags=["notebook-only", "try"]
requested = ReliabilityPolicy.RELIABLE  # YOURS
offer = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
request = QoSProfile(depth=10, reliability=requested)

with course.Session() as bench:
    camera = bench.run(Node, "camera")
    display = bench.run(Node, "display")
    arrived_images = []
    images = camera.create_publisher(String, "images", offer)
    display.create_subscription(String, "images", arrived_images.append, request)
    found = check.images_arrive(bench, images, arrived_images)
    warnings = [row.message for row in bench.logs(level="WARN")]

print("The log says:", *warnings or ["nothing"])
found

# %% [markdown]
# As it was, *one* subscription was on the graph and *none* was matched, and the only trace is a
# warning in the log. When "my subscriber gets nothing" on a robot, compare the two QoS profiles
# first; `session.diagnose()` does it for you. These pairs do not connect:
#
# | Offered | Requested |
# | --- | --- |
# | `BEST_EFFORT` | `RELIABLE` |
# | `VOLATILE` | `TRANSIENT_LOCAL` |
#
# The other way round is fine: an offer may be *better* than the request. History and depth never
# keep two ends apart.
#
# <details><summary>Source</summary>
#
# ROS 2 documentation, "Quality of Service settings", QoS compatibilities. (Deadline and liveliness
# can keep two ends apart as well; they are beyond this chapter.)
#
# </details>
#
# #### QoS profiles: history
#
# How much is stored until it is delivered: everything (`KEEP_ALL`), or the latest few messages
# (`KEEP_LAST` with a *depth*)? For a fast sensor, `KEEP_LAST` and a small depth keep the memory
# bounded.
#
# #### Experiment 3: the slow reader
#
# A planner is busy while a laser publishes 30 scans, all of them `RELIABLE`. Then it reads.
# **Yours:** let it find the five latest scans.

# %% tags=["notebook-only", "try"]
from rclpy.duration import Duration

depth = 1  # YOURS
histories = {
    "yours": QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=depth),
    "KEEP_ALL": QoSProfile(history=HistoryPolicy.KEEP_ALL),
}
kept = {name: [] for name in histories}

with course.Session() as bench:
    laser = bench.run(Node, "laser")
    planner = bench.run(Node, "planner")
    scans = laser.create_publisher(String, "scan", histories["KEEP_ALL"])
    for name, qos in histories.items():
        planner.create_subscription(String, "scan", kept[name].append, qos)
    bench.until(lambda: scans.get_subscription_count() == 2, timeout=30.0, what="both readers")
    bench.pause(planner)
    for number in range(1, 31):
        scans.publish(String(data=str(number)))
    scans.wait_for_all_acked(Duration(seconds=10))
    bench.resume(planner)
    bench.until(lambda: len(kept["KEEP_ALL"]) == 30, timeout=30.0, what="the planner to read all")

for name, messages in kept.items():
    print(f"{name:<9} {len(messages):>2} of 30:", *(message.data for message in messages))
check.latest_five_are_kept(kept["yours"])

# %% [markdown]
# Reliable delivery put every scan at the planner's door; the *history* decided how many were still
# there when it opened. Depth 1 is the newest scan and nothing else, which is often just what a
# controller wants, but do not call it "no data loss".
#
# <details><summary>More: how long "all" is</summary>
#
# With `KEEP_ALL` the depth is ignored. "All" is still not endless: the queue grows up to the
# middleware's resource limits (5000 samples by default in Fast DDS, which this course uses); beyond
# them we saw messages disappear without a word. Sources: DDS 1.4, sections 2.2.3.18 HISTORY and
# 2.2.3.19 RESOURCE_LIMITS; Fast DDS, `ResourceLimitsQosPolicy`.
#
# </details>
#
# **Your own experiments.** In the QoS lab choose two profiles, say what you expect, then run it:
# two real processes, a reader that is slow or late if you like, and a link that loses packets where
# your machine allows it. The rules of DDS stand beside what happened.

# %% tags=["notebook-only"]
session.qos_lab(offered=offer, requested=QoSProfile(depth=5))

# %% [markdown]
# ### Code
#
# Now you build a system of **five nodes**, structured as in a real robot, with no robot needed; in
# part 7 it drives one. Its nodes use ROS 2, `rclpy` and Python's standard library, plus `course` to
# run them in the background.
#
# **You practise** creating nodes with different communication patterns; writing publishers,
# subscribers, services and actions; managing a node's resources; and seeing what a QoS profile
# does.
#
# **You will see** several nodes using different patterns, each with a QoS chosen for its purpose,
# and how they take up and give back what they use.
#
# The names of classes, nodes, topics, services and the action are the chapter's own. You will meet
# them again in the exercises.
#
# The next cell may take half a minute the first time: the course builds the package
# `example_interfaces` from its definitions with your compiler, once, and keeps it. After that it is
# instant.

# %%
"""Nodes, topics, services and actions: the five nodes of chapter 5, and a main that runs them."""

# First, as it provides example_interfaces where no ROS 2 is installed.
import course  # isort: skip

import threading

from example_interfaces.action import Fibonacci
from example_interfaces.srv import SetBool
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

# %% [markdown]
# ### SensorNode: topics with different QoS
#
# One node, three streams, three different needs:
#
# | Topic | Rate | Reliability | Durability | History | Because |
# | --- | --- | --- | --- | --- | --- |
# | `camera/data` | 10 Hz | `BEST_EFFORT` | `VOLATILE` | `KEEP_LAST`, depth 5 | fast sensor data (camera, IMU): the next frame is coming anyway |
# | `emergency/stop` | 1 Hz | `RELIABLE` | `VOLATILE` | `KEEP_ALL` | safety: no event may be dropped |
# | `environment/data` | 0.5 Hz | `RELIABLE` | `VOLATILE` | `KEEP_LAST`, depth 10 | slow data: every value is worth having |
#
# Each stream has a timer. Time is read from the node's own clock, not from `time.time()`, so that
# the node also works on simulated time; you will use that in a moment.


# %%
class SensorNode(Node):
    """Publish three simulated sensors, each with the QoS that suits it."""

    def __init__(self):
        super().__init__("sensor_node")

        # Fast sensor data: losing a frame is better than waiting for it.
        qos_sensor = QoSProfile(
            depth=5,
            reliability=ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.VOLATILE,
            history=HistoryPolicy.KEEP_LAST,
        )
        self.camera_publisher = self.create_publisher(String, "camera/data", qos_sensor)

        # Safety: every event must arrive.
        qos_critical = QoSProfile(
            depth=10,  # KEEP_ALL ignores it
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.VOLATILE,
            history=HistoryPolicy.KEEP_ALL,
        )
        self.emergency_publisher = self.create_publisher(String, "emergency/stop", qos_critical)

        # Slow data: reliable, with a short memory.
        qos_env = QoSProfile(
            depth=10,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.VOLATILE,
            history=HistoryPolicy.KEEP_LAST,
        )
        self.environment_publisher = self.create_publisher(String, "environment/data", qos_env)

        self.camera_timer = self.create_timer(0.1, self.publish_camera_data)  # 10 Hz
        self.emergency_timer = self.create_timer(1.0, self.publish_emergency_data)  # 1 Hz
        self.environment_timer = self.create_timer(2.0, self.publish_environment_data)  # 0.5 Hz
        self.get_logger().info("Sensors ready: camera 10 Hz, emergency 1 Hz, environment 0.5 Hz")

    def seconds(self):
        """The time on this node's clock, in s."""
        return self.get_clock().now().nanoseconds / 1e9

    def publish_camera_data(self):
        """Publish one frame; frames are numbered in tenths of a second."""
        frame = String(data=f"Camera frame {round(self.seconds() * 10)} - RGB-D data")
        self.camera_publisher.publish(frame)
        self.get_logger().debug(f"Camera: {frame.data}")

    def publish_emergency_data(self):
        """Publish the state of the emergency stop."""
        status = String(data=f"Emergency status: OK - {self.seconds():.3f}")
        self.emergency_publisher.publish(status)
        self.get_logger().info(f"Emergency: {status.data}")

    def publish_environment_data(self):
        """Publish temperature and humidity."""
        reading = String(data=f"Environment: Temperature 22°C, Humidity 45% - {self.seconds():.3f}")
        self.environment_publisher.publish(reading)
        self.get_logger().info(f"Environment: {reading.data}")


# %% [markdown]
# Start it, in a session of its own: a private corner of the network, where the five nodes will
# live. Look at the QoS that the node *offers on the graph*, and at one live message of each topic.

# %% tags=["notebook-only"]
sensor_topics = ("camera/data", "emergency/stop", "environment/data")
crew = course.Session(threads=5)
sensor_node = crew.run(SensorNode)

offered = {}
for topic in sensor_topics:
    endpoint = sensor_node.get_publishers_info_by_topic(topic)[0]
    qos = endpoint.qos_profile
    offered[topic] = (qos.reliability.name, qos.durability.name)
    message = crew.next_message(String, topic, timeout=30.0)
    print(f"{topic:<17} {qos.reliability.name:<12} {qos.durability.name:<9} {message.data}")

# %% [markdown]
# History and depth are missing from that table on purpose: DDS does not announce them. They show in
# behaviour only, as in experiment 3.
#
# And the rates? On a wall clock we would have to wait, and a busy laptop would blur the figures. So
# we use **simulated time**: a session that publishes `/clock` itself. Twenty seconds pass in about
# one, and every timer fires exactly as often as it should.
#
# **Yours.** How many camera frames is that? Say it first, then run.

# %% tags=["notebook-only", "try"]
my_guess = ...  # YOURS: a number of frames

with course.Session(sim_time=True) as lab:
    lab.run(SensorNode)
    tapes = {topic: lab.record(topic, String) for topic in sensor_topics}
    lab.until(
        lambda: all(lab.nodes["/sensor_node"].count_subscribers(topic) for topic in sensor_topics),
        timeout=30.0,
        what="the recorders to be on the graph",
    )
    lab.sim.advance(20.0)
    lab.until(
        lambda: [tape.count for tape in tapes.values()] >= [200, 20, 10],
        timeout=30.0,
        what="every message of 20 simulated seconds",
    )

arrived = {topic: tape.count for topic, tape in tapes.items()}
for topic, count in arrived.items():
    print(f"{topic:<17} {count:>3} messages in 20 s = {count / 20:g} Hz")
check.guess_holds(my_guess, arrived["camera/data"], "camera frames")

# %% [markdown]
# ### ProcessingNode: subscribers that match
#
# The next node subscribes to all three streams. What it requests must be no more than what the
# sensors offer:
#
# | Topic | SensorNode offers | ProcessingNode requests |
# | --- | --- | --- |
# | `camera/data` | `BEST_EFFORT` | `BEST_EFFORT`, depth 5 |
# | `emergency/stop` | `RELIABLE`, `KEEP_ALL` | `RELIABLE`, depth 10 |
# | `environment/data` | `RELIABLE` | `BEST_EFFORT`, depth 5 |
#
# Look at the last row: the subscriber asks for *less* than is offered. That connects, and the
# connection is then best-effort. In the middle row the histories differ, which never matters for
# connecting, but it means that this *reader* keeps ten events, whatever the publisher keeps.
#
# Every camera frame leads to one message on `processed/data`. Emergency data is handled at once; a
# real system might trigger its safety response there. The `10` given to the last publisher is the
# short form of a QoS: `RELIABLE`, `VOLATILE`, `KEEP_LAST` with depth 10.


# %%
class ProcessingNode(Node):
    """Subscribe to the sensors with QoS that fits what they offer, and publish what was found."""

    def __init__(self):
        super().__init__("processing_node")

        qos_sensor = QoSProfile(
            depth=5,
            reliability=ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.VOLATILE,
        )
        qos_critical = QoSProfile(
            depth=10,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.VOLATILE,
        )
        self.camera_subscriber = self.create_subscription(
            String, "camera/data", self.camera_callback, qos_sensor
        )
        self.emergency_subscriber = self.create_subscription(
            String, "emergency/stop", self.emergency_callback, qos_critical
        )
        self.environment_subscriber = self.create_subscription(
            String, "environment/data", self.environment_callback, qos_sensor
        )
        self.processed_publisher = self.create_publisher(String, "processed/data", 10)
        self.get_logger().info("Processing ready: three subscribers, one publisher")

    def camera_callback(self, msg):
        """Simulate image processing: one result for each frame."""
        processed = String(data=f"Processed: {msg.data} - Objects detected")
        self.processed_publisher.publish(processed)
        self.get_logger().debug(f"Processed camera: {processed.data}")

    def emergency_callback(self, msg):
        """Handle safety data at once."""
        self.get_logger().warning(f"CRITICAL: {msg.data}")

    def environment_callback(self, msg):
        """Take note of the environment."""
        self.get_logger().info(f"Environmental: {msg.data}")


# %% [markdown]
# Start it beside the sensors. The cell shows a result, and what the graph says of the connections.
#
# The nodes print nothing themselves: their log messages are kept, at every level, and you read them
# when you like.
#
# **Yours.** Be the emergency button: put a text in place of the three dots. ProcessingNode has to
# note it as critical.

# %% tags=["notebook-only", "try"]
processing_node = crew.run(ProcessingNode)
print(crew.next_message(String, "processed/data", timeout=30.0).data)

asked_for = {}
for topic in sensor_topics:
    ends = processing_node.get_subscriptions_info_by_topic(topic)
    own = next(end for end in ends if end.node_name == "processing_node")
    asked_for[topic] = own.qos_profile.reliability.name
    print(f"{topic:<17} offered {offered[topic][0]:<12} requested {asked_for[topic]}")

my_text = ...  # YOURS: for instance "Button pressed"
check.emergency_is_noted(crew, my_text)

# %% [markdown]
# Here is the graph of your crew, live: run the cells of the next parts, and watch it grow. Point at
# a box or an arrow for its QoS, or unfold "In words". The timeline beneath it has a lane for
# publications, receptions and callbacks of two topics.

# %% tags=["notebook-only"]
crew.graph()

# %% tags=["notebook-only"]
crew.timeline("camera/data", "processed/data")

# %% [markdown]
# *That was part 2. The next, on services, takes 25 minutes.*
#
# ## 3. Services: a question and its answer (25 minutes)
#
# ### ServiceNode: answers on request
#
# Two services, both of type `SetBool`: a boolean goes in as `data`; `success` and `message` come
# out.
#
# - `get_robot_state` answers that the robot is operational, and repeats the mode it was asked with;
# - `set_robot_mode` sets the mode: `True` is ACTIVE, `False` is STANDBY.


# %%
class ServiceNode(Node):
    """Serve two quick operations."""

    def __init__(self):
        super().__init__("service_node")
        self.get_robot_state_service = self.create_service(
            SetBool, "get_robot_state", self.get_robot_state_callback
        )
        self.set_parameter_service = self.create_service(
            SetBool, "set_robot_mode", self.set_robot_mode_callback
        )
        self.get_logger().info("Services ready: get_robot_state, set_robot_mode")

    def get_robot_state_callback(self, request, response):
        """Report on the (simulated) state of the robot."""
        response.success = True
        response.message = f"Robot is operational - Mode: {request.data}"
        self.get_logger().info(f"Robot state requested: {response.message}")
        return response

    def set_robot_mode_callback(self, request, response):
        """Switch between ACTIVE and STANDBY."""
        mode = "ACTIVE" if request.data else "STANDBY"
        response.success = True
        response.message = f"Robot mode set to: {mode}"
        self.get_logger().info(f"Robot mode changed: {mode}")
        return response


# %% [markdown]
# `call` waits for the service to be there, sends the request, and gives up after a deadline instead
# of waiting for ever.
#
# **Yours.** Make the robot ACTIVE.

# %% tags=["notebook-only", "try"]
crew.run(ServiceNode)

request = SetBool.Request(data=False)  # YOURS
state = crew.call(SetBool, "get_robot_state", SetBool.Request(data=True), timeout=30.0)
mode = crew.call(SetBool, "set_robot_mode", request, timeout=30.0)
for response in (state, mode):
    print(f"success={response.success}  message={response.message!r}")
check.robot_is_active(mode)

# %% [markdown]
# ### Services: synchronous request-response
#
# A service is for an operation that needs an answer now. You ask a particular question and wait for
# the reply, as over a direct neural pathway.
#
# **Client-server model.** A client sends a request to the server; the server processes it and
# returns a response. Until that response is there the client does not go on: the call blocks.
#
# **Synchronous processing.** Use this when an operation must be known to be complete before the
# next one starts.
#
# **Error handling.** The response can say that an operation failed, with an error code and a
# message, so the client is never left guessing.
#
# **Yours.** Give the robot at the top of this page a service that says how far it is to the nearest
# thing. What is missing is the answer.
#
# <details><summary>More: whose error code it is</summary>
#
# The error code is one you design: it is a field of the response, such as `success` and `message`
# in `SetBool`. If a server's callback raises an exception, `rclpy` sends no response at all, so a
# client still needs a timeout. Source: ROS 2 documentation, "Interfaces"; observed with rclpy 7.1.
#
# </details>

# %% tags=["notebook-only", "try"]
from std_srvs.srv import Trigger


class HowFar(Node):
    def __init__(self):
        super().__init__("range_finder")
        self.nearest = None
        self.create_subscription(LaserScan, "scan", self.look, 10)
        self.create_service(Trigger, "how_far", self.answer)

    def look(self, scan):
        self.nearest = min(scan.ranges)

    def answer(self, request, response):
        response.success = True
        ...  # YOURS: response.message = f"{self.nearest:.2f} m"
        return response


range_finder = session.run(HowFar)
session.until(lambda: range_finder.nearest, timeout=30.0, what="a scan")
check.how_far_answers(session)

# %% [markdown]
# The same by hand: the console's form is made from the type of the service. On the ROS 2 command
# line it would be `ros2 service call`; in this notebook it is the second line, with the Tab key for
# names.

# %% tags=["notebook-only"]
crew.service("set_robot_mode")

# %% tags=["notebook-only"]
# %ros service call /how_far

# %% [markdown]
# #### The trap: a blocking call inside a callback
#
# This is a deadlock, on purpose, with a timeout so that we get out again. The node makes a blocking
# call from a timer. Its client shares the timer's **callback group**: while the timer's callback
# waits, nothing else of that group may run, the response included.
#
# **Yours.** Give the client a group of its own: `own_group = True`.
#
# <details><summary>More: waiting is the client's choice</summary>
#
# Waiting is the *client's* choice, not a property of the service. `call()` blocks the thread it
# runs in; `call_async()` returns a future at once and a callback gets the response. A blocking call
# *inside a callback* is a trap: on a single-threaded executor, or within one mutually exclusive
# callback group, the response can never be processed and the node deadlocks. Sources: ROS 2
# documentation, "Synchronous vs. asynchronous service clients" and "Using Callback Groups"; rclpy,
# `Client.call`.
#
# </details>

# %% tags=["notebook-only", "try"]
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

own_group = False  # YOURS


class AskingNode(Node):
    """Make a blocking call from inside a timer's callback: do not copy this."""

    def __init__(self):
        super().__init__("asking_node")
        group = MutuallyExclusiveCallbackGroup() if own_group else None
        self.client = self.create_client(SetBool, "get_robot_state", callback_group=group)
        self.answers = []
        self.timer = self.create_timer(0.05, self.ask)

    def ask(self):
        """Block this callback until the response comes, or a second has passed."""
        if not self.answers and self.client.service_is_ready():
            patience = 30.0 if own_group else 1.0
            request = SetBool.Request(data=True)
            self.answers.append(self.client.call(request, timeout_sec=patience))


with course.Session(threads=4) as bench:
    bench.run(ServiceNode)
    asking = bench.run(AskingNode)
    bench.until(lambda: asking.answers, timeout=60.0, what="the node to ask")
print("The answer:", asking.answers[0])
check.callback_got_its_answer(asking.answers)

# %% [markdown]
# `None` was the deadlock: the service answered at once, and the answer lay unread until the timeout.
# Four threads did not help. The usual mend is simpler than callback groups: use `call_async()`, as
# ClientNode does in part 6.
#
# *That was part 3. The next, on actions, takes 25 minutes.*
#
# ## 4. Actions: a task that takes time (25 minutes)
#
# ### ActionNode: a long operation, with feedback
#
# The action `fibonacci_sequence` computes a Fibonacci sequence one number at a time, half a second
# each, as a stand-in for a drive across a room. After each step it publishes the sequence so far as
# feedback. Three details to notice:
#
# - `cancel_callback` accepts cancellation, and the loop looks after every step whether it was
#   asked for;
# - the pause in `do_step` is `Event.wait`, which lasts half a second *unless the node is being
#   stopped*. A `time.sleep` would make the cleanup wait for it;
# - `destroy_node` is the cleanup phase: it ends a goal that is still running before it takes the
#   action server down.
#
# <details><summary>More: the thread that a goal takes</summary>
#
# While it executes a goal this callback occupies one thread of the executor, as a `time.sleep`
# would. On a `MultiThreadedExecutor` other callbacks, the one for cancel requests among them, go
# on. On a `SingleThreadedExecutor` everything waits until the goal has ended, so a cancellation
# comes too late. That is why your crew has five threads. Source: ROS 2 documentation, "Executors";
# observed with rclpy 7.1.
#
# </details>


# %%
class ActionNode(Node):
    """Run a long operation that reports on its progress and can be canceled."""

    STEP_SECONDS = 0.5  # the simulated effort of each step
    MAX_ORDER = 46  # the last Fibonacci number that fits the action's int32

    def __init__(self):
        super().__init__("action_node")
        self._stopping = threading.Event()
        self._action_server = ActionServer(
            self,
            Fibonacci,
            "fibonacci_sequence",
            execute_callback=self.execute_fibonacci_callback,
            goal_callback=self.goal_callback,
            cancel_callback=self.cancel_callback,
        )
        self.get_logger().info("Action ready: fibonacci_sequence")

    def goal_callback(self, goal):
        """Accept the orders that can be computed."""
        acceptable = 0 <= goal.order <= self.MAX_ORDER
        return GoalResponse.ACCEPT if acceptable else GoalResponse.REJECT

    def cancel_callback(self, goal_handle):
        """Accept every request to cancel; without this callback all are declined."""
        return CancelResponse.ACCEPT

    def execute_fibonacci_callback(self, goal_handle):
        """Compute the sequence step by step, with feedback after each."""
        order = goal_handle.request.order
        self.get_logger().info(f"Executing Fibonacci sequence - order: {order}")
        sequence = [0, 1][: order + 1]  # order 0 is done with [0], order 1 with [0, 1]

        for step in range(1, order):
            sequence.append(sequence[-1] + sequence[-2])
            goal_handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
            self.get_logger().info(f"Fibonacci progress: {step}/{order}")
            if self.do_step(sequence[-1]):
                goal_handle.abort()
                return Fibonacci.Result(sequence=sequence)
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                self.get_logger().info("Fibonacci action canceled")
                return Fibonacci.Result(sequence=sequence)

        goal_handle.succeed()
        self.get_logger().info(f"Fibonacci completed: {sequence}")
        return Fibonacci.Result(sequence=sequence)

    def do_step(self, number):
        """Take the time of one step; return whether the node is being stopped."""
        return self._stopping.wait(self.STEP_SECONDS)

    def destroy_node(self):
        """Clean up: end a running goal, then the action server, then the node."""
        self._stopping.set()
        if self._action_server in self.waitables:  # destroy_node() would leave it on the graph
            self._action_server.destroy()
        super().destroy_node()


# %% [markdown]
# ### Actions: long-running operations with feedback
#
# An action is for something that takes time and has to be watched. The biological picture is a
# complex motor pattern: walking to a place means monitoring and adjusting at every step.
#
# **Goal, feedback, result.** The client sends a goal. The server sends feedback again and again
# while it works. When it is done it returns a result.
#
# **Yours.** Which order of goal ends with the number 13? Watch the feedback grow by one number each
# time.
#
# <details><summary>More: order 5 is six numbers</summary>
#
# A goal of order 5 yields **six** numbers, `[0, 1, 1, 2, 3, 5]`: order *n* ends with the *n*-th
# Fibonacci number, and the sequence starts with number zero. Order 0 yields `[0]`, order 1 yields
# `[0, 1]`.
#
# </details>

# %% tags=["notebook-only", "try"]
from action_msgs.msg import GoalStatus

crew.run(ActionNode)

order = 5  # YOURS
goal = crew.send_goal(Fibonacci, "fibonacci_sequence", Fibonacci.Goal(order=order), timeout=30.0)
goal.wait(timeout=60.0)
for feedback in goal.feedback:
    print("feedback:", list(feedback.sequence))
print("result:  ", list(goal.result.sequence), "- status", goal.status)
check.goal_ends_with(goal, 13)

# %% [markdown]
# **Non-blocking.** Unlike the client of a service, the client of an action does not stop and wait.
# It carries on with its own work while the feedback comes in.
#
# **Goal status.** Every goal has a status, so that the client knows whether it is pending,
# executing, succeeded or failed.
#
# Watch the next goals here while you send them: each one's way through its states, its feedback,
# and a button that cancels it.
#
# <details><summary>More: the names of the states</summary>
#
# The exact names of the states are ACCEPTED (1, the "pending" above), EXECUTING (2), CANCELING (3),
# SUCCEEDED (4), CANCELED (5) and ABORTED (6, the "failed" above). A goal that the server *rejects*
# never gets a status at all. Source: `action_msgs/msg/GoalStatus`.
#
# </details>

# %% tags=["notebook-only"]
crew.action("fibonacci_sequence")

# %% [markdown]
# **Cancellation.** A client can ask for a goal to be canceled, and so stop an operation that is no
# longer wanted. The result is what had been done so far.
#
# **Yours.** This goal of order 8 runs to its end. Cancel it on the way: take the `#` away. Below it
# are two small ones: a goal of order 0, and one that makes no sense and is rejected.
#
# <details><summary>More: a request, which may be declined</summary>
#
# Cancellation is a request, which the server may decline, and in `rclpy` an action server **declines
# every one of them** unless you give it a `cancel_callback`. ActionNode has one. Source: rclpy,
# `ActionServer` (`default_cancel_callback`).
#
# </details>

# %% tags=["notebook-only", "try"]
long_goal = crew.send_goal(Fibonacci, "fibonacci_sequence", Fibonacci.Goal(order=8), timeout=30.0)
crew.until(lambda: len(long_goal.feedback) >= 2, timeout=60.0, what="two feedback messages")
# long_goal.cancel(timeout=30.0)  # YOURS
long_goal.wait(timeout=60.0)
print("order 8: ", list(long_goal.result.sequence), "- status", long_goal.status)

zero = crew.send_goal(Fibonacci, "fibonacci_sequence", Fibonacci.Goal(order=0), timeout=30.0)
zero.wait(timeout=60.0)
print("order 0: ", list(zero.result.sequence), "- status", zero.status)

absurd = crew.send_goal(Fibonacci, "fibonacci_sequence", Fibonacci.Goal(order=-1), timeout=30.0)
print("order -1: accepted is", absurd.accepted)
check.goal_was_canceled(long_goal)

# %% [markdown]
# *That was part 4. The next takes 15 minutes and needs no code: when to use what.*
#
# ## 5. Which pattern for what (15 minutes)
#
# ### Common misunderstanding
#
# > **Myth:** topics are the most common pattern, so all ROS 2 communication should use topics.
# >
# > **Reality:** topics, services and actions each suit different cases. What decides is timing (how
# > soon, how often, how long), the direction in which data flows, and the kind of interaction you
# > need: a broadcast, a question, or a task.
#
# ### When to use what
#
# Choosing the pattern is the most important design decision you make about an interface.
#
# | Use a **topic** when | Use a **service** when | Use an **action** when |
# | --- | --- | --- |
# | many readers want the same data, such as sensor streams or state information | a synchronous request-response is needed | the operation takes a long time |
# | data is produced and consumed continuously | the operation is fairly quick, under a few seconds | continuous feedback is needed while it runs |
# | asynchronous communication is acceptable | error handling matters | it may have to be canceled |
# | the nodes should stay loosely coupled | exactly two parties talk, one to one | it has a clear start and a clear end |
#
# **Yours.** A hospital works like a robot. Which pattern is each of these? Write `"topic"`,
# `"service"` or `"action"`.

# %% tags=["notebook-only", "try"]
my_choice = {
    "monitors broadcast a patient's vital signs all day": ...,  # YOURS
    "a doctor asks for one particular lab result": ...,  # YOURS
    "a surgery is long, and the team follows it from start to finish": ...,  # YOURS
}
check.hospital_patterns(my_choice)

# %% [markdown]
# ### Real-world examples and analogies
#
# **A hospital.** Patient monitors broadcast vital signs all day, to whoever needs to see them. A
# doctor asks for one particular lab result and gets it. Surgery is long and complex, and the
# surgical team gets updates from start to finish. Each of the three is a pattern of ROS 2: you have
# just said which.
#
# **A smart home.** Sensors publish temperature and humidity all the time: topics. You ask for the
# light to be turned on: a service. Security monitoring goes on for hours and keeps you up to date
# on its status: an action.
#
# In both, each pattern has its purpose, and is built for one type of information flow.
#
# ### Diagram
#
# One robot, three patterns. The camera's images go to two subscribers over a topic. The path comes
# from a service: one request, one response. Driving is an action: a goal goes in, feedback comes
# out all the while, and a result at the end. Every arrow has a QoS profile that controls how it
# behaves.
#
# ```mermaid
# flowchart LR
#     subgraph topics["Topic: publish-subscribe"]
#         camera(["Camera Driver"]) -- "images" --> processing(["Image Processing"])
#         camera -- "images" --> detection(["Object Detection"])
#     end
#     subgraph services["Service: request-response"]
#         navclient(["Navigation Client"]) -- "request: path to B?" --> planner(["Path Planner"])
#         planner -. "response: the path" .-> navclient
#     end
#     subgraph actions["Action: goal, feedback, result"]
#         motion(["Motion Client"]) -- "goal: drive to B" --> server(["Navigation Server"])
#         server -. "feedback: how far" .-> motion
#         server -. "result: arrived" .-> motion
#     end
#     qos["QoS profiles: reliability, durability, history"] --- topics
#     qos --- services
#     qos --- actions
# ```
#
# **Yours.** Count: how many *nodes* does the diagram have?

# %% tags=["notebook-only", "try"]
nodes_in_the_diagram = ...  # YOURS
check.diagram_is_counted(nodes_in_the_diagram)

# %% [markdown]
# *That was part 5. The next takes 25 minutes: the fifth node, and all of them together.*
#
# ## 6. Five nodes, one system (25 minutes)
#
# ### ClientNode: the one who asks
#
# Every 5 seconds this node requests the robot's state and sends a Fibonacci goal of order 5. It
# never blocks: each step is a callback that hands over to the next one.
#
# <details><summary>More: why it does not wait for its servers</summary>
#
# A node that waits without end for a service in its constructor can hang the start of a robot; one
# that waits for an action server inside a timer's callback holds a thread of the executor, for good
# if no server ever comes. So this node asks whether the servers are there, says so in its log if
# they are not, and tries again 5 seconds later. Source: ROS 2 documentation, "Using Callback Groups"
# and "Synchronous vs. asynchronous service clients".
#
# </details>


# %%
class ClientNode(Node):
    """Use the service and the action every 5 seconds, without ever blocking."""

    def __init__(self):
        super().__init__("client_node")
        self.robot_state_client = self.create_client(SetBool, "get_robot_state")
        self.action_client = ActionClient(self, Fibonacci, "fibonacci_sequence")
        self.client_timer = self.create_timer(5.0, self.make_requests)
        self.get_logger().info("Client ready: one request and one goal every 5 s")

    def make_requests(self):
        """Ask the service and the action, as far as they are there."""
        self.request_robot_state()
        self.send_action_goal()

    def request_robot_state(self):
        """Send a request; the response comes to service_response_callback."""
        if not self.robot_state_client.service_is_ready():
            self.get_logger().info("Waiting for robot state service...")
            return
        self.get_logger().info("Making service request...")
        future = self.robot_state_client.call_async(SetBool.Request(data=True))
        future.add_done_callback(self.service_response_callback)

    def service_response_callback(self, future):
        """Take the response, or the reason why there is none."""
        if future.exception() is not None:
            self.get_logger().error(f"Service call failed: {future.exception()}")
            return
        self.get_logger().info(f"Service response: {future.result().message}")

    def send_action_goal(self):
        """Send a goal; what follows comes to the three callbacks below."""
        if not self.action_client.server_is_ready():
            self.get_logger().info("Waiting for action server...")
            return
        self.get_logger().info("Sending action goal...")
        future = self.action_client.send_goal_async(
            Fibonacci.Goal(order=5), feedback_callback=self.action_feedback_callback
        )
        future.add_done_callback(self.action_response_callback)

    def action_feedback_callback(self, feedback_msg):
        """Follow the progress."""
        self.get_logger().info(f"Action feedback: {list(feedback_msg.feedback.sequence)}")

    def action_response_callback(self, future):
        """Learn whether the goal was accepted, and if so ask for its result."""
        goal_handle = future.result()
        if not goal_handle.accepted:
            self.get_logger().info("Action goal rejected")
            return
        self.get_logger().info("Action goal accepted, getting result...")
        goal_handle.get_result_async().add_done_callback(self.action_result_callback)

    def action_result_callback(self, future):
        """Take the result."""
        self.get_logger().info(f"Action result: {list(future.result().result.sequence)}")

    def destroy_node(self):
        """Clean up: the action client, then the node."""
        if self.action_client in self.waitables:
            self.action_client.destroy()
        super().destroy_node()


# %% [markdown]
# Two simulated runs. In the first the client is alone: look at how it stays calm. In the second the
# servers are there, and the log tells the whole conversation. The order of "service response",
# "goal accepted" and the first feedback may differ from run to run; that is what *asynchronous*
# means.
#
# **Yours.** Five seconds are one round of the client. Give it two.


# %% tags=["notebook-only", "try"]
seconds = 5.0  # YOURS


def said(log):
    """What a node logged, as plain strings."""
    return [row.message for row in log]


with course.Session(sim_time=True, threads=4) as lab:
    client = lab.run(ClientNode)
    lab.sim.advance(5.0)
    print("alone:", *said(lab.logs(client)), sep="\n  ")

with course.Session(sim_time=True, threads=4) as lab:
    lab.run(ServiceNode)
    lab.run(ActionNode)
    client = lab.run(ClientNode)
    lab.until(
        lambda: (
            client.robot_state_client.service_is_ready() and client.action_client.server_is_ready()
        ),
        timeout=30.0,
        what="the client to see both servers",
    )
    lab.sim.advance(seconds)
    found = check.client_made_two_rounds(lab)
    print("together:", *said(lab.logs(client)), sep="\n  ")
found

# %% [markdown]
# ### main: all five at once
#
# `main` runs the whole system on a multi-threaded executor with five threads, which is what
# `course.Session(threads=5)` is, until you press Ctrl-C. Leaving the `with` block is the cleanup
# phase of the whole program: the executor stops, its threads are joined, the nodes are destroyed,
# the context is shut down, in that order.
#
# <details><summary>More: the same without <code>course</code></summary>
#
# When Ctrl-C has come, rclpy's own signal handler has already shut the context down: a
# `rclpy.shutdown()` after `except KeyboardInterrupt` finds nothing to shut down, and that call
# raises an error; and the nodes are never destroyed. Callbacks that still run then have no context
# any more either. So take Ctrl-C yourself, stop spinning, and clean up while everything still works:
#
# ```python
# running = True
#
#
# def stop(signal_number, frame):
#     global running
#     running = False
#
#
# signal.signal(signal.SIGINT, stop)  # Ctrl-C
# signal.signal(signal.SIGTERM, stop)  # how the system ends a program
# rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
# executor = MultiThreadedExecutor(num_threads=5)
# nodes = [SensorNode(), ProcessingNode(), ServiceNode(), ActionNode(), ClientNode()]
# for node in nodes:
#     executor.add_node(node)
# try:
#     while running:
#         executor.spin_once(timeout_sec=0.1)
# finally:
#     for node in nodes:
#         node.destroy_node()
#     executor.shutdown()
#     rclpy.shutdown()
# ```
#
# (A callback that is under way at that moment may still print a line; `course` waits for it.)
# Source: rclpy, `rclpy.init`, its `signal_handler_options`.
#
# </details>


# %%
NODE_CLASSES = (SensorNode, ProcessingNode, ServiceNode, ActionNode, ClientNode)


def main():
    """Run the five nodes until Ctrl-C, then clean up."""
    with course.Session(threads=5) as system:
        for node_class in NODE_CLASSES:
            system.run(node_class)
        print(f"ROS 2 building blocks operational on domain {system.domain_id}", flush=True)
        print("All patterns active: topics, services, actions. Ctrl-C ends it.", flush=True)
        system.spin()
        print("Shutting down the ROS 2 building blocks. The last they logged:")
        print(system.logs(last=15))


# %% [markdown]
# In a notebook `main()` would hold the cell until you interrupt the kernel, so here is the same
# system step by step: your crew gets its fifth node. A second session joins the same domain and
# looks on **from outside**, as another computer on the robot would: it must see all five.

# %% tags=["notebook-only"]
for node_class in NODE_CLASSES:
    crew.run(node_class)

outside = course.Session(domain_id=crew.domain_id)
observer = outside.run(Node, "observer")
five = {"sensor_node", "processing_node", "service_node", "action_node", "client_node"}
outside.until(
    lambda: five <= set(observer.get_node_names()),
    timeout=60.0,
    what="the five nodes to be seen from outside",
)
print("Seen from outside:", ", ".join(sorted(five)))

frame = outside.next_message(String, "processed/data", timeout=60.0)
print("Heard from outside:", frame.data)
answer = outside.call(SetBool, "get_robot_state", SetBool.Request(data=True), timeout=60.0)
print("Answered from outside:", answer.message)

# %% [markdown]
# ClientNode asks by itself, 5 seconds after the start and every 5 seconds from then on. Wait for
# its first round, and read the log of all five nodes: this is what a working robot sounds like.

# %% tags=["notebook-only"]
first_round = {
    "Service response: Robot is operational - Mode: True",
    "Action result: [0, 1, 1, 2, 3, 5]",
}
crew.until(
    lambda: first_round <= set(said(crew.logs("client_node"))),
    timeout=60.0,
    what="the response and the result of ClientNode's first round",
)
print(crew.logs(last=25))

# %% [markdown]
# And the end. `close()` says what it could not stop; look for an empty list. Then the observer
# outside has the last word: on the graph nothing of the five is left.

# %% tags=["notebook-only"]
report = crew.close()
outside.until(
    lambda: not five & set(observer.get_node_names()),
    timeout=60.0,
    what="the five nodes to disappear from the graph",
)
left = [name for name in observer.get_node_names() if name in five]
outside_report = outside.close()
print("Leaked:", report.leaked or "nothing")
print("Left on the graph:", left or "nothing")

# %% [markdown]
# #### As a program, outside Jupyter
#
# The five nodes and `main` are a complete program; the cells that experiment are tagged
# `notebook-only`. In a terminal, beside this notebook:
#
# ```
# jupyter nbconvert --to python --output building_blocks ch05-building-blocks.ipynb \
#     --TagRemovePreprocessor.enabled=True \
#     --TagRemovePreprocessor.remove_cell_tags=notebook-only
# python building_blocks.py
# ```
#
# Let it run for ten seconds, then press Ctrl-C. In Jupyter the next cell does nothing, which is as
# it should be.

# %%
if __name__ == "__main__" and "get_ipython" not in globals():
    main()

# %% [markdown]
# *That was part 6. The last takes 20 minutes: your five nodes drive the robot.*
#
# ## 7. The five nodes drive the robot (20 minutes)
#
# Here is a robot in an empty hall, and beside it the graph, in which your five nodes are about to
# appear. So far ActionNode only counted. Now each number becomes a drive: a quarter of a circle
# whose radius grows with the sequence. Joined together they are a **Fibonacci spiral**, as in a
# snail's shell.

# %% tags=["notebook-only"]
from IPython.display import display
from ipywidgets import GridBox

system = course.Session(threads=5)
hall = system.world("hall")
track = system.record("wheel/odometry", timeout=30.0, limit=10_000)
columns = {"grid_template_columns": "minmax(0, 1fr) minmax(0, 1fr)", "grid_gap": "1em"}
display(GridBox([hall.widget, system.graph().widget], layout=columns))

# %% [markdown]
# Nothing else of the system has to change for it: ClientNode sends its goal as always, five seconds
# after the start, and neither knows nor cares what it moves. But a robot has one pair of wheels, so
# a second goal is rejected while one is under way.
#
# **Yours.** As it is, the robot drives straight on. To go round a circle it has to turn with
# `speed / radius`, in radians a second: write it in place of `0.0`, and watch the hall.
#
# Then press the emergency stop while it drives. The robot says so on `emergency/stop`, where your
# ProcessingNode has been listening all along.

# %% tags=["notebook-only", "try"]
from math import pi

from nav_msgs.msg import Odometry


class DrivingActionNode(ActionNode):
    """Drive a quarter of a circle for each number of the sequence."""

    def __init__(self):
        super().__init__()
        self.busy, self.way = False, 0.0  # m that it has come
        self.wheels = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_subscription(Odometry, "wheel/odometry", self.measure, 10)

    def measure(self, odometry):
        self.way += odometry.twist.twist.linear.x / 20  # it comes 20 times a second

    def goal_callback(self, goal):
        return GoalResponse.REJECT if self.busy else super().goal_callback(goal)

    def execute_fibonacci_callback(self, goal_handle):
        self.busy = True
        try:
            return super().execute_fibonacci_callback(goal_handle)
        finally:
            self.busy = False

    def do_step(self, number):
        speed, radius = 0.4, 0.25 * number  # m/s, m
        command = Twist()
        command.linear.x = speed
        command.angular.z = 0.0  # YOURS: radians a second
        end = self.way + pi / 2 * radius
        while self.way < end:
            self.wheels.publish(command)
            if self._stopping.wait(0.05):
                return True
        self.wheels.publish(Twist())
        return False


hall.reset()
track.clear()
for node_class in (SensorNode, ProcessingNode, ServiceNode, DrivingActionNode, ClientNode):
    system.run(node_class)
found = check.spiral_is_driven(system, hall, track)
system.stop(ClientNode)  # one drive is enough
found

# %% [markdown]
# This is how it went, in the words of the nodes:

# %% tags=["notebook-only"]
system.logs(level="INFO", last=30)

# %% [markdown]
# That is ROS 2: five simple parts, three patterns, and a robot that moves. Change what you like and
# drive again. When you have seen enough, end it:

# %% tags=["notebook-only"]
system.stop()  # first the nodes, so that ActionNode ends a drive that is under way
system_report = system.close()
print("Leaked:", system_report.leaked or "nothing")

# %% [markdown]
# ## Exercises
#
# *About an hour each.* Each exercise is a notebook of its own in the folder `ch05` beside the
# chapters, worth 20 points. You build something, and an examiner watches on real DDS what it does;
# then you explain your reasons, and a person reads them.
#
# **1. QoS profile design** ([notebook](ch05/qos-design.ipynb)). Design the QoS profile of a mobile
# robot's camera, LIDAR, IMU and emergency stop button: reliability, durability, history, and why.
#
# **2. Node architecture design** ([notebook](ch05/architecture.ipynb)). A robot drives through
# waypoints and avoids obstacles. Which nodes, which communication patterns, and how do they work
# together?
#
# **3. Communication pattern selection** ([notebook](ch05/patterns.ipynb)). Topic, service or
# action, and why? The robot's current position, camera images, a navigation goal to a particular
# place, updating parameters, broadcasting the battery level.
#
# **4. Resource management** ([notebook](ch05/resources.ipynb)). What has to be done during
# initialization, while a node runs, and during cleanup?
#
# **5. Error handling** ([notebook](ch05/error-handling.ipynb)). How do the services and actions of
# a safety-critical robot deal with errors, and what does it do while it waits for an answer that
# does not come?
#
# Stuck? `session.diagnose()` says why nothing arrives:

# %% tags=["notebook-only"]
session.diagnose()

# %% [markdown] tags=["solutions"]
# ## Exercise solutions
#
# <details><summary>Show them. Other answers can be just as good; what counts is the reason.</summary>
#
# **1. QoS profile design**
#
# | Sensor | Reliability | Durability | History | Reason |
# | --- | --- | --- | --- | --- |
# | Camera | `BEST_EFFORT` | `VOLATILE` | `KEEP_LAST`, depth 5 | real-time performance matters more than a lost frame |
# | LIDAR | `RELIABLE` | `VOLATILE` | `KEEP_LAST`, depth 1 | navigation must not miss its data, and only the latest scan is of use |
# | IMU | `RELIABLE` | `VOLATILE` | `KEEP_LAST`, depth 10 | control depends on it; processing gets a small buffer |
# | Emergency stop | `RELIABLE` | `VOLATILE` | `KEEP_ALL` | it must be delivered, and every event is preserved |
#
# For the LIDAR, reliable with depth 1 gives the *latest value*, not *every value*: a slow reader
# loses the scans in between, as in experiment 3. Drivers in the field often publish best-effort, the
# profile called sensor data, and then a subscriber which requests `RELIABLE` gets nothing. Source:
# ROS 2 documentation, "Quality of Service settings".
#
# **2. Node architecture design**
#
# | Node | Takes in | Gives out |
# | --- | --- | --- |
# | Navigation | goals, as an action server; sensor data, by topic | feedback and result |
# | Obstacle detection | LIDAR and camera, by topic | obstacles, by topic |
# | Path planner | map and goal, by topic; requests, as a service | the planned path, as the response |
# | Controller | navigation commands, by topic | commands to the motors, by topic |
# | Sensor drivers | the hardware | sensor data, by topic |
# | State estimation | the sensors, by topic | the robot's pose, by topic |
#
# **3. Communication pattern selection**
#
# - Current position: **service**. A synchronous request-response is needed.
# - Camera images: **topic**. A continuous stream with several subscribers.
# - Navigation goal: **action**. It runs for long, and gives feedback.
# - Updating parameters: **service**. It has to be confirmed, synchronously.
# - Battery level: **topic**. Continuous monitoring by several subscribers.
#
# Make the battery's topic transient-local with depth 1, and a display that starts late shows the
# level at once. For parameters you need not write the service: every node offers it through the
# parameter API. Sources: ROS 2 documentation, "Quality of Service settings" and "Parameters".
#
# **4. Resource management**
#
# - *Initialization*: set up the internal state and every endpoint: publishers, subscribers,
#   services, actions.
# - *Runtime*: process callbacks, manage timers, keep the data flowing.
# - *Cleanup*: take publishers and subscribers down properly, release what else is held, and handle
#   a shutdown gracefully.
#
# **5. Error handling**
#
# - *Services*: return error codes and messages; have timeouts; have a way to retry.
# - *Actions*: handle cancellation; report errors in the feedback; have timeouts.
# - *In general*: use `try` and `except`; log errors where they help; have a fallback behaviour.
#
# Retry only what may safely happen twice. A request whose response was lost may have been carried
# out all the same.
#
# </details>

# %% [markdown]
# ## Summary
#
# 1. **Nodes**, the basic units of processing, perform one function each and manage their lifecycle
#    and their resources with care.
# 2. **Topics** share data continuously by publish-subscribe; their Quality of Service is yours to
#    set.
# 3. **Services** are synchronous request-response, for operations that need an answer at once.
# 4. **Actions** are goal, feedback and result, for long operations that must be watched.
# 5. **QoS profiles** set how communication behaves: reliability, durability, history.
# 6. **Choosing a pattern** is a matter of timing, data flow and interaction. Each has its place.
#
# Simple parts, joined by well-defined interactions, make complex robots. Used properly and with
# fitting QoS they make applications that are robust, efficient and easy to maintain, from a single
# robot to a team of them.
#
# What still runs of all that you have started is the robot of the beginning, and your nodes:

# %% tags=["notebook-only"]
# %ros node list

# %% [markdown]
# ## Part 2 Quiz
#
# Five questions to check what stayed. To pass you need **4 of 5**: the mark is 70 %,
# and 70 % of 5 is 3.5. Answer each in a sentence of your own first, then take
# **[the quiz](ch05-quiz/quiz.ipynb)**: it asks about the same five things in other words each time,
# and tells you afterwards why a wrong answer tempts, with a cell that shows it.
#
# 1. What are QoS (Quality of Service) profiles in ROS 2 mainly for?
# 2. A camera publishes images. Which communication pattern fits best?
# 3. A publisher and its subscriber are both `RELIABLE`. What does that guarantee in ROS 2?
# 4. Navigation takes a minute and should report how far it has come. Which pattern is best?
# 5. Services and actions: what is the main difference in ROS 2?
#
# ## Preview: the next chapter
#
# **[Chapter 6: Python rclpy](ch06-python-rclpy.ipynb).** We look closely at the Python client
# library for ROS 2. You will write more sophisticated nodes, use advanced features such as
# parameters and timers, and connect to real hardware. It takes you from understanding the building
# blocks to building production-ready robotic applications with them.
#
# *The robot at the top goes on until you close this notebook, or say* `course.close()`.
