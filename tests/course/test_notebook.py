"""In a real kernel: what the learner sees after a cell, and that restarts leave nothing behind."""

from __future__ import annotations

import os

import pytest
from jupyter_client import KernelManager
from rclpy.node import Node

import course
from course.notebook import News

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


class Notebook:
    """A kernel, and cells to run in it."""

    def __init__(self):
        environment = dict(os.environ)
        environment.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
        self.manager = KernelManager(kernel_name="python3", transport="ipc")
        self.manager.start_kernel(env=environment)
        self.client = self.manager.client()
        self.client.start_channels()
        self.client.wait_for_ready(timeout=60)

    def run(self, cell):
        """Run a cell; return its status and what it showed, as text."""
        shown = []

        def show(message):
            content = message["content"]
            if message["msg_type"] == "stream":
                shown.append(content["text"])
            elif message["msg_type"] in ("display_data", "execute_result"):
                shown.append(content["data"]["text/plain"])
            elif message["msg_type"] == "error":
                shown.append("\n".join(content["traceback"]))

        reply = self.client.execute_interactive(cell, output_hook=show, timeout=120)
        return reply["content"]["status"], "\n".join(shown)


@pytest.fixture
def notebook():
    opened = Notebook()
    yield opened
    opened.client.stop_channels()
    opened.manager.shutdown_kernel()


def test_what_the_learner_sees(notebook):
    assert notebook.run(SETUP) == ("ok", "")
    status, shown = notebook.run("t = course.run(Talker); course.until(lambda: t.count > 5); None")
    assert status == "ok"
    assert "Talker.say of /talker raised ValueError: <three>. The node goes on spinning." in shown
    assert "said in a thread" not in shown
    assert notebook.run("None") == ("ok", "")  # said once

    status, shown = notebook.run("rclpy.spin_once(t)")
    assert status == "ok"
    assert "/talker was taken out of this session" in shown
    assert notebook.run("n = t.count; course.until(lambda: t.count > n); None") == ("ok", "")

    status, shown = notebook.run("rclpy.init()")
    assert status == "error"
    assert "has initialised rclpy for this notebook already" in shown

    status, shown = notebook.run("course.Session(domain_id=300)")
    assert (status, shown.count("\n")) == ("error", 0)
    assert shown.startswith("DomainError: ROS domain 300 is out of range")


def test_a_restart_and_an_interrupt_leave_nothing_behind(notebook):
    notebook.run(SETUP)
    domain_id = int(notebook.run("t = course.run(Talker); print(course.session().domain_id)")[1])
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
    notebook.run(SETUP)
    notebook.run("t = course.run(Talker)")
    waiting = notebook.client.execute("print('waiting'); course.until(lambda: False, timeout=600)")
    while notebook.client.get_iopub_msg(timeout=60)["msg_type"] != "stream":
        pass  # until the cell has begun
    notebook.manager.interrupt_kernel()
    while notebook.client.get_shell_msg(timeout=60)["parent_header"]["msg_id"] != waiting:
        pass
    status, _ = notebook.run("n = t.count; course.until(lambda: t.count > n); None")
    assert status == "ok"  # the node went on spinning


def test_news_is_escaped():
    page = News("<b>", "<i>")._repr_html_()
    assert "<b>" not in page
    assert "&lt;b&gt;" in page
    assert "<i>" not in page
