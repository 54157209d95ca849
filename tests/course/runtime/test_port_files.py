"""Half-made shared-memory ports: what a killed program leaves does not hang the next session."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest
from rclpy.node import Node

import course
from course.runtime.domains import port_files
from course.runtime.domains.leases import lease_domain

USER_PORT = 7411  # of the first participant on domain 0: DDSI-RTPS 2.2, section 9.6.1.1
STATES = {"empty": b"", "sized": bytes(52400), "being written": (1).to_bytes(4, "little")}


def ports_of(domain_id: int) -> list[Path]:
    """Return the ports of the first participants on a domain.

    Which one a participant gets depends on how many others its process still has, on any domain.
    """
    first = USER_PORT + 250 * domain_id
    return [port_files.FOLDER / f"fastrtps_port{first + 2 * number}" for number in range(20)]


def age(path: Path, seconds: float) -> None:
    then = time.time() - seconds
    os.utime(path, (then, then))


@pytest.mark.parametrize("state", STATES)
def test_a_session_comes_up_where_a_program_was_killed(state):
    lease = lease_domain()
    ports = ports_of(lease.domain_id)
    for port in ports:
        port.write_bytes(STATES[state])
        age(port, 60)
    try:
        with course.Session(domain_id=lease.domain_id) as session:
            session.run(Node, "survivor")
            (made,) = (port for port in ports if port.exists())
            assert made.read_bytes()[:4] == (2).to_bytes(4, "little"), "DDS has made a new one"
    finally:
        for port in ports:
            port.unlink(missing_ok=True)
        lease.release()


def test_the_port_of_a_running_session_stays(session):
    session.run(Node, "resident")
    ports = [port for port in ports_of(session.domain_id) if port.exists()]
    assert ports
    made = [port.stat().st_ino for port in ports]
    for port in ports:
        age(port, 60)
    port_files.remove_abandoned(session.domain_id)
    assert [port.stat().st_ino for port in ports] == made


def test_one_that_may_be_in_the_making_is_waited_for(tmp_path):
    young, done = tmp_path / "fastrtps_port7411", tmp_path / "fastrtps_port7413"
    young.touch()
    done.write_bytes((2).to_bytes(4, "little"))
    made = young.stat().st_mtime
    port_files.remove_abandoned(0, tmp_path)
    assert time.time() - made >= port_files.MAKING_S
    assert [path.name for path in tmp_path.iterdir()] == ["fastrtps_port7413"]


def test_locks_and_segments_are_no_ports(tmp_path):
    names = {"fastrtps_port7411_el", "fastrtps_0123", "sem.fastrtps_port7411_mutex"}
    for name in names:
        (tmp_path / name).touch()
        age(tmp_path / name, 60)
    port_files.remove_abandoned(0, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == names


def test_ports_of_other_domains_are_not_looked_at(tmp_path):
    other = tmp_path / f"fastrtps_port{USER_PORT + 250 * 7}"
    other.touch()
    age(other, 60)
    port_files.remove_abandoned(3, tmp_path)
    assert other.exists()
    port_files.remove_abandoned(7, tmp_path)
    assert not other.exists()
