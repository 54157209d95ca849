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
# ![One life of the camera driver after the other: a driver that leaks leaves a thread and two open files each time, one that cleans up leaves nothing](resources.svg)
#
# A camera driver is restarted after every unplugged cable. What its lives leave behind adds up, until
# the robot stands still. You write it as a plain and as a managed (lifecycle) node. This takes about
# 90 minutes.

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-must-do", "locked": true, "schema_version": 3, "solution": false}
# ## What it must do
#
# - **`CameraDriver(device)`** opens its camera and publishes 10 pictures a second on
#   `camera/image`. A number on `camera/zoom` sets the zoom; the service `camera/snapshot` publishes
#   one more picture, then answers.
# - **A start that fails** raises, and leaves no node, thread or open camera.
# - **`destroy_node()`** gives everything back within 1 s, also when called twice, or while a
#   callback waits for the camera. 50 lives leave no thread or open file, and less than 100 KiB each.
# - **`ManagedCamera()`** holds nothing when `unconfigured` or `finalized`, its camera and publisher
#   when `inactive`, and streams only when `active`, at its `rate` (above 0, up to 30 Hz).
# - A bad configuration leaves it `unconfigured`; a stream that does not start ends there or in
#   `finalized`. A shutdown gives everything back.

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-try-it", "locked": true, "schema_version": 3, "solution": false}
# ## Try it
#
# In a cell of your own, once the cells of the plain node have run:
#
# ```python
# import course
#
# course.lives(lambda life: CameraDriver(f'front{life}'), 'camera/image')
# ```
#
# `CameraDriver('stuck')` alone is a start that fails. (`course.run` would tidy up for you.)

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-fine-print", "locked": true, "schema_version": 3, "solution": false}
# <details><summary>What exactly is examined</summary>
#
# **Both nodes**
#
# - **By what they do.** Another process starts and ends your nodes, drives the state machine over
#   its services, listens on the wire, and looks from outside at the threads, open files and memory
#   of your process. Nobody reads your code: worker threads or none, helper nodes, QoS and node
#   names are your choice.
# - **Time** is simulated, so pictures are timed by a ROS timer or by the node's clock. While it
#   stands still none comes, but for snapshots. A rate is right if about as many come: one more or
#   less in ten, three more or less at 30 Hz. It is counted up to three times, twice with time going
#   on slowly.
# - **An end within a second**: what is to be gone or closed is looked for as long as anything is at
#   work in your process, up to 8 s. A busy machine is not held against you. A call of
#   `destroy_node()` has 10 s.
# - **Once more, in a plain program.** When your work is graded, your nodes also run in programs of
#   rclpy that spin until Ctrl-C, and then call `destroy_node()` twice. The driver has four lives
#   there. By the machine's clock it takes 10 pictures a second (6 to 16 do). After each life
#   nothing of it is on the graph, its camera is closed, no thread and no file is left, and less
#   than 1 MiB of memory. Beside the last life `CameraDriver('stuck')` is tried three times, which
#   leaves nothing either (less than 1 MiB each), and last `CameraDriver('unplugged')` ends the
#   program. The managed camera has three lives, each ended while it is active: at its `rate` (15 to
#   25 Hz, 0.6 to 1.6 times as many do), with five rounds through its states that keep less than
#   1 MiB each, and with nothing left after Ctrl-C, no helper node either. What is found counts in
#   the check below that looks at the same.
#
# **The plain node**
#
# - **It works** (all other checks of the plain node need that). When the constructor has returned
#   there are a publisher on `camera/image` (`sensor_msgs/Image`), a subscription to `camera/zoom`
#   (`std_msgs/Int32`) and a service `camera/snapshot` (`std_srvs/Trigger`), and the camera that it
#   was told is open; without an argument that is `'front'`. 10 pictures a second come, one by one:
#   in 0.1 s there is one. A snapshot may come between two of them at any time, and costs none.
# - **Its snapshots.** Each is answered with `success=True` while time stands still, and publishes
#   one picture that the camera has taken since it was asked for, and no second one (three
#   snapshots, at most four pictures: one of the timer may be on its way). It need not overtake
#   pictures that are being taken. The answer comes when its picture has been published.
# - **Its zoom.** A factor from 1 to 8 holds for all next pictures, those of snapshots and the
#   others (seen within 20 of them), until another one is sent. One message is enough.
# - **Endpoints gone.** After one call of `destroy_node()`, with nobody who tidies up, no endpoint
#   of the node is on the graph, not the node itself, and no other node that it has made.
# - **Camera given back.** After `destroy_node()` the camera is closed; a driver that is started
#   with the same device takes pictures.
# - **Flat lives.** After a first life 25 are made, in which a few pictures are taken, and 25 more
#   if the first have left something. Only what both have left counts: half a thread or half an open
#   file a life, or 100 KiB of memory (what is less than 640 KiB in all does not count). This is
#   measured in a session of the course, in which a bare `Node` costs about 2 KiB a life. (In plain
#   rclpy it costs about 100 KiB: do not measure there.) If your lives take long, there are as many
#   as fit into 2 s, but at least six, and memory then counts only if it goes on to grow in 24
#   lives. One life with 20 snapshots leaves no thread and no open file.
# - **Cleaned up twice.** `destroy_node()` is called twice while the node spins. Neither call
#   raises, both return. The camera is closed, and every thread that was started in this life has
#   ended, while the program still refers to the node. A next driver takes pictures.
# - **A failed start.** `CameraDriver` raises for a device whose name begins with `unplugged` or
#   `stuck`, and for one that is open already. (`SystemExit` will do.) Afterwards that camera is
#   closed. Nobody has a node to call `destroy_node()` on, so the constructor does it: what it
#   raised is kept, as a notebook keeps its last traceback, and a node that was not destroyed stays
#   on the graph with it. After such starts, one that works, and its end, nothing is on the graph.
#   Three such starts leave no thread and no open file (two of either count), and less than 1 MiB of
#   memory each; memory counts only if three more leave it as well.
# - **A refused zoom** (hidden). After a zoom above 8, of 0 and of -1 the next pictures have the
#   zoom of before; then a zoom of 1 is followed, and the rate is right. 20 refused zooms leave no
#   thread and no open file when the life is over. Catch the camera's `ValueError`: a session goes
#   on when a callback raises, and so does the examination, but in a program of your own
#   `rclpy.spin()` would end.
# - **Cleaned up while busy** (hidden). With a camera that exposes for 0.3 s, `destroy_node()` is
#   called while a callback waits for the picture of a snapshot. The camera is closed, nothing is on
#   the graph, the callback ends, and the next driver follows a zoom. With a slow camera that is
#   some pictures behind, `destroy_node()` does not wait for all of them: while it runs, at most
#   five more are asked for.
#
# **The managed node**
#
# - **It works** (all other checks of the managed node need that). An
#   `rclpy.lifecycle.LifecycleNode`. After “configure” the camera that its parameter `device` names
#   is open. After “activate” 10 pictures a second come on `camera/image`, one by one; there is no
#   zoom and no snapshot. “deactivate” and “cleanup” succeed.
# - **Silent when inactive.** After “configure” and after “deactivate” the stream is stopped, and
#   for 1 s the camera is asked for no picture. After “deactivate” the camera is still open and the
#   publisher there. Nothing is published then, and after the next “activate” only pictures that
#   were taken since, at the right rate. A picture that a slow camera was just taking at
#   “deactivate” is not sent when that has succeeded.
# - **Gives back.** Before the first “configure” there is no publisher on `camera/image`; the
#   parameters are `device` (a string, `'front'`) and `rate` (a double, `10.0`). “configure” reads
#   them: at 10 Hz, 30 Hz and one slow rate (1.5 to 4.5 Hz) the right number comes. What is set
#   later holds from the next “configure” on, or is refused. After “cleanup” the camera is closed,
#   and there is no publisher. Ten rounds from “configure” to “cleanup” leave no thread, no open
#   file and no node (half of one a round counts), and less than 1 MiB of memory a round (more
#   counts only if ten further rounds leave it as well). Every thread that “activate” started has
#   ended after “deactivate”.
# - **A refused configuration** (hidden). With a rate of 0, below 0, above 30 or of 1000 Hz, and
#   with four unplugged cameras, the node is `unconfigured` after “configure”, the camera closed, no
#   thread and no open file left. A node that refuses such a value already when it is set is right,
#   too, and need not be configured then. Afterwards 0.5 Hz is configured, and then 10 Hz: pictures
#   come, from one publisher.
# - **A stream that does not start** (hidden). After “activate” with a camera `stuck` the node is
#   `unconfigured` or `finalized`; so is one that finds out at “configure”. The camera is closed and
#   there is no publisher. If it is unconfigured, the same is tried once more: then every thread
#   that it started has ended, too, and with a good camera pictures come at the right rate.
# - **Shut down** (hidden). After a shutdown from `unconfigured`, `inactive` and `active`, and after
#   `destroy_node()` in each of these states, the camera is closed and there is no publisher; every
#   thread that was started has ended (seen in `active`). After a shutdown no callback goes on that
#   raises, such as a timer's that still wants pictures. A helper node that the node makes for a
#   state goes with a shutdown as well. After `destroy_node()`, in `finalized`, too, no node and no
#   endpoint is left, and a second call does not raise.
#
# </details>

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-camera", "locked": true, "schema_version": 3, "solution": false}
# ## Given: the camera
#
# `Camera` is the library of the camera's maker. As with real devices, an open camera is a
# descriptor of the process, it can be opened **once** at a time, and nobody closes it for you.

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
# The driver below takes pictures, and leaks everything that it opens; zoom and snapshot are
# missing. Reading a camera can block, so a worker thread does it: you may keep that, or do it in
# another way. If a factor is refused (`ValueError`), that costs one message and nothing else.

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
# The class below goes through its states, and does nothing in any of them. rclpy calls
# `on_configure`, `on_activate`, `on_deactivate`, `on_cleanup`, `on_shutdown` and `on_error`, each
# of which returns a `TransitionCallbackReturn`: `SUCCESS`, `FAILURE` (back to where it came from)
# or `ERROR`, which an exception means as well. Write an `on_error`, too: the one that you inherit
# returns `SUCCESS`, and closes no camera.

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
# The next cell starts an examiner in a process of its own, for ten seconds or so. It says for each
# check what was observed, what was needed, and why that matters on a robot;
# `check("resources", hint=2)` in a cell of your own helps more, `hint=3` most. There are 20 points:
# 10 for these checks, 5 for checks at grading, 5 for your two answers.
#
# **Look inside**, in cells of your own after `import course` and `course.run(CameraDriver)`:
# `course.session().diagnose()` names a callback that is stuck, with the line where it is, and
# `%ros node info /camera_driver` lists what is left of the node on the graph.

# %% nbgrader={"grade": true, "grade_id": "resources-visible", "locked": true, "points": 0, "schema_version": 3, "solution": false}
from autograder import check

check("resources")

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-about-hidden", "locked": true, "schema_version": 3, "solution": false}
# The next cell stays empty for you: when your work is graded, it examines what the fine print calls
# hidden.

# %% nbgrader={"grade": true, "grade_id": "resources-hidden", "locked": true, "points": 0, "schema_version": 3, "solution": false}
# Filled in when your work is graded.
### BEGIN HIDDEN TESTS
check("resources", part="hidden")
### END HIDDEN TESTS

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-question-cleanup", "locked": true, "schema_version": 3, "solution": false}
# ## Explain your choices
#
# Answer each question in three to five sentences. A person reads them: each gives 2.5 points, or a
# part of these if only a part of the question is answered.
#
# ### Cleanup
#
# In which order do thread, camera and endpoints end in your `destroy_node()`, and why? Take another
# order: what could go wrong, and why might fifty lives not show it?

# %% [markdown] nbgrader={"grade": true, "grade_id": "resources-explanation-cleanup", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# From the users to the used: first the worker ends and is waited for, then the camera is closed,
# then rclpy destroys the endpoints. If the camera were closed first, the worker would read from a
# closed one; if the endpoints went first, it would publish with a destroyed publisher. Either
# happens only if the worker is at work in just that moment. In a short test it mostly waits for its
# next order, so that fifty lives may all go well, and the robot meets the fifty-first at night.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-question-lifecycle", "locked": true, "schema_version": 3, "solution": false}
# ### Lifecycle
#
# A robot has five drivers. What can a supervisor do with managed ones that it cannot do with plain
# ones, and by which promise of which state? Name a node of a robot for which a plain one is enough,
# and why.

# %% [markdown] nbgrader={"grade": true, "grade_id": "resources-explanation-lifecycle", "locked": false, "points": 0, "schema_version": 3, "solution": true}
# ### BEGIN SOLUTION
# A supervisor can configure all five first and see that each device is there before anything moves:
# inactive promises an open device, its publisher, and silence. Then it activates them in order. It
# can stop a sensor for a while without giving the device away (inactive), and bring back a failed
# driver with new parameters without ending its process, because unconfigured promises that nothing
# is held. A plain node is enough where there is nothing to open that can fail or that others wait
# for: a node that only converts messages, or logs them, works as soon as it is there.
# ### END SOLUTION

# %% [markdown] nbgrader={"grade": false, "grade_id": "resources-hand-in", "locked": true, "schema_version": 3, "solution": false}
# **Hand in**: save this notebook, and hand in the file `resources.ipynb` in the way of your course.
