"""Proofs: what a service call gives its client."""

from __future__ import annotations

from std_srvs.srv import Trigger


def server(node, answered):
    def answer(request, response):
        answered.append(request)
        response.message = f"answer {len(answered)}"
        return response

    return node.create_service(Trigger, "ask", answer)


def test_a_call_has_exactly_one_response(ros):
    answered, responses = [], []
    server(ros.node("server"), answered)
    client = ros.node("client").create_client(Trigger, "ask")
    ros.until(client.service_is_ready, "the service")
    for number in range(1, 4):
        future = client.call_async(Trigger.Request())
        future.add_done_callback(lambda done: responses.append(done.result().message))
        ros.until(lambda number=number: len(responses) == number, "the response")
    # A later call has come and gone, so a further response to an earlier one would be here by now.
    assert responses == ["answer 1", "answer 2", "answer 3"]
    assert len(answered) == 3


def test_call_async_returns_before_the_response(ros):
    answered = []
    busy = ros.node("server", spun=False)
    server(busy, answered)
    client = ros.node("client").create_client(Trigger, "ask")
    ros.until(client.service_is_ready, "the service")
    future = client.call_async(Trigger.Request())
    assert not future.done()
    assert answered == []
    ros.main.executor.add_node(busy)
    ros.until(future.done, "the response")
    assert future.result().message == "answer 1"


def test_a_request_sent_before_the_server_exists_is_lost(ros):
    answered = []
    client = ros.node("client").create_client(Trigger, "ask")
    early = client.call_async(Trigger.Request())
    server(ros.node("server"), answered)
    ros.until(client.service_is_ready, "the service")
    later = client.call_async(Trigger.Request())
    ros.until(later.done, "the response to the second request")
    assert later.result().message == "answer 1"  # the first request that the server ever saw
    assert not early.done()
    assert len(answered) == 1
