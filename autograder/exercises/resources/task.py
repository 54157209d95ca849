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

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-task", "locked": true, "schema_version": 3, "solution": false}
# # Exercise 4: Resource management
#
# A delivery robot runs for weeks. Its camera driver does not: it is restarted after every update,
# after every unplugged cable, and each time the robot changes between day and night mode. Whatever
# one life of the driver leaves behind (an endpoint on the graph, a thread, an open device, memory)
# is still there in the next life, and after some hundred lives the robot stands still.
#
# You write the driver twice: as a plain node that cleans up after itself, and as a managed
# (lifecycle) node whose states say what it holds.
#
# The camera comes with a library, `Camera`, in the next cell. As with real devices, an open camera
# is a descriptor of the process, it can be opened **once** at a time, and nobody closes it for you.
#
# ## The plain node: `CameraDriver(device='front')`
#
# | Phase | What it does |
# |---|---|
# | Initialization | Opens `Camera(device)` and starts its stream. If either raises, the constructor raises too, and leaves **nothing** behind: no node, no endpoint, no thread, no open camera, and less than 1 MiB of memory each time. Nobody calls `destroy_node()` on a node that was never made. The endpoints are there when the constructor returns. |
# | Running | Publishes a picture on `camera/image` (`sensor_msgs/Image`) 10 times a second, one after the other, by a ROS timer or the node's clock: the examiner moves simulated time. One `std_msgs/Int32` on `camera/zoom` sets the zoom of all next pictures; a factor that the camera refuses costs that one message and nothing else (catch its `ValueError`: here a session goes on when a callback raises, but `rclpy.spin()` in a program of your own would end). The service `camera/snapshot` (`std_srvs/Trigger`) takes one picture at once, publishes it too, and answers with `success=True` when it has been published. |
# | Cleanup | `destroy_node()` is the one door; rclpy, a session and the examiner all use it. After it no node and no endpoint of the driver is left on the graph, the camera is closed, and every thread of the driver has ended (within a second). It may be called twice, while the node spins, and while one of its callbacks is still waiting for the camera, which then ends, too. The driver can then be started again. |
#
# Over 50 lives the process keeps its number of threads and open files, and grows by less than
# 100 KiB a life; a life with many snapshots and refused zooms leaves no thread and no open file
# either. A driver that takes long to start and end is given fewer of them.
#
# ## The managed node: `ManagedCamera()`
#
# An `rclpy.lifecycle.LifecycleNode` with two parameters, `device` (a string, `'front'`) and `rate`
# (a double in Hz, `10.0`, allowed are values above 0 and up to 30). It publishes `camera/image` as
# well, `rate` times a second; it has no zoom and no snapshot.
#
# | State | What it holds |
# |---|---|
# | `unconfigured` | Nothing: no camera, no publisher on `camera/image`. |
# | `inactive` | The open camera and the publisher, with the parameters read when it was configured. The stream is stopped; the node sends no picture and asks the camera for none. |
# | `active` | The stream and the timer as well; the pictures that it sends were taken since it was activated. |
# | `finalized` | Nothing, wherever the shutdown came from. |
#
# A configuration that is not possible (a rate out of bounds, a camera that cannot be opened) leaves
# the node in `unconfigured`, without a further thread or open file, and with good parameters it can
# then be configured. A stream that does
# not start when the node is activated is an error: the node ends in `unconfigured` or `finalized`.
# In each of these cases it holds what the table says, and every thread that it started has ended
# when it is not active any more. `destroy_node()` gives everything back whatever the state, takes
# the node off the graph, with every other node that it made, and may be called twice. Over ten
# rounds from `unconfigured` to `active` and back the process keeps its number of threads and open
# files, the graph its number of nodes, and a round costs less than 1 MiB of memory.
#
# Your work is examined by what your nodes **do**. Another process starts and ends them, drives the
# state machine over its services, listens on the wire, and looks from outside at the threads, open
# files and memory of your process. How you write it is your choice.
#
# **20 points:** 10 for the visible checks, 5 for checks that run when your work is graded, 5 for
# your explanations.

# %% nbgrader={"grade": false, "grade_id": "resources-given", "locked": true, "schema_version": 3, "solution": false}
# %load_ext course

import array
import errno
import os
import queue
import tempfile
import threading

from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from sensor_msgs.msg import Image
from std_msgs.msg import Int32
from std_srvs.srv import Trigger


class Camera:
    """The robot's camera, as its maker's library gives it to you. Nobody closes it for you.

    It may be used from several threads. `front` and `rear` work, and so does nearly every other
    name. Devices whose names begin with these words have something wrong with them:
    `unplugged` cannot be opened, `stuck` does not start its stream, `slow` exposes for 0.3 s.
    """

    SIZE = 256  # pixels in each direction
    ZOOM = range(1, 9)

    _in_use = set()
    _registry = threading.Lock()

    def __init__(self, device):
        """Open a device. Raises OSError if it is not there or is in use."""
        if device.startswith('unplugged'):
            raise OSError(errno.ENODEV, f'there is no camera {device!r}')
        with Camera._registry:
            if device in Camera._in_use:
                raise OSError(errno.EBUSY, f'the camera {device!r} is in use')
            Camera._in_use.add(device)
        self.device = device
        self._exposure = 0.3 if device.startswith('slow') else 0.0  # s
        self._zoom = 1
        self._file = self._entry(f'camera:{device}')
        self._stream = None
        self._closed = threading.Event()
        self._lock = threading.Lock()

    def start(self):
        """Start the stream. Raises OSError if it does not start."""
        with self._lock:
            self._require_open()
            if self.device.startswith('stuck'):
                raise OSError(errno.EIO, f'the stream of camera {self.device!r} does not start')
            if self._stream is None:
                self._stream = self._entry(f'camera-stream:{self.device}')

    def stop(self):
        """Stop the stream."""
        with self._lock:
            if self._stream is not None:
                os.close(self._stream)
                self._stream = None

    def zoom(self, factor):
        """Set the zoom of the next pictures. Raises ValueError for a factor that it does not have."""
        if factor not in Camera.ZOOM:
            raise ValueError(f'the camera has no zoom {factor}: choose one of 1 to 8')
        self._zoom = factor

    def read(self):
        """Wait for the exposure and return a picture, a `sensor_msgs/Image`.

        Raises OSError if the stream does not run, or the camera is closed before the picture is
        there.
        """
        with self._lock:
            self._require_open()
            # The position in the device's file counts how often somebody asked for a picture.
            number = os.lseek(self._file, 1, os.SEEK_CUR) - 1
            if self._stream is None:
                raise OSError(errno.EIO, f'the stream of camera {self.device!r} does not run')
        self._closed.wait(self._exposure)
        with self._lock:
            self._require_open()
        label = f'{self.device} {number} {self._zoom}\n'.encode()
        pixels = array.array('B', label.ljust(Camera.SIZE**2, b'\x80'))
        return Image(
            height=Camera.SIZE, width=Camera.SIZE, step=Camera.SIZE, encoding='mono8', data=pixels
        )

    def close(self):
        """Give everything back; who waits for a picture gets an OSError. May be called twice."""
        self.stop()
        with self._lock:
            if not self._closed.is_set():
                self._closed.set()
                with Camera._registry:
                    Camera._in_use.discard(self.device)
                    os.close(self._file)

    def _require_open(self):
        if self._closed.is_set():
            raise OSError(errno.EBADF, f'the camera {self.device!r} is closed')

    @staticmethod
    def _entry(name):
        """Open a file that is there only as long as it is open, like the entry of a device."""
        with tempfile.TemporaryDirectory() as folder:
            return os.open(f'{folder}/{name}', os.O_RDWR | os.O_CREAT)


# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-your-work", "locked": true, "schema_version": 3, "solution": false}
# ## The plain node
#
# The driver below takes pictures, and leaks everything that it opens: run the cell, then
# `course.run(CameraDriver)` in a cell of your own, and then the same once more. The zoom and the
# snapshot are missing. Reading a camera can block, so a worker thread does it; you may keep that,
# or do it in another way.

# %% nbgrader={"grade": false, "grade_id": "resources-solution", "locked": false, "schema_version": 3, "solution": true}
class CameraDriver(Node):
    """Publishes what the camera sees."""

    def __init__(self, device='front'):
        super().__init__('camera_driver')
        self.camera = Camera(device)
        self.camera.start()
        self.publisher = self.create_publisher(Image, 'camera/image', 10)
        self.ticks = queue.Queue()
        threading.Thread(target=self.loop, daemon=True).start()
        self.create_timer(0.1, lambda: self.ticks.put('now'))

    def loop(self):
        while True:
            self.ticks.get()
            self.publisher.publish(self.camera.read())

### BEGIN SOLUTION
END = object()


class CameraDriver(Node):
    """Publishes what the camera sees, and leaves nothing behind."""

    def __init__(self, device='front'):
        super().__init__('camera_driver')
        # First everything that destroy_node() looks at: it must work on half a node, too.
        self.camera = None
        self.worker = None
        self.orders = queue.SimpleQueue()
        try:
            self.open(device)
        except BaseException:
            self.destroy_node()
            raise

    def open(self, device):
        self.images = self.create_publisher(Image, 'camera/image', 10)
        self.create_subscription(Int32, 'camera/zoom', self.zoom, 10)
        self.create_service(Trigger, 'camera/snapshot', self.snapshot)
        self.worker = threading.Thread(target=self.work, daemon=True)
        self.worker.start()
        self.camera = Camera(device)
        self.camera.start()
        self.create_timer(0.1, self.order)

    def order(self):
        if self.orders.empty():  # a camera that is slow is not given a heap of orders
            self.orders.put(None)

    def work(self):
        while self.orders.get() is not END:
            self.take_picture()

    def take_picture(self):
        try:
            picture = self.camera.read()
        except OSError:
            return False  # closed meanwhile
        self.images.publish(picture)
        return True

    def zoom(self, message):
        try:
            self.camera.zoom(message.data)
        except ValueError as error:
            self.get_logger().warning(str(error))

    def snapshot(self, request, response):
        response.success = self.take_picture()
        return response

    def destroy_node(self):
        # The users of a resource end before the resource itself: thread, camera, endpoints.
        if self.worker is not None:
            self.orders.put(END)
            self.worker.join()
            self.worker = None
        if self.camera is not None:
            self.camera.close()
        super().destroy_node()
### END SOLUTION


# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-your-lifecycle", "locked": true, "schema_version": 3, "solution": false}
# ## The managed node
#
# The class below is a lifecycle node already: it goes through its states, and does nothing in any
# of them. `rclpy.lifecycle.LifecycleNode` calls `on_configure`, `on_activate`, `on_deactivate`,
# `on_cleanup`, `on_shutdown` and `on_error`, each with the state that it comes from. Each returns a
# `TransitionCallbackReturn`: `SUCCESS`, `FAILURE` (back to where it came from) or `ERROR`, which an
# exception means as well.

# %% nbgrader={"grade": false, "grade_id": "resources-lifecycle", "locked": false, "schema_version": 3, "solution": true}
class ManagedCamera(LifecycleNode):
    """Publishes what the camera sees, but only while it is active."""

    def __init__(self):
        super().__init__('managed_camera')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)

### BEGIN SOLUTION
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class ManagedCamera(LifecycleNode):
    """Publishes what the camera sees, but only while it is active."""

    camera = images = timer = None

    def __init__(self):
        super().__init__('managed_camera')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)

    def on_configure(self, state):
        self.rate = self.get_parameter('rate').value
        if not 0.0 < self.rate <= 30.0:
            self.get_logger().error(f'rate must be above 0 and at most 30 Hz, not {self.rate}')
            return FAILURE
        try:
            self.camera = Camera(self.get_parameter('device').value)
        except OSError as error:
            self.get_logger().error(str(error))
            return FAILURE
        self.images = self.create_lifecycle_publisher(Image, 'camera/image', 10)
        return super().on_configure(state)

    def on_activate(self, state):
        self.camera.start()  # what it raises leads to on_error()
        self.timer = self.create_timer(1.0 / self.rate, self.take_picture)
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.halt()
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        self.release()
        return SUCCESS

    def on_shutdown(self, state):
        self.release()
        return SUCCESS

    def on_error(self, state):
        self.release()
        return SUCCESS

    def take_picture(self):
        self.images.publish(self.camera.read())

    def halt(self):
        if self.timer is not None:
            self.destroy_timer(self.timer)
            self.timer = None
        if self.camera is not None:
            self.camera.stop()

    def release(self):
        self.halt()
        if self.camera is not None:
            self.camera.close()
            self.camera = None
        if self.images is not None:
            self.destroy_lifecycle_publisher(self.images)
            self.images = None

    def destroy_node(self):
        self.release()
        super().destroy_node()
### END SOLUTION


# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-how-to-check", "locked": true, "schema_version": 3, "solution": false}
# ## Check it yourself
#
# The next cell starts an examiner in a process of its own. It takes a few seconds. For each check
# it says what was observed, what was needed, and why it matters on a robot. Ask for more help with
# `check("resources", hint=2)` or `hint=3` in a cell of your own.
#
# **Look inside**, in cells of your own after `import course` and `course.run(CameraDriver)`:
# `course.session().diagnose()` names a callback that is stuck, with the line where it is, and
# `%ros node info /camera_driver` lists what is left of the node on the graph.

# %% nbgrader={"grade": true, "grade_id": "resources-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("resources")

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next cell is empty for you. When your work is graded, it examines the rest of the two tables:
# a zoom that the camera refuses, a cleanup while the camera is busy, a configuration that is not
# possible, a stream that does not start, and a shutdown from each state.

# %% nbgrader={"grade": true, "grade_id": "resources-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("resources", part="hidden")
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-question-initialization", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your choices
#
# Explain in two or three sentences each how your nodes manage their resources, and name places in
# your own code. An instructor reads this: each answer gives one point, or half a point if only a
# part of the question is answered.
#
# ### Initialization
#
# What is created there, and what does the constructor do if a step in its middle fails?

# %% [markdown] nbgrader={"grade": true, "grade_id": "resources-explanation-initialization", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# The endpoints, the worker thread and the camera's stream are made in `open()`. If a step raises,
# the constructor calls `destroy_node()`, which works on half a node because `camera` and `worker`
# exist (as `None`) before anything can fail, and then raises again: a process must learn that it
# has no camera.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-question-running", "locked": true, "schema_version": 3, "solution": false}
# ### Running
#
# Who may use the camera at which moment, and what must a callback that raises not leave behind?

# %% [markdown] nbgrader={"grade": true, "grade_id": "resources-explanation-running", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# The timer only orders a picture, the worker reads it, so a slow camera never blocks the executor;
# a snapshot reads beside it, as the camera may be used from several threads. A refused zoom is
# caught in its callback; no lock is held there and nothing is half changed, so the next message is
# handled as usual.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-question-cleanup", "locked": true, "schema_version": 3, "solution": false}
# ### Cleanup
#
# In which order do thread, camera and endpoints end in your code, and what could happen in another
# order?

# %% [markdown] nbgrader={"grade": true, "grade_id": "resources-explanation-cleanup", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# From the users to the used: first the worker ends and is waited for, then the camera is closed,
# then rclpy destroys the endpoints. The other way round the worker would read from a closed camera
# or publish with a destroyed publisher.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-question-leaks", "locked": true, "schema_version": 3, "solution": false}
# ### Leaks
#
# How does a leak that one life does not show stop the robot after some hundred lives? Give an
# example, and say where your code prevents it.

# %% [markdown] nbgrader={"grade": true, "grade_id": "resources-explanation-leaks", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# A thread that nobody ends costs little, and one life does not show it. A robot that restarts its
# driver every ten minutes has a thousand of them in a week; at some point a thread or a file cannot
# be made any more, in a node that did nothing wrong. `destroy_node()` puts `END` into the queue and
# joins the worker.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-question-lifecycle", "locked": true, "schema_version": 3, "solution": false}
# ### Lifecycle
#
# What does each state of your managed node hold, and what does a supervisor gain by that?

# %% [markdown] nbgrader={"grade": true, "grade_id": "resources-explanation-lifecycle", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# Unconfigured holds nothing, inactive has the camera open with its stream stopped, active streams.
# A supervisor can open all devices first, see that each is there, and let the robot drive only
# then; and it can bring back a failed driver without ending its process.
# ### END SOLUTION
