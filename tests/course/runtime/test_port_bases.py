"""More domains than ids: port bases beside the usual one, where nobody hears anybody else."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ET
from collections.abc import Iterator

import pytest

from course.errors import DomainError
from course.learner_session.session import Session
from course.runtime.domains import leases, port_bases, rtps_ports
from course.runtime.domains.rtps_ports import BASES, USUAL_BASE, domain_ports, safe_domains
from course.util import operating_system
from tests.benchmarks.bench_many_sessions import Worker, listen

BESIDE = BASES[1]


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Give a process that has not chosen its port base yet, and forget what it chose."""
    for name in (port_bases.PORT_BASE, port_bases.PROFILES, port_bases.PROFILES_OF_3):
        monkeypatch.setenv(name, "")  # so that it is put back
        monkeypatch.delenv(name)
    monkeypatch.setattr(port_bases, "_settled", False)
    monkeypatch.setattr(port_bases, "_may_move", lambda: True)
    return iter(())


def test_no_port_belongs_to_two_domains_nor_to_whoever_asks_for_any() -> None:
    ephemeral = operating_system.ephemeral_ports()
    ports = list(
        itertools.chain.from_iterable(
            domain_ports(domain, base) for base in BASES for domain in safe_domains(base)
        )
    )
    assert len(ports) == len(set(ports))
    assert max(ports) <= 65535
    assert not set(ports) & set(ephemeral)
    assert 1 < rtps_ports.LEASE_PORT < 10  # between those for multicast and the participants'


def test_what_the_system_hands_out_decides_which_domains_are_safe(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The ROS 2 documentation names these for Linux and for macOS."""
    for ephemeral, words in (
        (range(32768, 61000), "0 to 101 or 215 to 232"),
        (range(49152, 65536), "0 to 166"),
        (range(1024, 65536), "0 to 101"),
    ):
        monkeypatch.setattr(operating_system, "ephemeral_ports", lambda ports=ephemeral: ports)
        assert leases.describe_domains() == words
        assert len(leases.leasable_domains()) >= 101


def test_the_profile_has_the_ports_that_are_reckoned_with() -> None:
    [port] = ET.parse(port_bases.PROFILE).findall(".//{*}port")
    values = {child.tag.rpartition("}")[2]: child.text for child in port}
    assert values.pop("portBase") == f"${{{port_bases.PORT_BASE}}}"
    numbers = {name: int(text or "") for name, text in values.items()}
    assert numbers["domainIDGain"] == rtps_ports.DOMAIN_GAIN
    looked_for = {numbers["offsetd1"] + numbers["participantIDGain"] * n for n in range(32)}
    data = {numbers["offsetd3"] + numbers["participantIDGain"] * n for n in range(10)}
    multicast = {numbers["offsetd0"], numbers["offsetd2"]}
    assert looked_for | data | multicast == set(range(rtps_ports.BESIDE_PORTS))


@pytest.mark.parametrize(
    ("free", "order"),
    [
        ({7400: 1.0, 7474: 1.0}, [7400, 7474]),
        ({7400: 0.5, 7474: 1.0}, [7400, 7474]),
        ({7400: 0.4, 7474: 0.6, 7518: 0.9}, [7474, 7518, 7400]),
        ({7400: 0.1, 7474: 0.4, 7518: 0.2}, [7474, 7518, 7400]),
    ],
)
def test_who_comes_early_keeps_room_for_a_second_domain(
    fresh: None, free: dict[int, float], order: list[int]
) -> None:
    assert port_bases.possible_bases(free) == order


def test_a_process_stays_at_the_base_that_it_began_with(
    fresh: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    port_bases.settle(BESIDE)
    assert port_bases.current_base() == BESIDE
    assert port_bases.possible_bases({USUAL_BASE: 1.0, BESIDE: 0.0}) == [BESIDE]
    port_bases.settle(USUAL_BASE)
    assert port_bases.current_base() == BESIDE
    with pytest.raises(DomainError, match=r"cannot join ROS domain 7: restart its kernel") as said:
        Session(domain_id=7)
    assert "\n" not in str(said.value)
    lease = leases.reserve_domain(7)  # as the process that started this one has done
    assert lease is not None
    leases.require_reachable(7)
    lease.release()


def test_profiles_of_somebody_else_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(port_bases, "_settled", False)
    monkeypatch.setenv(port_bases.PROFILES, "/etc/profiles.xml")
    assert port_bases.possible_bases({USUAL_BASE: 0.0, BESIDE: 1.0}) == [USUAL_BASE]


def test_one_domain_at_five_bases_is_five_domains() -> None:
    """Ten sessions: two ids, one above 214, at each base; then two more that share one of them."""
    domains = [next(d for d in reversed(leases.free_domains()) if d < 100)]
    domains.append(next(d for d in leases.free_domains(BASES[-1]) if d > 214))
    places = [*((base, domains) for base in BASES), (BESIDE, domains)]
    found = listen(
        Worker(10 * number, 2, base=base, domains=ids)
        for number, (base, ids) in enumerate(places, 1)
    )
    assert len(set(found["places"].values())) == 10
    for number, heard in found["heard"].items():
        shared = [n for n, place in found["places"].items() if place == found["places"][number]]
        assert heard == shared, number
