"""The gripper's service: it answers as the gripper's fault says, late or never if need be."""

from __future__ import annotations

from std_srvs.srv import SetBool

from course.runtime.requests.held_service import Request, hold_requests
from course.worlds.interfaces.ports import Ports
from course.worlds.robot.gripper import SLOW_STEPS


class GripperService:
    """``gripper/set``, a `std_srvs/SetBool`: true closes the gripper, false opens it."""

    def __init__(self, ports: Ports) -> None:
        """Serve it from the world's node."""
        self._ports = ports
        self._due: list[tuple[int, Request]] = []  # how many steps are left until it is answered
        hold_requests(
            ports.node, SetBool, "gripper/set", self._take, lambda: ports.simulation.time_s
        )

    def after_step(self) -> None:
        """Send the late answers that are due."""
        if self._due:
            due = [request for left, request in self._due if left <= 1]
            self._due = [(left - 1, request) for left, request in self._due if left > 1]
            for request in due:
                self._answer(request, accepted=True)

    def reset(self) -> None:
        """Forget the requests that wait: nobody answers them any more."""
        self._due.clear()

    def _take(self, request: Request) -> None:
        with self._ports.lock:
            self._ports.catch_up()
            if not self._ports.has_radio:
                return  # neither the request nor an answer comes through
            accepted = self._ports.simulation.command_gripper(request.message.data)
            state = self._ports.simulation.faults["gripper"]
            if state == "slow":
                self._due.append((SLOW_STEPS, request))
            elif state != "dead":
                self._answer(request, accepted=accepted)

    def _answer(self, request: Request, *, accepted: bool) -> None:
        if self._ports.has_radio:
            done = "closed" if request.message.data else "opened"
            request.answer(success=accepted, message=done if accepted else "refused")
