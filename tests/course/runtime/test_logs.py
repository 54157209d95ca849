"""Logs: everything is kept, nothing reaches the console, and it reads as a table."""

# ruff: noqa: T201 - what callbacks print is what is tested here

from __future__ import annotations

import ctypes
import inspect
import sys
from types import ModuleType

import pytest
import rclpy.logging
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

import course
from course.errors import SessionError
from course.runtime.logs.log_store import LogStore
from course.runtime.logs.table import LogRow, LogTable
from course.runtime.rclpy_fixes.logger_callers import spare_the_next_search


class Chatty(Node):
    """Says something at every level, in every way, once."""

    def __init__(self, name="chatty"):
        super().__init__(name)
        self.get_logger().info("born: 100 % <b>ü</b> %s")
        self.done = False
        self.timer = self.create_timer(0.01, self.talk)

    def talk(self):
        self.timer.cancel()
        logger = self.get_logger()
        logger.debug("a detail")
        logger.get_child("lens").warning("dirty")
        logger.error("x" * 10_000)
        print("printed", 1)
        print("half a line", end="")
        print("to stderr", file=sys.stderr)
        self.done = True


@pytest.fixture
def chatty(any_session):
    node = any_session.run(Chatty)
    any_session.until(lambda: any_session.logs(node, level="WARN").messages[-1:] == ["to stderr"])
    return node


def levels(table):
    return [row.level for row in table]


def test_every_level_is_kept_and_nothing_reaches_the_console(any_session, chatty, capfd):
    any_session.until(lambda: "half a line" in any_session.logs().messages)
    rows = any_session.logs(level="DEBUG")
    assert sorted(levels(rows)) == sorted(
        ["INFO", "DEBUG", "WARN", "ERROR", "PRINT", "PRINT", "STDERR"]
    )
    assert {row.node for row in rows} == {"/chatty"}
    assert capfd.readouterr() == ("", "")


def test_texts_are_kept_whole(any_session, chatty):
    messages = any_session.logs().messages
    assert "born: 100 % <b>ü</b> %s" in messages
    assert "x" * 10_000 in messages


def test_levels_select_from_there_upwards(any_session, chatty):
    assert "DEBUG" not in levels(any_session.logs())
    assert set(levels(any_session.logs(level="warning"))) == {"WARN", "STDERR", "ERROR"}
    assert levels(any_session.logs(level="ERROR")) == ["ERROR"]
    with pytest.raises(SessionError, match="choose DEBUG, INFO, WARN, ERROR or FATAL"):
        any_session.logs(level="LOUD")


def test_nodes_are_found_by_object_name_and_class_after_they_have_gone_too(any_session, chatty):
    any_session.run(Node, "silent")
    any_session.stop(chatty)
    for what in (chatty, "chatty", "/chatty", Chatty):
        assert "printed 1" in any_session.logs(what).messages
    assert len(any_session.logs("silent")) == 0
    with pytest.raises(SessionError, match="'chatter'"):
        any_session.logs("chatter")


def test_last_counts_back_from_the_latest(any_session, chatty):
    table = any_session.logs(last=2)
    assert len(table) == 2
    assert "earlier rows" in repr(table)
    assert len(any_session.logs(last=None)) > 2


def test_what_the_main_thread_prints_passes_through(any_session, chatty, capsys):
    print("from the cell")
    assert "from the cell" in capsys.readouterr().out


def test_two_sessions_with_nodes_of_one_name_keep_their_prints_apart():
    with course.Session() as one, course.Session() as other:
        first = one.run(Chatty)
        one.until(lambda: first.done)
        assert "printed 1" not in other.logs().messages
        second = other.run(Chatty)
        other.until(lambda: second.done)
        one.until(lambda: "printed 1" in one.logs().messages)
        assert one.logs(last=None).messages.count("printed 1") == 1


def test_rosout_carries_what_it_carries_in_plain_ros(any_session):
    from rcl_interfaces.msg import Log

    node = any_session.run(Node, "robot")
    recorder = any_session.record("/rosout", Log)
    node.get_logger().debug("below the default level")
    node.get_logger().info("hello")
    recorder.wait(1)
    assert "hello" in [stamped.message.msg for stamped in recorder.messages]
    assert "below the default level" not in [s.message.msg for s in recorder.messages]


def test_the_warning_about_an_incompatible_qos_is_there(any_session):
    robot, display = any_session.run(Node, "robot"), any_session.run(Node, "display")
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    robot.create_publisher(String, "images", best_effort)
    display.create_subscription(String, "images", lambda message: None, 10)
    any_session.until(
        lambda: any("incompatible QoS" in m for m in any_session.logs("display").messages)
    )


class Counted(ModuleType):
    """A module that counts how often somebody looks for the file that it comes from."""

    @property
    def __file__(self):
        self.searches = getattr(self, "searches", 0) + 1
        return "/nowhere/counted.py"


def test_who_logs_from_a_cell_is_searched_for_once(any_session, monkeypatch):
    node = any_session.run(Node, "talker")
    counted = Counted("counted")
    monkeypatch.setitem(sys.modules, "counted", counted)
    file, cell = "<a cell of this test>", {"__name__": "__main__"}
    monkeypatch.delitem(inspect.modulesbyfile, file, raising=False)
    code = "def say(logger):\n    logger.debug('a reading')\n    logger.info('another')\n"
    exec(compile(code, file, "exec"), cell)
    cell["say"](node.get_logger())
    assert counted.searches > 0
    counted.searches = 0
    cell["say"](node.get_logger())
    assert counted.searches == 0
    assert any_session.logs(node, level="DEBUG").messages == ["a reading", "another"] * 2
    # And what `inspect` says of the cell is what it said before.
    assert inspect.getmodule(cell["say"].__code__, file) is None


def test_a_line_of_the_middlewares_is_heard_on_a_thread_where_no_python_runs():
    # DDS logs on threads of its own: there the handler is the first Python frame.
    heard = []
    start_routine = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)

    @start_routine
    def handler(_):
        spare_the_next_search()
        heard.append(True)

    libc, thread = ctypes.CDLL(None), ctypes.c_ulong()
    assert libc.pthread_create(ctypes.byref(thread), None, handler, None) == 0
    assert libc.pthread_join(thread, None) == 0
    assert heard == [True]


def test_a_table_in_a_notebook_is_escaped():
    table = LogTable([LogRow(0.0, "INFO", "/<node>", "<script>alert(1)</script>\nsecond")])
    page = table._repr_html_()
    assert "<script>" not in page
    assert "&lt;script&gt;" in page
    assert "/&lt;node&gt;" in page
    assert LogTable([])._repr_html_() == "<i>nothing logged</i>"
    assert repr(LogTable([])) == "(nothing logged)"


def test_a_table_is_a_sequence_of_rows():
    rows = [LogRow(float(n), "INFO", "/a", str(n)) for n in range(3)]
    table = LogTable(rows)
    assert (list(table), table[0], table[1:], len(table)) == (rows, rows[0], rows[1:], 3)
    assert len(repr(table).splitlines()) == 3


class Careful(Node):
    """Has something to say before anybody can set its logger's level."""

    def __init__(self, level=None):
        super().__init__("careful")
        self.get_logger().debug("in the constructor")
        self.get_logger().get_child("lens").debug("opened")
        if level is not None:
            self.get_logger().set_level(level)
        self.get_logger().debug("at the end of the constructor")


def test_debug_logs_of_a_constructor_are_kept(session, capfd):
    others = rclpy.logging.get_logger("somebody_else")
    heard_before = others.is_enabled_for(LoggingSeverity.DEBUG)
    careful = session.run(Careful)
    messages = session.logs(careful, level="DEBUG").messages
    wanted = ["in the constructor", "opened", "at the end of the constructor"]
    assert [message for message in messages if message in wanted] == wanted
    assert [row for row in session.logs(level="DEBUG", last=None) if row.node != "/careful"] == []
    assert others.is_enabled_for(LoggingSeverity.DEBUG) == heard_before
    assert capfd.readouterr() == ("", "")


def test_a_level_that_a_constructor_sets_counts(session):
    careful = session.run(Careful, LoggingSeverity.INFO)
    assert "at the end of the constructor" not in session.logs(careful, level="DEBUG").messages


def test_a_constructor_that_raises_leaves_the_levels_as_they_were(session):
    with pytest.raises(ZeroDivisionError):
        session.run(lambda: Node("half_made") and 1 / 0)
    others = rclpy.logging.get_logger("somebody_else")
    assert not others.is_enabled_for(LoggingSeverity.DEBUG)


AFTERWARDS = """
import course, rclpy, sys
from rclpy.action import ActionClient, ActionServer
from rclpy.node import Node
from test_msgs.action import Fibonacci

class Doer(Node):
    def __init__(self):
        super().__init__("doer")
        self.server = ActionServer(self, Fibonacci, "count", lambda goal: Fibonacci.Result())
        self.client = ActionClient(self, Fibonacci, "count")

def log(node):
    logger = node.get_logger()
    logger.debug("said too late")
    logger.info("said too late")
    logger.get_child("arm").error("said too late")
    logger.fatal("said too late")

doer = course.run(Doer, threads=THREADS)
goal = course.send_goal(Fibonacci, "count", Fibonacci.Goal(order=1))
END
log(doer)
again = course.run(Doer)
assert "said too late" not in course.logs(last=None).messages
course.close()
log(doer)
kept = [doer, again, again.server, again.client, goal]
sys.modules["kept_until_the_very_end"] = kept
"""


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("end", ["course.close()", "rclpy.shutdown()", "rclpy.try_shutdown()"])
def test_a_node_of_a_closed_session_is_quiet(start_script, end, threads):
    """Its logger still works, and rclpy's destructors run when the interpreter has half gone."""
    source = AFTERWARDS.replace("END", end).replace("THREADS", str(threads))
    process = start_script(source)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (0, "", "")


LOGS_ON = """
import sys, threading
import course, rclpy
from rclpy.node import Node

class Chatty(Node):
    def __init__(self):
        super().__init__("chatty")
        self.running, self.over = threading.Event(), threading.Event()
        self.create_timer(0.01, self.talk)

    def talk(self):
        self.running.set()
        while not self.over.is_set():
            self.get_logger().debug("a callback that will not end")
            self.get_logger().info("a callback that will not end")

sys.setswitchinterval(1e-6)  # as if many cores looked for the moment in which nobody listens
for _ in range(10):
    chatty = course.run(Chatty)
    assert chatty.running.wait(60.0)
    END
    chatty.over.set()
"""


@pytest.mark.parametrize("end", ["course.session().close(0.3)", "rclpy.shutdown()"])
def test_a_callback_that_logs_while_its_context_is_shut_down_is_quiet(start_script, end):
    process = start_script(LOGS_ON.replace("END", end))
    out, err = process.communicate(timeout=120)
    assert (process.returncode, out, err) == (0, "", "")


TWO_OF_A_NAME = """
import threading
import course
from rclpy.node import Node

context, over = course.session().context, threading.Event()

def come_and_go(name):
    Node(name, context=context).destroy_node()

def others():
    while not over.is_set():
        come_and_go("other")

first, thread = Node("camera", context=context), threading.Thread(target=others)
thread.start()
for _ in range(50):
    come_and_go("camera")
over.set()
thread.join()
"""


def test_a_second_node_of_a_name_can_be_made_while_another_thread_makes_nodes(start_script):
    """About the second one rcl warns under a mutex that the other thread may want."""
    process = start_script(TWO_OF_A_NAME)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (0, "", "")


def test_the_console_of_a_plain_context_opened_later_is_its_own(start_script):
    process = start_script(
        "import course, rclpy\nfrom rclpy.node import Node\n"
        "course.run(Node, 'quiet').get_logger().info('kept')\ncourse.close()\n"
        "rclpy.init()\nNode('loud').get_logger().info('on the console')\nrclpy.shutdown()\n"
    )
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0
    assert "on the console" in out + err
    assert "kept" not in out + err


def test_the_store_is_bounded_in_loggers_and_bytes_and_errors_stay_longest():
    store, home = LogStore(), object()
    store.add(0.0, "ERROR", "robot", "first", home)
    for number in range(1000):
        store.add(float(number), "INFO", f"robot.child_{number}", "x", home)
    rows = [row for _, row in store.rows_of(home, 0.0)]
    assert rows[0].message == "first"
    assert len(rows) <= 400
    for number in range(200):
        store.add(2000.0 + number, "INFO", "robot", "y" * 2**20, home)
    rows = [row for _, row in store.rows_of(home, 0.0)]
    assert sum(len(row.message) for row in rows) <= 16 * 2**20
    assert rows[-1].stamp == 2199.0
    assert rows[0].message == "first"
