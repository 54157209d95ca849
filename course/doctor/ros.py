"""ROS 2 itself, tried for real: in processes of their own, so that a crash there is only seen."""

from __future__ import annotations

import json
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from importlib import metadata

from packaging.requirements import Requirement

from course.doctor import ros_origin
from course.doctor.finding import HealthFinding, make_ok, make_problem, make_warning
from course.doctor.software import DISTRIBUTION
from course.errors import DomainError
from course.runtime.domains import port_bases
from course.runtime.domains.leases import free_domains, lease_domain
from course.util.platform_check import WHEELS_ANEW, WHEELS_TORN

DEADLINE_S = 40.0  # s for a probe, its imports included; it takes about 1 on an idle machine
FEW_DOMAINS = 10
_MULTICAST = ("239.255.0.1", 0)  # the group of DDSI-RTPS 9.6.1.4, on any free port


def examine_ros() -> Iterator[HealthFinding]:
    """Yield what there is to say about ROS 2, DDS and the domains."""
    yield check_domains(sum(len(free_domains(base)) for base in port_bases.known_bases()))
    yield check_multicast()
    origin = ros_origin.find_origin()
    if origin is None:
        yield make_problem("ROS 2", WHEELS_TORN, WHEELS_ANEW)
        return
    yield ros_origin.check_origin(origin)
    if not origin.from_wheels:
        yield check_ros_packages()
    imports = run_probe("imports")
    if "error" in imports:
        yield make_problem(
            "ROS 2",
            f"rclpy cannot be imported: {imports['error']}",
            "Mend what stands above. If all is well there, install the course again.",
        )
        return
    yield make_ok("ROS 2", f"rclpy and {imports['rmw']} load in {imports['seconds']:.1f} s")
    yield in_one_process()
    yield between_processes()


def check_ros_packages(distribution: str = DISTRIBUTION) -> HealthFinding:
    """Look whether an installed ROS 2 has the packages that the wheels would bring."""
    requirements = [Requirement(text) for text in metadata.requires(distribution) or ()]
    wheels = [r.name for r in requirements if r.name.startswith(ros_origin.WHEEL_PREFIX)]
    if missing := ros_origin.missing_packages(wheels):
        return make_problem(
            "ROS 2 packages",
            f"The ROS 2 that is installed here lacks {', '.join(missing)}.",
            ros_origin.install_advice(missing),
        )
    return make_ok("ROS 2 packages", f"all {len(wheels)} that the course needs are there")


def check_domains(free: int) -> HealthFinding:
    """Judge how many domains are left for sessions."""
    mend = "Shut down notebooks and ROS programs that are no longer used."
    if not free:
        return make_problem("domains", "No ROS domain is free.", mend)
    if free < FEW_DOMAINS:
        return make_warning("domains", f"Only {free} ROS domains are free.", mend)
    return make_ok("domains", f"{free} ROS domains are free")


def check_multicast() -> HealthFinding:
    """Send one datagram to DDS's discovery group over the loopback, and receive it."""
    message = b"course doctor"
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        loopback = socket.inet_aton("127.0.0.1")
        group = socket.inet_aton(_MULTICAST[0])
        try:
            receiver.bind(_MULTICAST)
            membership = struct.pack("4s4s", group, loopback)
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
            receiver.settimeout(2.0)
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, loopback)
            sender.sendto(message, receiver.getsockname())
            if receiver.recv(64) == message:
                return make_ok("multicast", "DDS discovery datagrams arrive on the loopback")
            reason = "another datagram arrived"
        except OSError as error:
            reason = error.strerror or str(error)
    return make_warning(
        "multicast",
        f"DDS discovery datagrams do not arrive on the loopback ({reason}). Nodes of one session "
        "still find each other; nodes of other programs may not.",
        "Let UDP to 239.255.0.1 and 127.0.0.1 through the firewall; in a network namespace: "
        "`ip link set lo up multicast on`.",
    )


def in_one_process() -> HealthFinding:
    """Send a message to another node and back, in one process."""
    return _round_trip("round trip in one process", run_probe("both"))


def between_processes() -> HealthFinding:
    """Send a message to a node of another process and back."""
    name = "round trip between processes"
    try:
        lease = lease_domain()
    except DomainError as error:
        return make_problem(name, str(error))
    with ExitStack() as stack:
        stack.callback(lease.release)
        echo = subprocess.Popen(
            _probe_command("echo", lease.domain_id),
            stdin=subprocess.PIPE,  # closed, it tells the echo to end
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        stack.callback(_end_process, echo)
        return _round_trip(name, run_probe("ping", lease.domain_id))


def run_probe(*arguments: object) -> dict[str, object]:
    """Run a probe to its end; return what it saw, or {"error": a sentence}."""
    try:
        done = subprocess.run(
            _probe_command(*arguments),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=DEADLINE_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return {"error": f"it gave no answer in {DEADLINE_S:.0f} s"}
    try:
        data = json.loads(done.stdout.splitlines()[-1])
    except (ValueError, IndexError):
        said = done.stderr.strip().splitlines()
        return {
            "error": f"it ended with code {done.returncode}" + (f", {said[-1]}" if said else "")
        }
    return data if isinstance(data, dict) else {"error": "it gave a strange answer"}


def _round_trip(name: str, seen: dict[str, object]) -> HealthFinding:
    if "error" in seen:
        return make_problem(
            name,
            f"No message came back: {seen['error']}",
            "Mend what stands above. If all is well there, a firewall on 127.0.0.1 is likely.",
        )
    return make_ok(name, f"a message went there and back {seen['seconds']:.2f} s after the start")


def _probe_command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "course.doctor.ros_probe", *(str(value) for value in arguments)]


def _end_process(process: subprocess.Popen[bytes]) -> None:
    assert process.stdin is not None
    process.stdin.close()
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
