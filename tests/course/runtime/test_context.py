"""Opening a context: the environment is put back, and a log folder is always there."""

from __future__ import annotations

import os

from rclpy.node import Node

import course
from course.runtime.context.context import _set_environment, ensure_log_dir

RANGE, PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"


def test_the_discovery_environment_is_put_back(monkeypatch):
    monkeypatch.setenv(RANGE, "SUBNET")
    monkeypatch.delenv(PEERS, raising=False)
    with course.Session(discovery="LOCALHOST", peers=["192.0.2.1"]):
        assert os.environ[RANGE] == "SUBNET"
        assert PEERS not in os.environ


def test_variables_are_set_inside_only(monkeypatch):
    monkeypatch.setenv(PEERS, "192.0.2.1")
    with _set_environment({PEERS: "127.0.0.1"}):
        assert os.environ[PEERS] == "127.0.0.1"
    assert os.environ[PEERS] == "192.0.2.1"


def test_a_discovery_range_can_be_inherited(monkeypatch):
    monkeypatch.setenv("COURSE_DISCOVERY", "inherit")
    monkeypatch.setenv(RANGE, "OFF")  # then not even two contexts of one process meet
    with course.Session() as one, course.Session(domain_id=one.domain_id) as other:
        one.run(Node, "one")
        watcher = other.run(Node, "other")
        assert watcher.get_node_names() == ["other"]
        try:
            other.until(lambda: "one" in watcher.get_node_names(), timeout=0.5)
        except course.WaitTimeout:
            return
    raise AssertionError("OFF was not inherited")


def test_an_unusable_log_folder_is_replaced(monkeypatch, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("ROS_LOG_DIR", str(blocked / "log"))
    ensure_log_dir()
    folder = os.environ["ROS_LOG_DIR"]
    assert folder != str(blocked / "log")
    assert os.access(folder, os.W_OK)


def test_a_usable_log_folder_is_kept(monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    ensure_log_dir()
    assert os.environ["ROS_LOG_DIR"] == str(tmp_path)


def test_many_participants_on_one_domain_find_each_other(session):
    session.run(Node, "first")
    others = [course.Session(domain_id=session.domain_id) for _ in range(6)]
    try:
        for number, other in enumerate(others):
            other.run(Node, f"other_{number}")
        watcher = session.nodes["/first"]
        session.until(
            lambda: len(watcher.get_node_names()) == 7, timeout=20.0, what="seven participants"
        )
    finally:
        for other in others:
            other.close()
