"""In a real kernel: what the learner sees after a cell, and that restarts leave nothing behind."""

from __future__ import annotations

import pytest
from rclpy.node import Node

import course
from course.cell_news.news import News
from tests.kernel import Kernel

SETUP = """
%load_ext course
import course, rclpy
from rclpy.node import Node
class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.count = 0
        self.create_timer(0.005, self.say)
    def say(self):
        self.count += 1
        print("said in a thread")
        if self.count == 3:
            raise ValueError("<three>")
"""


class Notebook(Kernel):
    """A kernel whose output is read as one text."""

    def text(self, cell):
        """Run a cell; return its status and what it showed, in order."""
        status, shown = self.run(cell)
        return status, "\n".join(text for _, text in shown)


@pytest.fixture
def notebook():
    opened = Notebook()
    yield opened
    opened.close()


def test_who_has_initialised_rclpy_is_said(notebook):
    notebook.text("%load_ext course\nimport rclpy, course\nrclpy.init()")
    status, shown = notebook.text("rclpy.init()")
    assert status == "error"
    assert "An earlier cell has called rclpy.init() itself" in shown
    assert "course's session has initialised" not in shown
    notebook.text("course.session()")  # beside it: the default context is still the learner's
    assert "An earlier cell has called rclpy.init() itself" in notebook.text("rclpy.init()")[1]


NO_INIT = """
class Bad(Node):
    def __init__(self):
        self.create_timer(1.0, print)
class Idle(Node):
    def __init__(self):
        self.count = 0
"""


def test_a_node_without_super_init_is_one_sentence(notebook):
    notebook.text(SETUP + NO_INIT)
    for name in ("Bad", "Idle"):
        status, shown = notebook.text(f"course.run({name})")
        assert (status, shown.count("\n")) == ("error", 0), shown
        assert f"{name}.__init__ has not called super().__init__, so this is no node" in shown
    status, shown = notebook.text("Bad()")
    assert status == "error"
    assert "Bad.__init__ has not called super().__init__" in shown


def test_after_a_restart_a_name_that_is_not_known_yet_says_what_to_run(notebook):
    notebook.text("%load_ext course")
    status, shown = notebook.text("session.graph()")
    assert status == "error"
    assert "This kernel does not know 'session' yet" in shown
    assert "Run All Above Selected Cell" in shown
    assert "does not know" not in notebook.text("a_typo")[1]


PAIR = """
from std_msgs.msg import String
from rclpy.qos import qos_profile_sensor_data
class Pair(Node):
    def __init__(self):
        super().__init__("pair")
        self.create_publisher(String, "scan", qos_profile_sensor_data)
        self.create_subscription(String, "scan", print, 10)
"""


def test_qos_that_does_not_fit_is_news_once(notebook):
    notebook.text(SETUP + PAIR)
    _, shown = notebook.text(
        "p = course.run(Pair); course.until(lambda: p.count_publishers('scan'))"
    )
    if "do not connect" not in shown:  # the graph may have been a moment late
        _, shown = notebook.text("None")
    assert "/pair and /pair do not connect on /scan: reliability (offers BEST_EFFORT," in shown
    assert "session.graph() shows it in red." in shown
    assert notebook.text("None") == ("ok", "")


@pytest.mark.parametrize(
    ("spin", "name"),
    [("rclpy.spin(node)", "rclpy.spin()"), ("executor.spin()", "executor.spin()")],
)
def test_a_cell_that_blocks_in_spin_says_so_while_it_does(notebook, spin, name):
    notebook.text(SETUP)
    notebook.text(SILENT)
    request = notebook.client.execute(f"executor.add_node(node)\n{spin}", stop_on_error=False)
    while (message := notebook.client.get_iopub_msg(timeout=60))["msg_type"] != "display_data":
        pass
    assert message["parent_header"]["msg_id"] == request, "under the cell that blocks"
    assert f"{name} blocks this cell until you interrupt it" in str(message["content"]["data"])
    notebook.manager.interrupt_kernel()
    while notebook.client.get_shell_msg(timeout=60)["parent_header"]["msg_id"] != request:
        pass


MANAGED = """
from rclpy.lifecycle import LifecycleNode
class Camera(LifecycleNode):
    def __init__(self):
        super().__init__("camera")
    def on_configure(self, state):
        raise OSError("no camera")
"""

DRIVER = """
class Driver(Node):
    def __init__(self):
        super().__init__("driver")
        {body}
driver = course.run(Driver)
sorted(name for name in driver.get_node_names() if not name.startswith("_"))
"""


def test_what_a_transition_raised_is_shown_under_its_cell(notebook):
    notebook.text(SETUP)
    notebook.text(MANAGED)
    status, shown = notebook.text("camera = course.run(Camera); _ = camera.trigger_configure()")
    assert status == "ok"
    assert (
        'Camera.on_configure of /camera raised OSError: no camera (line 6: raise OSError("no '
        in shown
    )
    assert "rclpy hides it and calls on_error()." in shown
    assert notebook.text("None") == ("ok", "")  # said once


def test_a_mended_constructor_runs_and_tells_what_the_first_left(notebook):
    notebook.text(SETUP)
    status, shown = notebook.text(DRIVER.format(body="raise OSError('no camera')"))
    assert status == "error"
    assert "no camera" in shown
    assert "/driver" in notebook.text("course.session().diagnose()")[1]
    status, shown = notebook.text(DRIVER.format(body="self.create_timer(1, print)"))
    assert status == "ok"
    assert "['driver']" in shown
    assert "The constructor of /driver raised OSError: no camera. It left the node on the" in shown
    assert "in a program it stays" in shown


def test_what_the_learner_sees(notebook):
    assert notebook.text(SETUP) == ("ok", "")
    status, shown = notebook.text("t = course.run(Talker); course.until(lambda: t.count > 5); None")
    assert status == "ok"
    assert "Talker.say of /talker raised ValueError: <three>. The node goes on spinning." in shown
    assert "A callback of /talker has printed: as callbacks run while no cell does, that" in shown
    assert notebook.text("None") == ("ok", "")  # said once

    status, shown = notebook.text("rclpy.spin_once(t)")
    assert status == "ok"
    assert "/talker was taken out of this session" in shown
    assert notebook.text("n = t.count; course.until(lambda: t.count > n); None") == ("ok", "")

    status, shown = notebook.text("rclpy.init()")
    assert status == "error"
    assert "has initialised rclpy for this notebook already" in shown

    status, shown = notebook.text("course.Session(domain_id=300)")
    assert (status, shown.count("\n")) == ("error", 0)
    assert shown.startswith("DomainError: ROS domain 300 is out of range")


def test_a_restart_and_an_interrupt_leave_nothing_behind(notebook):
    notebook.text(SETUP)
    domain_id = int(notebook.text("print(course.session().domain_id)")[1])
    notebook.text("t = course.run(Talker)")
    with course.Session(domain_id=domain_id) as outside:
        watcher = outside.run(Node, "watcher")
        outside.until(
            lambda: "talker" in watcher.get_node_names(), timeout=30.0, what="the node to appear"
        )
        notebook.manager.restart_kernel()
        outside.until(
            lambda: "talker" not in watcher.get_node_names(), timeout=10.0, what="no ghost"
        )
    notebook.client.wait_for_ready(timeout=60)
    notebook.text(SETUP)
    notebook.text("t = course.run(Talker)")
    waiting = notebook.client.execute(
        "print('waiting'); course.until(lambda: False, timeout=600)", stop_on_error=False
    )
    while notebook.client.get_iopub_msg(timeout=60)["msg_type"] != "stream":
        pass  # until the cell has begun
    notebook.manager.interrupt_kernel()
    while notebook.client.get_shell_msg(timeout=60)["parent_header"]["msg_id"] != waiting:
        pass
    status, _ = notebook.text("n = t.count; course.until(lambda: t.count > n); None")
    assert status == "ok"  # the node went on spinning


SILENT = """
class Silent(Node):
    def __init__(self):
        super().__init__("silent")
node = course.run(Silent)
from rclpy.executors import SingleThreadedExecutor
executor = SingleThreadedExecutor()
"""


@pytest.mark.parametrize(
    ("executor", "spin"),
    [
        ("rclpy.get_global_executor()", "rclpy.spin(node)"),
        ("executor", "executor.add_node(node); executor.spin()"),
    ],
)
def test_the_interrupt_button_ends_rclpys_own_spinning(notebook, executor, spin):
    notebook.text(SETUP)
    notebook.text(SILENT)
    # A task is run by spinning: once it has spoken, the cell is where it would stay for ever.
    task = f"{executor}.create_task(lambda: print('spinning', flush=True))"
    spinning = notebook.client.execute(f"{task}\n{spin}", stop_on_error=False)
    while notebook.client.get_iopub_msg(timeout=60)["msg_type"] != "stream":
        pass
    notebook.manager.interrupt_kernel()
    while True:
        reply = notebook.client.get_shell_msg(timeout=60)
        if reply["parent_header"]["msg_id"] == spinning:
            break
    assert reply["content"]["ename"] == "KeyboardInterrupt"
    if executor == "executor":
        _, shown = notebook.text("course.until(lambda: False, timeout=0.1)")
        assert "/silent: in an executor of your own" in shown
        notebook.text("executor.remove_node(node)")
    # The node is back: it runs callbacks without anybody's spinning.
    status, _ = notebook.text(
        "ran = []; node.create_timer(0.01, lambda: ran.append(1)); course.until(lambda: ran); None"
    )
    assert status == "ok"


BLOCKED = """
from std_srvs.srv import Trigger
class Server(Node):
    def __init__(self):
        super().__init__("server")
        self.create_service(Trigger, "switch", lambda request, response: response)
class Asker(Node):
    def __init__(self):
        super().__init__("asker")
        self.client = self.create_client(Trigger, "switch")
        self.timer = self.create_timer(0.01, self.ask)
    def ask(self):
        self.client.wait_for_service()
        self.client.call(Trigger.Request())
"""


def test_a_deadlock_is_news_at_the_next_cell_and_replacing_the_node_ends_it(notebook):
    notebook.text(SETUP + BLOCKED)
    notebook.text("course.run(Server); course.run(Asker)")
    status, shown = notebook.text("course.until(lambda: False, timeout=2.0)")
    assert status == "error"
    assert "Asker.ask of /asker (at line" in shown
    assert shown.count("Deadlock: it waits for the answer of switch") == 2  # error, and news
    assert notebook.text("None") == ("ok", "")  # said once
    _, shown = notebook.text("course.stop(Asker)")
    assert "/asker was stopped, but its callback" in shown
    status, _ = notebook.text("t = course.run(Talker); course.until(lambda: t.count > 1); None")
    assert status == "ok"
    _, shown = notebook.text("print(course.close(timeout=0.2).leaked)")
    assert "a callback of /asker" in shown


def test_what_is_raised_as_a_sentence_ends_with_one_full_stop(notebook):
    notebook.text(SETUP)
    notebook.text(
        "class Wrong(Node):\n"
        "    def __init__(self):\n"
        "        super().__init__('wrong')\n"
        "        self.create_timer(0.01, self.tick)\n"
        "    def tick(self):\n"
        "        raise ValueError('No camera.')\n"
    )
    _, shown = notebook.text(
        "course.run(Wrong); course.until(lambda: course.session().errors);None"
    )
    assert "raised ValueError: No camera. The node goes on spinning." in shown


def test_news_is_escaped():
    page = News("<b>", "<i>")._repr_html_()
    assert "<b>" not in page
    assert "&lt;b&gt;" in page
    assert "<i>" not in page


def test_a_session_closed_before_the_extension_is_no_news(notebook):
    notebook.text(SETUP.replace("%load_ext course", ""))
    notebook.text(
        "course.run(Talker)\ncourse.until(lambda: course.session().errors)\ncourse.close()"
    )
    status, shown = notebook.text("%load_ext course")
    assert (status, shown) == ("ok", "")
    status, shown = notebook.text("pass")
    assert (status, shown) == ("ok", "")
    _, shown = notebook.text("course.run(Talker)\ncourse.until(lambda: course.session().errors)")
    assert "ValueError" in shown
