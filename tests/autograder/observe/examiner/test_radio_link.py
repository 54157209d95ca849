"""A radio link loses packets only in a network of its own; what it does there the corpora show."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import NotExaminable
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.examiner.radio_link import _own_ports, open_radio_link
from course import Session


def test_packets_of_others_are_never_lost() -> None:
    bench = cast(CheckContext, SimpleNamespace(outside=SimpleNamespace(own_network=False)))
    with pytest.raises(NotExaminable, match="could not be examined"), open_radio_link(bench):
        pass


def test_a_participant_has_ports_of_its_own() -> None:
    with Session() as near:
        near.run(QuietNode, "near")
        before = _own_ports()
        with Session(domain_id=near.domain_id) as far:
            far.run(QuietNode, "far")
            assert _own_ports() - before
