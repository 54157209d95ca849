"""Exercise 4: a camera driver that gives back what it takes, as a plain and as a managed node.

Every bound below is a sentence of the task, so any design that keeps to the task passes: with a
worker thread or without, with callbacks in one executor thread or in several, with inheritance,
composition or a context manager behind ``destroy_node()``.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import wraps

from autograder.examination.exam import Exam, Failed, NotExaminable
from autograder.exercises.resources.camera_duties import (
    DRIVER,
    require_callbacks_ended,
    require_closed,
    require_default_device,
    require_endpoints,
    require_gone,
    require_open,
    require_picture,
    require_threads_ended,
)
from autograder.exercises.resources.camera_rate import (
    require_own_clock,
    require_rate,
    require_tick_zoom,
)
from autograder.exercises.resources.camera_requests import (
    require_no_queue,
    require_one_picture_each,
    require_snapshot,
    require_snapshots_under_way,
    require_zoom,
    require_zoom_at_once,
    require_zoom_kept,
)
from autograder.exercises.resources.ctrl_c import (
    require_closed_at_the_end,
    require_no_harm_at_the_end,
    require_nothing_kept_at_the_end,
    require_off_graph_at_the_end,
    require_pace,
)
from autograder.exercises.resources.leak_test import MEMORY, measure_growth
from autograder.exercises.resources.leaks import (
    attempt_start,
    failing_starts,
    failing_starts_memory,
    refuse_zooms,
    require_flat_refusals,
    require_flat_snapshots,
)
from autograder.exercises.resources.managed import Managed
from autograder.exercises.resources.managed_ctrl_c import (
    require_managed_ended,
    require_managed_pace,
)
from autograder.exercises.resources.managed_holdings import (
    require_no_helper_finalized,
    require_no_publisher_yet,
    require_nothing_held,
    require_off_graph,
    require_one_publisher,
    require_only_pictures,
)
from autograder.exercises.resources.managed_inactive import (
    require_fresh,
    require_silent_at_once,
    require_still,
    require_still_held,
    require_stopped,
)
from autograder.exercises.resources.managed_life import MANAGED
from autograder.exercises.resources.managed_transitions import (
    require_configuration,
    require_flat_rounds,
    require_no_thread_inactive,
    require_refusals,
)
from autograder.exercises.resources.rig import PERIOD, CameraRig, camera_rig
from autograder.exercises.resources.unasked_starts import (
    require_nothing_left_unasked,
    require_start_raises_unasked,
)
from autograder.observe.phrases import as_phrase

EXAM: Exam[CameraRig] = Exam("resources", camera_rig)

FAILING_STARTS = 2
TAKES = 4  # of an experiment in which the examiner may come too late
FASTEST = 30.0  # Hz, the highest rate that is allowed

READ_NODES = "Chapter 5, “Nodes: lifecycle management” and “Nodes: resource management”"
READ_MANAGED = "ROS 2 design, “Managed nodes”"


def once_per_notebook(check: Callable[[CameraRig], None]) -> Callable[[CameraRig], None]:
    """Run a check that others need once a notebook, not once a part of the exam."""

    @wraps(check)
    def run(rig: CameraRig) -> None:
        if check.__name__ not in rig.memory:
            check(rig)
            rig.memory[check.__name__] = True

    return run


@EXAM.check(
    hints=(
        "Try it beside the check: `course.run(CameraDriver)`, and then `course.logs()`.",
        "Compare names and types of the four endpoints with the row “Running” of the table.",
        "Open Camera(device), start() it, publish read() from a 0.1 s timer; zoom() and a second "
        "read() belong in the callbacks of camera/zoom and camera/snapshot.",
    ),
    read="Chapter 5, “Nodes: the processing units”",
)
@once_per_notebook
def driver_runs(rig: CameraRig) -> None:
    """The driver opens its camera, sends ten pictures a second, zooms, and takes snapshots.

    Only a node that does its work has something to clean up.
    """
    device = rig.new_device()
    with rig.run_life(DRIVER, device) as node:
        require_open(rig, device)
        require_endpoints(rig, node)
        require_picture(rig, device)
        require_own_clock(rig, device)
        require_rate(rig, device, 1 / PERIOD)
        zoom = rig.draws.whole("a zoom", 3, 2, 6)
        require_zoom(rig, device, zoom, "While the driver runs")
        require_zoom_kept(rig, device, zoom, f"After a zoom of {zoom}")
        require_one_picture_each(rig, device, "While the driver runs")
        require_rate(
            rig,
            device,
            1 / PERIOD,
            " after a snapshot",
            after=lambda: require_snapshot(rig, device, "While the driver runs"),
        )
        zoom = rig.draws.whole("a higher zoom", 8, 7, 8)
        require_zoom_at_once(rig, device, zoom, "While the driver runs")
        require_tick_zoom(rig, device, zoom, f"After a zoom of {zoom}")
    require_default_device(rig, DRIVER)
    require_pace(rig)


@EXAM.check(
    needs=("driver_runs",),
    hints=(
        "Which method of rclpy's Node takes its publishers, subscriptions and services down?",
        "If you override destroy_node(), the inherited one is not called by itself.",
        "End your own destroy_node() with super().destroy_node(), whatever happened before.",
    ),
    read=READ_NODES,
)
@once_per_notebook
def endpoints_gone(rig: CameraRig) -> None:
    """After destroy_node() nothing of the driver is on the graph any more.

    An endpoint that is left is a ghost: others wait for its answers, or take an old picture for a
    new one.
    """
    device = rig.new_device()
    with rig.run_life(DRIVER, device) as node:
        require_endpoints(rig, node)
        rig.program.stop(DRIVER, bare=True)
        require_gone(rig, device, "After destroy_node()", node)
    require_off_graph_at_the_end(rig)


@EXAM.check(
    needs=("driver_runs",),
    hints=(
        "Who closes the camera in your code, and when?",
        "rclpy destroys what it made: endpoints and timers. The camera is not one of them.",
        "Override destroy_node(): end the thread, call self.camera.close(), then "
        "super().destroy_node().",
    ),
    read=READ_NODES,
)
@once_per_notebook
def camera_given_back(rig: CameraRig) -> None:
    """After destroy_node() the camera is closed, and the driver can be started again.

    A device can be open once. If a driver dies with it open, no restart helps: “device is busy”.
    """
    device = rig.new_device()
    for _ in range(2):  # it has been started before: for the check that this one needs
        with rig.run_life(DRIVER, device):
            require_picture(rig, device, "When the driver is started again,")
            rig.program.stop(DRIVER)
            require_closed(rig, device, "After destroy_node()")
    require_closed_at_the_end(rig)


@EXAM.check(
    needs=("endpoints_gone", "camera_given_back"),
    hints=(
        "Write down what your constructor makes. What of it does destroy_node() not end?",
        "A thread that waits for ever in queue.get() never ends; a list of the class, or a "
        "function registered with atexit, keeps a whole node alive.",
        "Wake your thread in destroy_node() (put an end mark into its queue) and join() it; keep "
        "what belongs to one life in attributes that are set in __init__.",
    ),
    read=READ_NODES,
)
def lives_are_flat(rig: CameraRig) -> None:
    """Over 50 lives the driver's process keeps its threads, files and memory.

    A robot is switched on for weeks. What one life leaves behind, however little, adds up until a
    thread or a file cannot be made any more, and it then fails in a node that did nothing wrong.
    """
    with rig.clean_session():
        grown = measure_growth(rig)
    if leaked := grown.list_leaks():
        raise Failed(
            expected=f"{grown.lives_made} lives leave no thread and no file behind, and less than "
            f"{MEMORY} KiB a life.",
            actual=f"Each life of the driver left {as_phrase(leaked)} behind.{rig.process_note()}",
        )
    with rig.clean_session():
        require_flat_snapshots(rig)
    require_nothing_kept_at_the_end(rig)


@EXAM.check(
    needs=("camera_given_back",),
    hints=(
        "Who may call destroy_node() besides you? A session does, and a test, and a `finally:`.",
        "Look at each line of your destroy_node(): what does it find when it runs again?",
        "Set what you have given back to None, and ask `is not None` before you give it back.",
    ),
    read=READ_NODES,
)
def cleanup_twice(rig: CameraRig) -> None:
    """Calling destroy_node() twice does no harm.

    Cleanup is called from several places: an error handler, a signal, the end of the program. The
    one that comes second must not turn an orderly end into a crash.
    """
    with rig.run_life(DRIVER, device := rig.new_device()):
        require_picture(rig, device)
    # Sessions and the middleware start threads for a first life, and keep them.
    threads = rig.process.thread_ids()
    # Another camera: nothing says that the first one is closed as soon as destroy_node() is over.
    with rig.run_life(DRIVER, device := rig.new_device()):
        require_picture(rig, device)
        rig.program.destroy(DRIVER)
        rig.program.destroy_again(DRIVER)
        require_closed(rig, device, "After destroy_node()")
        # The program still refers to the node: no thread ends because Python collects it.
        require_threads_ended(rig, threads, "After destroy_node()")
    with rig.run_life(DRIVER, device := rig.new_device()):
        require_picture(rig, device, "When the driver is started again after two cleanups,")
    require_no_harm_at_the_end(rig)


@EXAM.check(
    needs=("endpoints_gone", "camera_given_back"),
    hints=(
        "Let each line of your constructor raise in your mind. What is open at that moment?",
        "The camera 'stuck' opens, but its stream does not start. Try CameraDriver('stuck') twice: "
        "does the second try say that it is in use?",
        "Set every attribute that destroy_node() looks at to None first, put the rest of the "
        "constructor into try, and in `except BaseException:` call self.destroy_node() and raise.",
    ),
    read=READ_NODES,
)
def failed_start(rig: CameraRig) -> None:
    """A driver that cannot start says so, and leaves nothing behind.

    A supervisor tries again every few seconds while the cable is unplugged. If each try leaves a
    half-made node on the graph, the robot is full of ghosts when the camera is back.
    """
    with rig.clean_session():
        for kind in ("unplugged", "stuck"):
            device = rig.new_device(kind)
            attempt_start(rig, device)
            require_closed(rig, device, f"After CameraDriver({device!r}) has raised")
            before = failing_starts(rig, kind, FAILING_STARTS)
        # A participant's endpoints are told in order: when those of a driver that works are known,
        # those of the failed starts before it are known, too.
        device = rig.new_device()
        node = rig.program.start(DRIVER, device)
        require_picture(rig, device)
        require_endpoints(rig, node)
        attempt_start(rig, device)  # it can be open once
        rig.program.stop(DRIVER)
        require_gone(rig, device, "After failed starts, one that worked, and its end,", node)
        failing_starts_memory(rig, kind, FAILING_STARTS, before)
    require_start_raises_unasked(rig)
    require_nothing_left_unasked(rig)


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
@once_per_notebook
def managed_runs(rig: CameraRig) -> None:
    """The managed camera goes through its states, and sends pictures when it is active.

    A supervisor brings a robot up in step: all devices are opened and found in order before the
    first one moves.
    """
    device = rig.new_device()
    with rig.run_life(MANAGED) as name:
        node = Managed(rig, name)
        node.require_parameters(device=device)
        node.make_transitions("configure")
        require_open(rig, device)
        node.make_transitions("activate")
        require_picture(rig, device)
        require_only_pictures(rig)
        require_own_clock(rig, device)
        require_rate(rig, device, 10)
        node.make_transitions("deactivate", "cleanup")


@EXAM.check(
    needs=("managed_runs",),
    hints=(
        "What still runs in your node between deactivate and activate?",
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
    device = rig.new_device()
    with rig.run_life(MANAGED) as name:
        node = Managed(rig, name)
        node.require_parameters(device=device)
        strange = rig.node.count_strange()
        node.make_transitions("configure")
        require_still(rig, device, "configure")
        node.make_transitions("activate")
        require_picture(rig, device)
        node.make_transitions("deactivate")
        inactive = time.time_ns()
        rig.settle_messages()
        require_still(rig, device, "deactivate")
        require_still_held(rig, device)
        asked = max(rig.open_cameras(device), default=0)
        node.make_transitions("activate")
        require_fresh(rig, device, inactive, asked, strange)
        require_rate(rig, device, 10, " after a second “activate”")
        node.make_transitions("deactivate")
        require_stopped(rig, device, "deactivate")
        node.make_transitions("cleanup")
        slow = rig.new_device("slow")
        node.require_parameters(device=slow)
        node.make_transitions("configure")
        require_silent_at_once(rig, node, slow)


@EXAM.check(
    needs=("managed_runs",),
    hints=(
        "Compare what your on_configure makes with what your on_cleanup gives back.",
        "Configured a second time, does your node use the new parameters, or those of the first?",
        "In on_cleanup close() the camera, destroy_lifecycle_publisher() the publisher, and set "
        "both to None; read the parameters in on_configure.",
    ),
    read=READ_MANAGED,
)
@once_per_notebook
def managed_gives_back(rig: CameraRig) -> None:
    """After “cleanup” the managed camera holds nothing, and can be configured anew.

    This is how a driver gets new parameters without ending its process: what it still held from
    its first configuration would be in the way of the second.
    """
    with rig.run_life(MANAGED) as name:
        node = Managed(rig, name)
        require_no_publisher_yet(rig)
        node.require_defaults()
        require_configuration(rig, node, 10.0, later=float(rig.draws.whole("later", 20, 15, 25)))
        slow = rig.draws.whole("a slow rate", 1, 1, 4) + 0.5  # Hz, and neither 1 nor 2
        for rate in rig.draws.shuffled("rates", (FASTEST, slow)):
            require_configuration(rig, node, rate, seconds=1 if rate == FASTEST else 6)
        require_flat_rounds(rig, node)
        require_no_thread_inactive(rig, node)
    require_managed_pace(rig, name)


@EXAM.check(
    needs=("managed_gives_back",),
    hints=(
        "What does your on_configure return for a rate of 0 Hz, and for a camera that is missing?",
        "FAILURE leads back to unconfigured. What had you opened by then?",
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
    with rig.run_life(MANAGED) as name:
        node = Managed(rig, name)
        draw = rig.draws.number
        below = draw("a rate below 0", -5.0, -9.0, -0.5)
        above = draw("a rate that is too high", FASTEST + 0.5, FASTEST + 0.2, FASTEST + 3.0)
        require_refusals(rig, node, (0.0, below, above, 1000.0))
        node.require_parameters(device=rig.new_device(), rate=0.5)  # slow, and allowed
        node.make_transitions("configure", "cleanup")
        device = rig.new_device()
        node.require_parameters(device=device, rate=10.0)
        node.make_transitions("configure", "activate")
        # A participant's endpoints are told in order: those of the failed attempts are known.
        require_picture(rig, device)
        require_one_publisher(rig)


@EXAM.check(
    needs=("managed_gives_back",),
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
    with rig.run_life(MANAGED) as name:
        node = Managed(rig, name)
        for time in ("", " a second time"):
            device, threads = rig.new_device("stuck"), rig.process.thread_ids()
            node.require_parameters(device=device)
            # Whoever tries the stream when the node is configured finds out even earlier.
            if (state := node.attempt_transition("configure")) == "inactive":
                require_one_publisher(rig)
                state = node.attempt_transition("activate")
            if state not in ("unconfigured", "finalized"):
                raise Failed(
                    expected=f"If the stream does not start{time}, your node ends unconfigured or "
                    "finalized.",
                    actual=f"It is {state}.",
                )
            require_nothing_held(rig, device, f"After the error{time}")
            if state == "finalized":
                return
        # The middleware may have started a thread the first time.
        require_threads_ended(rig, threads, "After the error")
        device = rig.new_device()
        node.require_parameters(device=device)
        node.make_transitions("configure", "activate")
        require_picture(rig, device)
        require_rate(rig, device, 10, " after an error and a restart")


@EXAM.check(
    needs=("managed_gives_back",),
    hints=(
        "From which states can a node be shut down? Which of your methods runs then?",
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
    with rig.run_life(MANAGED) as name:
        require_no_helper_finalized(rig, Managed(rig, name))
    paths = {"unconfigured": (), "inactive": ("configure",), "active": ("configure", "activate")}
    for end in ("shutdown", "destroy_node()"):
        for state, path in paths.items():
            device = rig.new_device()
            with rig.run_life(MANAGED) as name:
                node, threads = Managed(rig, name), rig.process.thread_ids()
                node.require_parameters(device=device)
                node.make_transitions(*path)
                if path:
                    require_one_publisher(rig)
                if end == "shutdown":
                    node.make_transitions("shutdown")
                else:
                    rig.program.stop(MANAGED, bare=True)
                when = f"After {end} in the state {state}"
                require_nothing_held(rig, device, when)
                if state == "active":  # by now the middleware has the threads that it keeps
                    require_threads_ended(rig, threads, when)
                if end == "shutdown":
                    rig.program.stop(MANAGED, bare=True)  # finalized is a state, too
                require_off_graph(rig, name, "After destroy_node()")
                rig.program.destroy_again(MANAGED)
    require_managed_ended(rig, name)


@EXAM.check(
    needs=("endpoints_gone", "camera_given_back"),
    hints=(
        "What had your zoom callback already done when camera.zoom(99) raised?",
        "A lock that was acquired and not released stops whoever wants it next, in silence.",
        "Hold locks with `with self.lock:`, which releases them on an exception, too.",
    ),
    read=READ_NODES,
)
def callback_raises(rig: CameraRig) -> None:
    """A zoom that the camera refuses costs that one message, and nothing else.

    Somebody will send a wrong value. The driver may refuse it, but it must go on working, and it
    must still end cleanly.
    """
    device = rig.new_device()
    with rig.run_life(DRIVER, device) as node:
        require_endpoints(rig, node)
        zoom = rig.draws.whole("a zoom before one that is refused", 2, 2, 8)
        require_zoom(rig, device, zoom, "While the driver runs")
        for factor in (rig.draws.whole("a zoom that is too high", 99, 9, 200), 0, -1):
            rig.refused_zoom(factor)
            require_zoom_kept(rig, device, zoom, f"After a zoom of {factor}")
        require_zoom_at_once(rig, device, 1, "After a zoom of -1")
        require_rate(
            rig,
            device,
            1 / PERIOD,
            " after a zoom that was refused",
            after=lambda: rig.refused_zoom(99),
        )
        before = rig.process.read_usage()
        refuse_zooms(rig)
        rig.program.stop(DRIVER)
        require_closed(rig, device, "After destroy_node()")
        require_gone(rig, device, "After destroy_node()", node)
        require_flat_refusals(rig, before)


@EXAM.check(
    needs=("endpoints_gone", "camera_given_back"),
    hints=(
        "A callback waits for a picture, and destroy_node() runs in another thread. Who waits for "
        "whom, and for how many pictures?",
        "camera.close() ends every read() that waits with an OSError; an answer that your worker "
        "will never give does not end.",
        "Do not wait without end in a callback: let the read() itself be what it waits for, or "
        "give the wait a timeout and look whether the driver is ending.",
    ),
    read=READ_NODES,
)
def cleanup_when_busy(rig: CameraRig) -> None:
    """Cleanup while a callback still waits for the camera ends well, and a restart works.

    Nobody stops a robot between two callbacks. If cleanup and callback wait for each other, the
    process hangs with the camera open, and only the power switch helps.
    """
    with rig.run_life(DRIVER, rig.new_device()):
        pass
    rig.wait_for_rest()  # a thread may have one step left to its end
    usual = rig.process.count_threads()
    for take in range(TAKES):
        if _destroyed_during_a_snapshot(rig, usual, answered=take == 0):
            break
    else:
        raise NotExaminable(
            "destroy_node() was not seen while one of its callbacks waited for the camera: each "
            f"time, of {TAKES}, snapshots succeeded after it had been asked for. After a hand-in a "
            "person looks at it."
        )
    device = rig.new_device("slow")
    with rig.run_life(DRIVER, device):
        require_picture(rig, device)
        require_no_queue(rig, device, lambda: rig.program.destroy(DRIVER))
        require_closed(rig, device, "After destroy_node() with a slow camera")


def _destroyed_during_a_snapshot(rig: CameraRig, usual: int, *, answered: bool) -> bool:
    """Have a driver destroyed while a callback waits for its picture; return whether one did.

    ``answered``: not before another snapshot has been.

    The examiner is held up now and then, and the call may then find all snapshots answered, or fall
    between two of them. So one that succeeded meanwhile leaves it open, and so does a request that
    was made twice, whose picture may have been taken for the next one's.
    """
    device = rig.new_device("slow")
    with rig.run_life(DRIVER, device) as node:
        require_endpoints(rig, node)
        requests = rig.requests
        require_snapshot(rig, device, "While the driver runs", slow=True)
        once = rig.requests == requests + 1
        left = require_snapshots_under_way(rig, device, answered=answered)
        when, threads = "After destroy_node() during a snapshot", rig.process.thread_ids()
        before = left()
        rig.program.destroy(DRIVER)
        require_closed(rig, device, when)
        require_gone(rig, device, when, node)
        rig.program.drop_node(DRIVER)
        require_callbacks_ended(rig, threads, usual, when)
        again = rig.new_device()
        rig.program.start(DRIVER, again)
        zoom = rig.draws.whole("a zoom after a restart", 4, 2, 8)
        require_zoom(rig, again, zoom, "After a restart")
    return once and 0 < before == left()
