"""A network of its own for one experiment, whose loss can be set, where the machine allows it.

A network namespace with nothing but its loopback: DDS speaks UDP over it (never shared memory,
which no rule could drop), and nftables drops a share of the packets.
"""

from __future__ import annotations

import subprocess
from functools import cache

from course.util import executables

ENTER = ("unshare", "--map-root-user", "--net", "--")
"""Begins a command line that runs in a network namespace of its own."""

ENVIRONMENT = {
    # LOCALHOST would switch shared memory back on, UDPv4 or not.
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
}

_TOOLS = ("unshare", "ip", "nft")
_TIMEOUT_S = 10.0


@cache
def problem() -> str:
    """Return why there can be no loss here, as a sentence; empty if there can."""
    missing = [tool for tool in _TOOLS if executables.find_tool(tool) is None]
    if missing:
        return (
            f"A lossy link needs {', '.join(missing)}: install util-linux, iproute2 and nftables."
        )
    tried = subprocess.run(
        [*ENTER, executables.find_tool("nft") or "nft", "list", "tables"],
        capture_output=True,
        timeout=_TIMEOUT_S,
        check=False,
    )
    if tried.returncode:
        return "This machine does not allow network namespaces, so there is no lossy link."
    return ""


def bring_up() -> None:
    """Make the loopback of this namespace a network on which DDS finds its peers."""
    _run_tool("ip", "link", "set", "lo", "up", "multicast", "on")
    _run_tool("ip", "route", "add", "224.0.0.0/4", "dev", "lo")
    _run_tool("nft", "add table ip lab; add chain ip lab in { type filter hook input priority 0; }")


def set_loss(percent: int) -> None:
    """Drop ``percent`` of all UDP packets from now on; 0 drops none."""
    rules = "flush chain ip lab in"
    if percent:
        rules += f"; add rule ip lab in ip protocol udp numgen random mod 100 < {percent} drop"
    _run_tool("nft", rules)


def _run_tool(tool: str, *arguments: str) -> None:
    command = [executables.find_tool(tool) or tool, *arguments]
    subprocess.run(command, check=True, capture_output=True, timeout=_TIMEOUT_S)
