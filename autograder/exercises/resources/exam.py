"""Exercise 4: a camera driver that gives back what it takes, as a plain and as a managed node.

Every bound below is a sentence of the task, so any design that keeps to the task passes: with a
worker thread or without, with callbacks in one executor thread or in several, with inheritance,
composition or a context manager behind ``destroy_node()``.
"""

from __future__ import annotations

import time
from functools import partial

from autograder.examination.exam import Exam, NotExaminable
from autograder.exercises.resources.driver import (
    Driver,
    attempt_start,
    require_default_device,
    run_driver,
    start_driver,
)
from autograder.exercises.resources.driver_ctrl_c import require_driver_in_program
from autograder.exercises.resources.leaks import (
    live_shortly,
    refuse_zooms,
    require_flat_snapshots,
    require_flat_starts,
    require_flat_work,
)
from autograder.exercises.resources.managed import run_managed
from autograder.exercises.resources.managed_ctrl_c import require_managed_in_program
from autograder.exercises.resources.rig import DRIVER, MANAGED, RATE_HZ, CameraRig, new_device
from autograder.observe.lifecycle.flat_rounds import require_flat_lives
from autograder.observe.nouns import Parameter

EXAM: Exam[CameraRig] = Exam(
    "resources",
    CameraRig,
    read="Chapter 5, “Nodes: the processing units”: “Lifecycle management”, “Resource management”",
)
READ_MANAGED = "ROS 2 design, “Managed nodes”"
FASTEST_HZ = 30.0
"""The highest rate that is allowed."""
DESTROYED = "After destroy_node()"
LIVES, LIFE_KIB = 50, 100
"""Of the driver, and KiB of memory that each may keep."""
TAKES = 4
"""Of an experiment in which the examiner may come too late."""


@EXAM.check(
    hints=(
        "Try it beside the check: `course.run(CameraDriver)`, and then `course.logs()`.",
        "Compare what it does with the task: which topics and service, of which types? What starts "
        "each picture, how long does a zoom hold, and when does a snapshot answer?",
        "Open Camera(device), start() it, publish read() from a 0.1 s timer; zoom() and a second "
        "read() belong in the callbacks of camera/zoom and camera/snapshot.",
    ),
    read="Chapter 5, “Nodes: the processing units”",
)
def driver_runs(rig: CameraRig) -> None:
    """The driver opens its camera, sends ten pictures a second, zooms, and takes snapshots.

    Only a node that does its work has something to clean up.
    """
    with run_driver(rig) as driver:
        driver.require_open()
        driver.require_endpoints()
        driver.require_picture()
        driver.require_one_by_one(RATE_HZ)
        driver.require_rate(RATE_HZ)
        zoom = rig.draws.whole("a zoom", 3, 2, 6)
        driver.require_zoom(zoom)
        driver.require_zoom_kept(zoom, f"After a zoom of {zoom}")
        driver.require_one_picture_each()
        driver.require_rate(RATE_HZ, " after a snapshot", after=driver.require_snapshot)
        higher = rig.draws.whole("a higher zoom", 8, 7, 8)
        driver.require_zoom(higher, once=True)
        driver.require_tick_zoom(higher)
    require_default_device(rig)
    require_driver_in_program(rig, "driver_runs")


@EXAM.check(
    builds_on=("driver_runs",),
    hints=(
        "Which method of rclpy's Node takes its publishers, subscriptions and services down?",
        "If you override destroy_node(), the inherited one is not called by itself.",
        "End your own destroy_node() with super().destroy_node(), whatever happened before.",
    ),
)
def endpoints_gone(rig: CameraRig) -> None:
    """After destroy_node() nothing of the driver is on the graph any more.

    An endpoint that is left is a ghost: others wait for its answers, or take an old picture for a
    new one.
    """
    with run_driver(rig) as driver:
        driver.require_endpoints()
        rig.stop(DRIVER, bare=True)
        driver.require_gone(DESTROYED)
    require_driver_in_program(rig, "endpoints_gone")


@EXAM.check(
    builds_on=("driver_runs",),
    hints=(
        "Who closes the camera in your code, and when?",
        "rclpy destroys what it made: endpoints and timers. The camera is not one of them.",
        "Override destroy_node(): end the thread, call self.camera.close(), then "
        "super().destroy_node().",
    ),
)
def camera_given_back(rig: CameraRig) -> None:
    """After destroy_node() the camera is closed, and the driver can be started again.

    A device can be open once. If a driver dies with it open, no restart helps: “device is busy”.
    """
    with run_driver(rig) as driver:
        driver.require_picture("When the driver is started again,")
        rig.stop(DRIVER)
        driver.require_closed(DESTROYED)
    with rig.life(DRIVER, driver.device):
        driver.require_picture("When the driver is started again,")
    require_driver_in_program(rig, "camera_given_back")


@EXAM.check(
    needs=("camera_given_back",),
    builds_on=("driver_runs", "endpoints_gone"),
    hints=(
        "Write down what your constructor makes. What of it does destroy_node() not end?",
        "A thread that waits for ever in queue.get() never ends; a list of the class, or a "
        "function registered with atexit, keeps a whole node alive.",
        "Wake your thread in destroy_node() (put an end mark into its queue) and join() it; keep "
        "what belongs to one life in attributes that are set in __init__.",
    ),
)
def lives_are_flat(rig: CameraRig) -> None:
    """Over 50 lives the driver's process keeps its threads, files and memory.

    A robot is switched on for weeks. What one life leaves behind, however little, adds up until a
    thread or a file cannot be made any more, and it then fails in a node that did nothing wrong.
    """
    with rig.clean_session():
        require_flat_lives(rig, partial(live_shortly, rig), LIVES, LIFE_KIB)
        require_flat_snapshots(rig)
    require_driver_in_program(rig, "lives_are_flat")


@EXAM.check(
    builds_on=("driver_runs", "camera_given_back"),
    hints=(
        "What has ended when destroy_node() returns for the first time, what does a second call "
        "find, and what the next driver? A session calls it, and a test, and a `finally:`.",
        "Look at each line of your destroy_node(): what does it find when it runs again?",
        "Set what you have given back to None, and ask `is not None` before you give it back.",
    ),
)
def cleanup_twice(rig: CameraRig) -> None:
    """Calling destroy_node() twice does no harm.

    Cleanup is called from several places: an error handler, a signal, the end of the program. The
    one that comes second must not turn an orderly end into a crash.
    """
    with run_driver(rig) as driver:
        driver.require_picture()
    # Sessions and the middleware start threads for a first life, and keep them.
    threads = rig.process.thread_ids()
    # Another camera: nothing says that the first one is closed as soon as destroy_node() is over.
    with run_driver(rig) as driver:
        driver.require_picture()
        rig.destroy(DRIVER)
        rig.destroy_again(DRIVER)
        driver.require_closed(DESTROYED)
        # The program still refers to the node: no thread ends because Python collects it.
        rig.require_threads_ended(threads, DESTROYED)
    with run_driver(rig) as driver:
        driver.require_picture("When the driver is started again after two cleanups,")
    require_driver_in_program(rig, "cleanup_twice")


@EXAM.check(
    builds_on=("driver_runs", "endpoints_gone", "camera_given_back"),
    hints=(
        "Let each line of your constructor raise in your mind. What is open at that moment?",
        "The camera 'stuck' opens, but its stream does not start. Try CameraDriver('stuck') twice: "
        "does the second try say that it is in use?",
        "Set every attribute that destroy_node() looks at to None first, put the rest of the "
        "constructor into try, and in `except BaseException:` call self.destroy_node() and raise.",
    ),
)
def failed_start(rig: CameraRig) -> None:
    """A driver that cannot start says so, and leaves nothing behind.

    A supervisor tries again every few seconds while the cable is unplugged. If each try leaves a
    half-made node on the graph, the robot is full of ghosts when the camera is back.
    """
    with rig.clean_session():
        for kind in ("unplugged", "stuck"):
            refused = Driver(rig, "", new_device(kind))
            attempt_start(rig, refused.device)
            refused.require_closed(f"After CameraDriver({refused.device!r}) has raised")
            require_flat_starts(rig, kind)
        # A participant's endpoints are told in order: when those of a driver that works are known,
        # those of the failed starts before it are known, too.
        driver = start_driver(rig)
        driver.require_picture()
        driver.require_endpoints()
        attempt_start(rig, driver.device)  # it can be open once
        rig.stop(DRIVER)
        driver.require_gone("After failed starts, one that worked, and its end,")
        require_flat_starts(rig, "stuck", memory=True)
    require_driver_in_program(rig, "failed_start")


@EXAM.check(
    hints=(
        "Try it beside the check: `course.run(ManagedCamera)`; which of its on_…() methods run?",
        "on_configure opens the camera and makes a lifecycle publisher, on_activate starts stream "
        "and timer, on_deactivate stops both.",
        "Each on_…() returns TransitionCallbackReturn.SUCCESS; a lifecycle publisher sends only if "
        "your on_activate ends with `return super().on_activate(state)`.",
    ),
    read=READ_MANAGED,
)
def managed_runs(rig: CameraRig) -> None:
    """The managed camera goes through its states, and sends pictures when it is active.

    A supervisor brings a robot up in step: all devices are opened and found in order before the
    first one moves.
    """
    with run_managed(rig) as camera:
        camera.configure()
        camera.require_open()
        camera.make_transitions("activate")
        camera.require_picture()
        camera.require_only_pictures()
        camera.require_one_by_one(RATE_HZ)
        camera.require_rate(RATE_HZ)
        camera.make_transitions("deactivate", "cleanup")


@EXAM.check(
    builds_on=("managed_runs",),
    hints=(
        "Between deactivate and activate: what does your node still do, and what does it hold?",
        "A lifecycle publisher drops what is published while it is inactive: you do not see a "
        "timer that goes on, the camera does.",
        "Make the timer in on_activate; in on_deactivate destroy_timer() it, wait for a thread "
        "that takes a picture, stop() the camera, then return super().on_deactivate(state).",
    ),
    read=READ_MANAGED,
)
def silent_when_inactive(rig: CameraRig) -> None:
    """While it is inactive the camera stays open, its stream stands still, and nothing is sent.

    “Inactive” is a promise: the supervisor may now move the camera's arm, or give the bandwidth to
    somebody else.
    """
    with run_managed(rig) as camera:
        strange = rig.node.count_strange()
        camera.configure()
        camera.require_still("configure")
        camera.make_transitions("activate")
        camera.require_picture()
        camera.make_transitions("deactivate")
        inactive = time.time_ns()
        rig.settle_messages()
        camera.require_still("deactivate")
        camera.require_still_held()
        camera.require_only_new(inactive, strange)
        camera.require_rate(RATE_HZ, " after a second “activate”")
        camera.make_transitions("deactivate")
        camera.require_still("deactivate")
        camera.make_transitions("cleanup")
        camera.configure("slow")
        camera.require_silent_at_once()


@EXAM.check(
    builds_on=("managed_runs",),
    hints=(
        "What does a round from configure to cleanup read, make, and give back? Does the next one "
        "begin as the first one did?",
        "Configured a second time, does your node use the new parameters, or those of the first?",
        "In on_cleanup close() the camera, destroy_lifecycle_publisher() the publisher, and set "
        "both to None; read the parameters in on_configure.",
    ),
    read=READ_MANAGED,
)
def managed_gives_back(rig: CameraRig) -> None:
    """After “cleanup” the managed camera holds nothing, and can be configured anew.

    This is how a driver gets new parameters without ending its process: what it still held from
    its first configuration would be in the way of the second.
    """
    with run_managed(rig) as camera:
        rig.catch_up()
        camera.require_publishers(0, "Before the first “configure”")
        camera.manager.require_defaults(Parameter("device", "front"), Parameter("rate", RATE_HZ))
        camera.require_round(RATE_HZ, later_hz=float(rig.draws.whole("later", 20, 15, 25)))
        slow_hz = rig.draws.whole("a slow rate", 1, 1, 4) + 0.5  # neither 1 nor 2
        for hz in rig.draws.shuffled("rates", (FASTEST_HZ, slow_hz)):
            camera.require_round(hz, seconds=1 if hz == FASTEST_HZ else 6)
        camera.set_camera(rate=RATE_HZ)
        camera.leaks.require_flat_rounds(10, kib_each=1024)
        camera.leaks.require_threads_ended_when_inactive()
    require_managed_in_program(rig, "managed_gives_back", camera.node)


@EXAM.check(
    builds_on=("managed_runs", "managed_gives_back"),
    hints=(
        "What does your on_configure return for a rate or a camera that it cannot have, and what "
        "has it opened by then?",
        "FAILURE leads back to unconfigured, and closes nothing.",
        "Check the rate first (return FAILURE), open the camera in try (return FAILURE on "
        "OSError), and make the publisher last.",
    ),
    read=READ_MANAGED,
)
def configure_refused(rig: CameraRig) -> None:
    """A configuration that is not possible leaves the node unconfigured, and it can try again.

    A wrong parameter file must be found before the robot drives. A node that takes it as it is, or
    that is stuck half way, is found out when the first picture is missing.
    """
    with run_managed(rig) as camera:
        draw = rig.draws.number
        below = draw("a rate below 0", -5.0, -9.0, -0.5)
        above = draw("a rate that is too high", FASTEST_HZ + 0.5, FASTEST_HZ + 0.2, FASTEST_HZ + 3)
        camera.require_refusals("refused rates", "front", (0.0, below, above, 1000.0))
        camera.require_refusals("unplugged cameras", "unplugged", (RATE_HZ,) * 4)
        camera.configure(rate=0.5)  # slow, and allowed
        camera.make_transitions("cleanup")
        camera.configure(rate=RATE_HZ)
        camera.make_transitions("activate")
        # A participant's endpoints are told in order: those of the failed attempts are known.
        camera.require_picture()
        camera.require_publishers(1, "After “configure”")


@EXAM.check(
    builds_on=("managed_runs",),
    hints=(
        "Which of your methods runs after an exception in on_activate?",
        "on_error. The one that you inherit returns SUCCESS and gives nothing back.",
        "Give everything back in on_error as in on_cleanup, and return SUCCESS: the node is then "
        "unconfigured. In on_activate let the exception of start() out, or return ERROR.",
    ),
    read=READ_MANAGED,
)
def activation_error(rig: CameraRig) -> None:
    """A stream that does not start is an error, after which the node holds nothing.

    The state machine has a place for what goes wrong. A node that pretends to be active sends no
    picture; one that keeps the broken camera open cannot be repaired by a second “configure”.
    """
    with run_managed(rig) as camera:
        for when in ("", " a second time"):
            threads = rig.process.thread_ids()
            if camera.fail_to_activate(when) == "finalized":
                return
        # The middleware may have started a thread the first time.
        rig.require_threads_ended(threads, "After the error")
        camera.configure()
        camera.make_transitions("activate")
        camera.require_picture()
        camera.require_rate(RATE_HZ, " after an error and a restart")


@EXAM.check(
    builds_on=("managed_runs", "managed_gives_back"),
    hints=(
        "From which states can a node be shut down, or destroyed? Which of your methods runs then?",
        "on_shutdown, and neither on_deactivate nor on_cleanup before it.",
        "Give everything back in on_shutdown as in on_cleanup, and in destroy_node() as well: look "
        "whether each thing is there before you give it back.",
    ),
    read=READ_MANAGED,
)
def managed_shutdown(rig: CameraRig) -> None:
    """A shutdown from any state, and destroy_node() in any state, gives everything back.

    An emergency does not wait for deactivate and cleanup: whoever ends the node in the middle of
    its work must find the camera closed.
    """
    with run_managed(rig) as camera:
        camera.set_camera()
        camera.leaks.require_no_helper_finalized()
    paths = {"unconfigured": (), "inactive": ("configure",), "active": ("configure", "activate")}
    for end in ("shutdown", "destroy_node()"):
        for state, path in paths.items():
            with run_managed(rig) as camera:
                threads = rig.process.thread_ids()
                camera.set_camera()
                camera.make_transitions(*path)
                camera.require_publishers(len(path[:1]), f"In the state {state}")
                when = f"After {end} in the state {state}"
                if end == "shutdown":
                    camera.make_transitions("shutdown")
                else:
                    rig.stop(MANAGED, bare=True)
                camera.require_nothing_held(when)
                if state == "active":  # by now the middleware has the threads that it keeps
                    rig.require_threads_ended(threads, when)
                if end == "shutdown":
                    camera.require_callbacks_ended(when)
                    rig.stop(MANAGED, bare=True)  # finalized is a state, too
                rig.require_gone(camera.node, DESTROYED)
                rig.destroy_again(MANAGED)
    require_managed_in_program(rig, "managed_shutdown", camera.node)


@EXAM.check(
    builds_on=("driver_runs",),
    hints=(
        "What had your zoom callback already done when camera.zoom(99) raised?",
        "A lock that was acquired and not released stops whoever wants it next, in silence.",
        "Hold locks with `with self.lock:`, which releases them on an exception, too.",
    ),
)
def callback_raises(rig: CameraRig) -> None:
    """A zoom that the camera refuses costs that one message, and nothing else.

    Somebody will send a wrong value. The driver may refuse it, but it must go on working, and it
    must still end cleanly.
    """
    with run_driver(rig) as driver:
        driver.require_endpoints()
        zoom = rig.draws.whole("a zoom before one that is refused", 2, 2, 8)
        driver.require_zoom(zoom)
        for factor in (rig.draws.whole("a zoom that is too high", 99, 9, 200), 0, -1):
            driver.refuse_zoom(factor)
            driver.require_zoom_kept(zoom, f"After a zoom of {factor}")
        driver.require_zoom(1, "After a zoom of -1", once=True)
        driver.require_rate(RATE_HZ, " after a zoom that was refused", after=driver.refuse_zoom)
        before = rig.process.read_usage()
        refuse_zooms(driver)
    require_flat_work(rig, before, "refused zooms")


@EXAM.check(
    builds_on=("driver_runs", "endpoints_gone", "camera_given_back"),
    hints=(
        "A callback waits for a picture, and destroy_node() runs in another thread. Who waits for "
        "whom, and for how many pictures?",
        "camera.close() ends every read() that waits with an OSError; an answer that your worker "
        "will never give does not end.",
        "Do not wait without end in a callback: let the read() itself be what it waits for, or "
        "give the wait a timeout and look whether the driver is ending.",
    ),
)
def cleanup_when_busy(rig: CameraRig) -> None:
    """Cleanup while a callback still waits for the camera ends well, and a restart works.

    Nobody stops a robot between two callbacks. If cleanup and callback wait for each other, the
    process hangs with the camera open, and only the power switch helps.
    """
    with run_driver(rig):
        pass
    rig.wait_for_rest()  # a thread may have one step left to its end
    usual = len(rig.process.thread_ids())
    if not any(_destroyed_in_snapshot(rig, usual, answered=take == 0) for take in range(TAKES)):
        raise NotExaminable(
            "destroy_node() was not seen while one of its callbacks waited for the camera: each "
            f"time, of {TAKES}, snapshots succeeded after it had been asked for. After a hand-in a "
            "person looks at it."
        )
    with run_driver(rig, "slow") as driver:
        driver.require_picture()
        driver.require_no_queue(partial(rig.destroy, DRIVER))
        driver.require_closed("After destroy_node() with a slow camera")


def _destroyed_in_snapshot(rig: CameraRig, usual: int, *, answered: bool) -> bool:
    """Have a driver destroyed while a callback waits for its picture; return whether one did.

    ``usual`` is the number of threads without a driver; ``answered``: not before another snapshot
    has been.

    The examiner is held up now and then, and the call may then find all snapshots answered, or fall
    between two of them. So one that succeeded meanwhile leaves it open, and so does a request that
    was made twice, whose picture may have been taken for the next one's.
    """
    with run_driver(rig, "slow") as driver:
        driver.require_endpoints()
        requests = rig.requests
        driver.require_snapshot(slow=True)
        once = rig.requests == requests + 1
        count_left = driver.begin_snapshots(answered=answered)
        when, threads = "After destroy_node() during a snapshot", rig.process.thread_ids()
        before = count_left()
        rig.destroy(DRIVER)
        driver.require_closed(when)
        driver.require_gone(when)
        rig.drop_node(DRIVER)
        rig.require_callbacks_ended(threads, usual, when)
        again = start_driver(rig)
        again.require_zoom(rig.draws.whole("a zoom after a restart", 4, 2, 8), "After a restart")
    return once and 0 < before == count_left()
