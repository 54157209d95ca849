"""A hidden node that listens and asks on behalf of a session, in a thread of its own."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import Any

from rclpy.client import Client
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rclpy.task import Future

from course.errors import WaitTimeout
from course.runtime.executor.executor_pool import ExecutorPool
from course.runtime.requests.graph_queries import (
    fitting_qos,
    full_service,
    full_topic,
    require_type,
    why_no_message,
    why_no_service,
)
from course.runtime.waiting import Deadline, Pulse, poll_condition

_LISTEN_DEPTH = 1000
_MAX_TIMEOUT_S = 1e9  # s: a Duration counts nanoseconds in 64 bits


class _HiddenNode(Node):
    """Has nothing for its executor to wait on until it listens or asks.

    A step of simulated time looks at every executor, time and again. And what rclpy logs about QoS
    events of a hidden node helps nobody: a wait that fails says why.
    """

    def create_publisher(self, *args: Any, **options: Any) -> Publisher:
        """Do what every node does, without handlers of QoS events."""
        options.setdefault("event_callbacks", PublisherEventCallbacks(use_default_callbacks=False))
        return super().create_publisher(*args, **options)


class Probe:
    """Subscribes, calls services and sends goals without disturbing the session's own nodes.

    It has its own single-threaded executor: a callback that blocks cannot keep it from listening.
    The leading underscore of its name makes the ROS tools hide it. What waits on its own, as a
    recorder does, waits in a block of `explaining`, so that the session can say why it was in vain.
    """

    def __init__(self, context: Context, pool: ExecutorPool, pulse: Pulse) -> None:
        """Make the hidden node in `context`."""
        self.pulse = pulse
        self.explaining: Callable[[], AbstractContextManager[None]] = contextlib.nullcontext
        self.node = _HiddenNode(
            f"_course_{os.getpid()}_{id(self):x}",
            context=context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[Parameter("start_type_description_service", value=False)],
        )
        self.executor = pool.get_executor(1, "probe")
        self.executor.add_node(self.node)

    def subscribe(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[..., None],
        qos: QoSProfile | int,
        *,
        raw: bool = False,
    ) -> Subscription:
        """Subscribe, ``raw`` to messages as CDR; the caller drops it with `drop`.

        Raises:
            WaitTimeout: the topic has another type.
        """
        require_type(topic, msg_type, self.node.get_topic_names_and_types())
        return self.node.create_subscription(msg_type, topic, callback, qos, raw=raw)

    def drop(self, entity: Subscription | Client) -> None:
        """Destroy a subscription or client of the hidden node. Idempotent."""
        with self.executor.hold_still():
            if isinstance(entity, Subscription):
                self.node.destroy_subscription(entity)
            else:
                self.node.destroy_client(entity)

    def next_message(
        self, msg_type: Any, topic: str, qos: QoSProfile | None, timeout: float
    ) -> Any:
        """Return the next message; see `Session.next_message`."""
        topic = full_topic(self.node, topic)
        inbox: list[Any] = []
        deadline = Deadline(timeout)
        profile = qos or fitting_qos(self.node, topic, _LISTEN_DEPTH)
        with self._listen_to(msg_type, topic, inbox, profile):
            # Listen at once, whatever is offered: the publisher may appear and publish meanwhile.
            poll_condition(
                lambda: inbox or self.node.count_publishers(topic),
                deadline.seconds_left,
                self.pulse,
            )
            better = profile if qos is not None else fitting_qos(self.node, topic, _LISTEN_DEPTH)
            with contextlib.ExitStack() as stack:
                if not inbox and better != profile:
                    stack.enter_context(self._listen_to(msg_type, topic, inbox, better))
                if poll_condition(lambda: inbox, deadline.seconds_left, self.pulse):
                    return inbox[0]
        reason = why_no_message(self.node, topic, msg_type, better)
        raise WaitTimeout(f"No message on {topic} in {timeout:g} s. {reason}", topic)

    def publish(self, topic: str, message: Any, qos: QoSProfile, timeout: float) -> None:
        """Publish one message as soon as a subscription matches; see `Session.publish`."""
        with self.open_publisher(type(message), topic, qos, timeout) as publisher:
            if not poll_condition(publisher.get_subscription_count, timeout, self.pulse):
                raise WaitTimeout(
                    f"Nobody with a QoS that fits subscribes to {publisher.topic_name}, so nothing "
                    f"was published in {timeout:g} s."
                )
            publisher.publish(message)

    @contextlib.contextmanager
    def open_publisher(
        self, msg_type: Any, topic: str, qos: QoSProfile, timeout: float
    ) -> Iterator[Publisher]:
        """Give a publisher for a block; see `Session.publisher`."""
        topic = full_topic(self.node, topic)
        require_type(topic, msg_type, self.node.get_topic_names_and_types())
        publisher = self.node.create_publisher(msg_type, topic, qos)
        try:
            yield publisher
            publisher.wait_for_all_acked(Duration(seconds=min(timeout, _MAX_TIMEOUT_S)))
        finally:
            with self.executor.hold_still():
                self.node.destroy_publisher(publisher)

    @contextlib.contextmanager
    def open_client(self, srv_type: Any, name: str, deadline: Deadline) -> Iterator[Client]:
        """Give a client whose server is there.

        Raises:
            WaitTimeout: no server by the deadline.
        """
        name = full_service(self.node, name)
        require_type(name, srv_type, self.node.get_service_names_and_types())
        client = self.node.create_client(srv_type, name)
        try:
            if not poll_condition(client.service_is_ready, deadline.seconds_left, self.pulse):
                reason = why_no_service(self.node, name, srv_type)
                raise WaitTimeout(
                    f"The service {name} was not ready in {deadline.total:g} s. {reason}", name
                )
            yield client
        finally:
            self.drop(client)

    def call(self, srv_type: Any, name: str, request: Any, timeout: float) -> Any:
        """Return a service's response; see `Session.call`."""
        deadline = Deadline(timeout)
        with self.open_client(srv_type, name, deadline) as client:
            future = client.call_async(request)
            return self.wait_for_result(
                future, deadline, f"The service {client.service_name} did not answer"
            )

    def collect_answers(
        self, srv_type: Any, names: Sequence[str], timeout: float
    ) -> dict[str, Any]:
        """Return the responses that come in time; see `Session.answers`."""
        clients = {name: self.node.create_client(srv_type, name) for name in names}
        futures: dict[str, Future] = {}

        def all_answered() -> bool:
            for name, client in clients.items():
                if name not in futures and client.service_is_ready():
                    futures[name] = client.call_async(srv_type.Request())
            done = [name for name, future in futures.items() if future.done()]
            return len(done) == len(clients)

        try:
            poll_condition(all_answered, timeout, self.pulse)
            return {name: future.result() for name, future in futures.items() if future.done()}
        finally:
            for client in clients.values():
                self.drop(client)

    def wait_for_result(self, future: Future, deadline: Deadline, complaint: str) -> Any:
        """Return the result of `future`.

        Raises:
            WaitTimeout: none by the deadline; its message begins with `complaint`.
        """
        if not poll_condition(future.done, deadline.seconds_left, self.pulse):
            if not self.node.context.ok():
                raise ExternalShutdownException
            raise WaitTimeout(f"{complaint} in {deadline.total:g} s.")
        return future.result()

    @contextlib.contextmanager
    def _listen_to(
        self, msg_type: Any, topic: str, inbox: list[Any], qos: QoSProfile
    ) -> Iterator[None]:
        subscription = self.subscribe(msg_type, topic, inbox.append, qos)
        try:
            yield
        finally:
            self.drop(subscription)
