"""Domain ids: what is safe, and leases that nobody else on the machine gets."""

from __future__ import annotations

import os
import signal
import socket

import pytest

from course.errors import DomainError
from course.runtime.domains import leases, port_bases
from course.runtime.domains.leases import check_domain_id, leasable_domains, lease_domain
from course.runtime.domains.rtps_ports import domains_in_use


def leave_one(domain_id, monkeypatch):
    """Let this be the one domain that there is."""
    monkeypatch.setattr(leases, "leasable_domains", lambda *_: [domain_id])
    monkeypatch.setattr(port_bases, "known_bases", lambda: (port_bases.current_base(),))


@pytest.mark.parametrize("domain_id", [0, 1, 101, 215, 232])
def test_safe_domains_are_accepted(domain_id):
    assert check_domain_id(domain_id) == domain_id


@pytest.mark.parametrize("domain_id", [-1, 102, 214, 233, 10**9])
def test_a_domain_out_of_range_is_one_sentence(domain_id):
    with pytest.raises(
        DomainError, match=f"domain {domain_id} is out of range: choose .* 0 to 101 or 215 to 232"
    ):
        check_domain_id(domain_id)


@pytest.mark.parametrize("domain_id", ["5", 5.0, None, True])
def test_a_domain_that_is_no_whole_number_is_one_sentence(domain_id):
    with pytest.raises(DomainError, match="whole number"):
        check_domain_id(domain_id)


def test_leases_are_distinct_and_never_the_default_domain():
    leases = [lease_domain() for _ in range(5)]
    try:
        ids = [lease.domain_id for lease in leases]
        assert len(set(ids)) == 5
        assert all(domain_id in leasable_domains() for domain_id in ids)
    finally:
        for lease in leases:
            lease.release()


def test_a_released_domain_can_be_leased_again(monkeypatch):
    lease = lease_domain()
    leave_one(lease.domain_id, monkeypatch)
    with pytest.raises(DomainError, match="are taken"):
        lease_domain()
    lease.release()
    lease.release()
    again = lease_domain()
    again.release()
    assert again.domain_id == lease.domain_id


def test_a_lease_dies_with_its_process_however_it_ends(start_script, monkeypatch):
    process = start_script(
        "import signal\n"
        "from course.runtime.domains.leases import lease_domain\n"
        "lease = lease_domain()\n"
        "print(lease.domain_id, flush=True)\n"
        "signal.pause()\n"
    )
    domain_id = int(process.stdout.readline())
    leave_one(domain_id, monkeypatch)
    with pytest.raises(DomainError):
        lease_domain()
    process.send_signal(signal.SIGKILL)
    process.wait()
    lease_domain().release()


FORKED = """
import os, signal
from course.runtime.domains.leases import lease_domain

lease = lease_domain()
child = os.fork()
if child == 0:
    print(lease.domain_id, os.getpid(), flush=True)
    signal.pause()
signal.pause()
"""


def test_a_forked_child_does_not_keep_a_lease_alive(start_script, monkeypatch):
    process = start_script(FORKED)
    domain_id, child = (int(word) for word in process.stdout.readline().split())
    try:
        process.kill()
        process.wait()
        leave_one(domain_id, monkeypatch)
        lease_domain().release()
    finally:
        os.kill(child, signal.SIGKILL)


def test_a_domain_whose_ports_are_open_is_passed_over():
    lease = lease_domain()
    domain_id = lease.domain_id
    assert domain_id not in domains_in_use()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as somebody_else:
        somebody_else.bind(("127.0.0.1", 7400 + 250 * domain_id + 10))
        assert domain_id in domains_in_use()
    lease.release()
