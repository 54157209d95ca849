"""What an executor waits for, and how soon it hears of it."""

from __future__ import annotations

from rcl_interfaces.srv import GetParameters
from rclpy.node import Node

from course.runtime.executor import wait_list


class Asker(Node):
    def __init__(self) -> None:
        super().__init__("asker")
        self.declare_parameter("speed", 1.0)
        self.client = self.create_client(GetParameters, "asker/get_parameters")


def test_who_asks_about_parameters_is_not_made_to_wait_each_time(session, monkeypatch):
    monkeypatch.setattr(wait_list, "ASKED_S", 600.0)
    node = session.run(Asker)
    session.until(node.client.service_is_ready)
    for number in range(5):
        future = node.client.call_async(GetParameters.Request(names=["speed"]))
        session.until(future.done, timeout=60, what=f"answer {number}")
        # From now on, requests would be looked for every ten minutes.
        monkeypatch.setattr(wait_list, "SELDOM_S", 600.0)
