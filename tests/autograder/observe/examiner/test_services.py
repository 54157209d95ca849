"""A service that is played, on real DDS: it answers when it is told to, raises, and vanishes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from std_srvs.srv import SetBool

from autograder.observe import Service
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.examiner.services import ServiceServer
from course import Session

GRIPPER = Service("gripper/set", SetBool)


class Ends:
    """A server that is played, and a client of it."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.server: Any = session.run(lambda: ServiceServer(GRIPPER, lambda: 2.5))
        self.client = session.run(lambda: QuietNode("asker")).create_client(SetBool, "gripper/set")
        session.until(self.client.service_is_ready)

    def ask(self, close: bool) -> Any:
        """Call the service, and return the future of its answer once the request is there."""
        before = len(self.server.requests)
        answer = self.client.call_async(SetBool.Request(data=close))
        self.session.until(lambda: len(self.server.requests) > before)
        return answer


@pytest.fixture
def ends() -> Iterator[Ends]:
    with Session() as session:
        yield Ends(session)


def test_requests_wait_and_are_answered_in_any_order(ends: Ends) -> None:
    first, second = ends.ask(True), ends.ask(False)
    assert [request.message.data for request in ends.server.requests] == [True, False]
    assert {request.at_s for request in ends.server.requests} == {2.5}
    ends.server.requests[1].answer(success=True)
    ends.session.until(second.done)
    assert second.result().success
    assert not first.done()


def test_a_callback_that_raises_answers_nobody(ends: Ends) -> None:
    first = ends.ask(True)
    ends.server.requests[0].fail()
    ends.server.requests[0].answer(success=True)
    second = ends.ask(True)
    ends.server.requests[1].answer(success=True)
    ends.session.until(second.done)
    assert not first.done()


def test_a_server_vanishes_with_what_it_has(ends: Ends) -> None:
    answer = ends.ask(True)
    ends.session.stop(ends.server)
    ends.session.until(lambda: not ends.client.service_is_ready())
    assert not answer.done()
