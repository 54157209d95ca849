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

# %% [markdown] nbgrader={"grade": false, "grade_id": "executors-task", "locked": true, "schema_version": 3, "solution": false}
# # Exercise 6.2: Executors and callback groups
#
# One node watches over a robot. It beats for the motors, has parts of the robot inspected, and looks
# at scans. The inspections and the scans are slow. **The beat must not be.** You write the node
# `Guard`; it runs in an executor with 4 threads.
#
# | | Name | Type | What it does |
# |---|---|---|---|
# | publishes | `safety/beat` | `std_msgs/msg/Int32` | a count from 1 on without gaps, 20 times a second |
# | hears | `inspect` | `std_msgs/msg/String` | a part to have inspected: the service is called |
# | calls | `inspection` | `std_srvs/srv/Trigger` | answers after a while, or a long while |
# | publishes | `report` | `std_msgs/msg/String` | the `message` of each answer |
# | hears | `scan` | `std_msgs/msg/Int32` | a scan to look at with `analyse(self, scan)`, half a second each |
# | publishes | `result` | `std_msgs/msg/Int32` | what `analyse` returned, for every scan, in any order |
# | publishes | `handled` | `std_msgs/msg/Int32` | 1, 2, 3, ...: how many reports and results there were |
#
# 1. **Nothing holds up the beat**, also when six inspections or six scans come at once. No callback
#    waits for an answer: it takes a thread of the four.
# 2. **Nothing is lost.** Each report and each result is counted once. The count stands in
#    `self.book`, a `Logbook`, which is slow to write, and is used by every callback that counts.
# 3. All times are those of the node's clock, as the half second of `analyse` is. A node hears its
#    clock in its default callback group: a callback there that takes time waits for ever.
#
# **20 points:** 12 for the visible checks, 4 for a check that runs when your work is graded, 4 for two
# written answers.

# %% nbgrader={"grade": false, "grade_id": "executors-given", "locked": true, "schema_version": 3, "solution": false}
import threading
import time

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.node import Node
from std_msgs.msg import Int32, String
from std_srvs.srv import Trigger


def analyse(node, scan):
    """Look at a scan: a computation that takes half a second of the robot's time."""
    node.get_clock().sleep_for(Duration(seconds=0.5))
    return 2 * scan


class Logbook:
    """Holds a number; to write it takes a moment."""

    def __init__(self):
        self._number = 0

    def read(self):
        return self._number

    def write(self, number):
        time.sleep(0.005)
        self._number = number

# %% [markdown] nbgrader={"grade": false, "grade_id": "executors-your-work", "locked": true, "schema_version": 3, "solution": false}
# ## Your node
#
# The cell below runs as it is: a node with a book and no work.

# %% nbgrader={"grade": false, "grade_id": "executors-solution", "locked": false, "schema_version": 3, "solution": true}
class Guard(Node):
    """Beats for the motors, whatever else it does."""

    def __init__(self):
        super().__init__('guard')
        self.book = Logbook()
        ### BEGIN SOLUTION
        self.lock = threading.Lock()
        self.count = 0
        self.beats = self.create_publisher(Int32, 'safety/beat', 10)
        self.reports = self.create_publisher(String, 'report', 10)
        self.results = self.create_publisher(Int32, 'result', 10)
        self.handled = self.create_publisher(Int32, 'handled', 10)
        self.safety = MutuallyExclusiveCallbackGroup()
        self.slow = MutuallyExclusiveCallbackGroup()
        self.asking = MutuallyExclusiveCallbackGroup()
        self.create_timer(0.05, self.beat, callback_group=self.safety)
        self.client = self.create_client(Trigger, 'inspection', callback_group=self.asking)
        self.create_subscription(
            String, 'inspect', self.inspect, 10, callback_group=self.asking
        )
        self.create_subscription(Int32, 'scan', self.look, 10, callback_group=self.slow)

    def beat(self):
        self.count += 1
        self.beats.publish(Int32(data=self.count))

    def inspect(self, part):
        self.client.call_async(Trigger.Request()).add_done_callback(self.report)

    def report(self, future):
        self.reports.publish(String(data=future.result().message))
        self.note()

    def look(self, scan):
        self.results.publish(Int32(data=analyse(self, scan.data)))
        self.note()

    def note(self):
        with self.lock:
            number = self.book.read() + 1
            self.book.write(number)
            self.handled.publish(Int32(data=number))
        ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "executors-how-to-check", "locked": true, "schema_version": 3, "solution": false}
# ## Check it yourself
#
# The next cell examines your node: the examiner plays the service, and is slow on purpose.

# %% nbgrader={"grade": true, "grade_id": "executors-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("executors")

# %% [markdown] nbgrader={"grade": false, "grade_id": "executors-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next cell is empty for you. When your work is graded, it examines rule 2.

# %% nbgrader={"grade": true, "grade_id": "executors-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("executors", part="hidden")
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "executors-question-groups", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your choices
#
# Two or three sentences each. An instructor reads this: each answer gives two points, or one if only
# a part of the question is answered.
#
# ### Groups
#
# Which callbacks of your node may run at the same time, and which not? What would happen to the beat
# if all were in one mutually exclusive group, although four threads are there?

# %% [markdown] nbgrader={"grade": true, "grade_id": "executors-explanation-groups", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# The beat has a group of its own, so it runs beside everything else; scans are in another one and
# come one after the other. In one mutually exclusive group only one callback of the node runs at a
# time: three threads would be idle while a scan is analysed, and the beat would wait half a second.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "executors-question-lock", "locked": true, "schema_version": 3, "solution": false}
# ### The book
#
# How can a count get lost although each callback adds 1? What prevents it in your node?

# %% [markdown] nbgrader={"grade": true, "grade_id": "executors-explanation-lock", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Two callbacks on two threads both read 7 before one of them has written, and then both write 8. A
# lock around reading and writing makes the second wait until the first is done. Counting in one
# mutually exclusive group would do as well, as its callbacks never run side by side.
# ### END SOLUTION
