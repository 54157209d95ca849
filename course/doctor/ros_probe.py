"""The doctor's own process: ``python -m course.doctor.ros_probe ROLE [DOMAIN]``.

The last line on stdout is JSON: {"seconds": ...} or {"error": ...}.
"""

from __future__ import annotations

import json
import sys
import time
from typing import TYPE_CHECKING, Any

from course.errors import CourseError

if TYPE_CHECKING:
    from course.runtime.core_session import CoreSession

TIMEOUT_S = 20.0  # s


def import_ros() -> dict[str, object]:
    """Load rclpy and the middleware."""
    start = time.monotonic()
    import rclpy  # noqa: F401 - to see whether it loads
    import std_msgs.msg  # noqa: F401
    from rclpy.utilities import get_rmw_implementation_identifier

    rmw = get_rmw_implementation_identifier()
    return {"seconds": time.monotonic() - start, "rmw": rmw}


def run_echo(session: CoreSession) -> None:
    """Run a node that sends back what it is sent."""
    from rclpy.node import Node
    from std_msgs.msg import String

    class Echo(Node):
        def __init__(self) -> None:
            super().__init__("doctor_echo")
            back = self.create_publisher(String, "doctor/pong", 10)
            self.create_subscription(String, "doctor/ping", back.publish, 10)

    session.run(Echo)


def measure_ping(session: CoreSession) -> dict[str, object]:
    """Send until something comes back; return after how many seconds that was."""
    from rclpy.node import Node
    from std_msgs.msg import String

    class Ping(Node):
        def __init__(self) -> None:
            super().__init__("doctor_ping")
            self.answers: list[Any] = []
            there = self.create_publisher(String, "doctor/ping", 10)
            self.create_subscription(String, "doctor/pong", self.answers.append, 10)
            # Again and again: what is sent before the endpoints match is lost.
            self.create_timer(0.05, lambda: there.publish(String(data="ping")))

    start = time.monotonic()
    node: Any = session.run(Ping)
    session.until(lambda: node.answers, TIMEOUT_S, "an answer of the echo node")
    return {"seconds": time.monotonic() - start}


def play_role(role: str, domain_id: int | None) -> dict[str, object]:
    """Play one role: "imports", "both" nodes at once, "echo" until stdin ends, or "ping"."""
    if role == "imports":
        return import_ros()
    from course.runtime.core_session import CoreSession

    with CoreSession(domain_id=domain_id) as session:
        if role in ("both", "echo"):
            run_echo(session)
        if role in ("both", "ping"):
            return measure_ping(session)
        sys.stdin.read()
    return {}


def main() -> None:
    """Play the role of the command line, and print what was seen."""
    role, *rest = sys.argv[1:]
    try:
        seen = play_role(role, int(rest[0]) if rest else None)
    except CourseError as error:
        seen = {"error": str(error)}
    except Exception as error:  # noqa: BLE001 - whatever a broken machine raises is the finding
        said = str(error).strip().splitlines()
        seen = {"error": f"{type(error).__name__}: {said[0][:200] if said else 'no reason given'}"}
    sys.stdout.write(json.dumps(seen) + "\n")


if __name__ == "__main__":
    main()
