"""The examiner's end of a task: it hears what student nodes publish, and says what they hear."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.service import Service as RosService

from autograder.observe.examiner.actions import ActionClientEnd
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.graph.qos_refusal import find_refusal
from autograder.observe.nouns import Action, Service, Task, Topic
from autograder.observe.participants import of_others
from course.runtime.requests.held_service import Request, hold_requests
from course.runtime.requests.service_ends import count_known_clients, count_known_servers

# What is offered meets every demand but that of a deadline, so a student's QoS is free.
OFFERED = QoSProfile(
    depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
LOSSLESS = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)
UNDEMANDING = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT)


@dataclass(frozen=True)
class Heard:
    """A message that came: when, in s of the node's time, and what it says."""

    at_s: float
    value: Any


class ExaminerEnd(QuietNode):
    """A node of the examiner's with an end for each topic of a task.

    Attributes:
        now_s: the time of the node under test, which `ObservedNode.advance` moves.
    """

    def __init__(self) -> None:
        """Create no endpoints yet."""
        super().__init__("examiner")
        self.now_s = 0.0
        self._heard: dict[str, list[tuple[float, Any]]] = {}  # when, and the message
        self._listening: dict[str, Any] = {}
        self._telling: dict[str, Any] = {}
        self._asking: dict[str, Any] = {}
        self._goals: dict[str, ActionClientEnd] = {}
        self._requests: dict[str, list[Request]] = {}
        self._serving: list[RosService] = []

    def listen(self, topic: Topic) -> None:
        """Listen to a topic, with what its publishers offer: lossless wherever that is possible."""
        offers = [
            end.qos_profile for end in of_others(self.get_publishers_info_by_topic(str(topic)))
        ]
        reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offers)
        wanted = LOSSLESS if reliable else UNDEMANDING
        present = self._listening.get(topic.name)
        if present is not None and present.qos_profile.reliability == wanted.reliability:
            return
        if present is not None:
            self.destroy_subscription(present)
        heard = self._heard.setdefault(topic.name, [])

        def note(message: Any) -> None:
            heard.append((self.now_s, message))

        self._listening[topic.name] = self.create_subscription(topic.type, str(topic), note, wanted)

    def heard(self, topic: Topic) -> list[Heard]:
        """Return what came on a topic so far."""
        return [
            Heard(at_s, topic.value(message)) for at_s, message in self._heard.get(topic.name, ())
        ]

    def values(self, topic: Topic) -> list[Any]:
        """Return what came on a topic so far, as `Topic.value` has it."""
        return [heard.value for heard in self.heard(topic)]

    def clear(self, topic: Topic) -> None:
        """Forget what came on a topic so far."""
        self._heard.get(topic.name, []).clear()

    def forget(self) -> None:
        """Forget what came so far, and answer what waits: it was another node's."""
        for heard in self._heard.values():
            heard.clear()
        for requests in self._requests.values():
            for request in requests:
                request.answer()
            requests.clear()

    def disconnect(self) -> None:
        """Take down all that an earlier node was told or asked through.

        A publisher would hand a new node what it told the old one. And a new reader of a writer
        that has said something before waits for what it is told to leave out: if that comes before
        it knows the writer, it comes again with its first ACKNACK, 70 ms later (Fast DDS's
        ``initialAcknackDelay``). By then simulated time has passed an answer's time-out.
        """
        for publisher in self._telling.values():
            self.destroy_publisher(publisher)
        for client in self._asking.values():
            self.destroy_client(client)
        for goals in self._goals.values():
            goals.destroy()
        for server in self._serving:
            self.destroy_service(server)
        for ends in (self._telling, self._asking, self._goals, self._requests, self._serving):
            ends.clear()

    def serve(self, service: Service) -> None:
        """Play a service: each request waits until it is answered."""
        if service.name in self._requests:
            return
        requests = self._requests.setdefault(service.name, [])
        self._serving.append(
            hold_requests(self, service.type, str(service), requests.append, lambda: self.now_s)
        )

    def requests(self, service: Service) -> list[Request]:
        """Return the requests that came to a service which the examiner plays."""
        return list(self._requests.get(service.name, ()))

    def publisher(self, topic: Topic) -> Any:
        """Return the examiner's publisher on a topic; it is there from the first call on."""
        if topic.name not in self._telling:
            self._telling[topic.name] = self.create_publisher(topic.type, str(topic), OFFERED)
        return self._telling[topic.name]

    def connect(self, served: Service | Action) -> None:
        """Create the examiner's client of a service or an action."""
        if isinstance(served, Action):
            self.action_client(served)
        else:
            self.client_of(str(served), served.type)

    def is_served(self, served: Service | Action) -> bool:
        """Return whether the examiner's client has found a server of a service or an action."""
        if isinstance(served, Action):
            return self.action_client(served).is_ready()
        return bool(self.client_of(str(served), served.type).service_is_ready())

    def action_client(self, action: Action) -> ActionClientEnd:
        """Return the examiner's client of an action; it is there from the first call on."""
        if action.name not in self._goals:
            self._goals[action.name] = ActionClientEnd(self, action, lambda: self.now_s)
        return self._goals[action.name]

    def destroy_node(self) -> None:
        """Destroy it with its action clients, which rclpy leaves alive."""
        for client in self._goals.values():
            client.destroy()
        super().destroy_node()

    def client_of(self, name: str, service_type: Any) -> Any:
        """Return the examiner's client of a service; it is there from the first call on."""
        if name not in self._asking:
            self._asking[name] = self.create_client(service_type, name)
        return self._asking[name]

    def missing(self, task: Task) -> list[str]:
        """Return which endpoints of a task's node are not on the graph, a phrase each."""
        return [f"no {what}" for what, is_there in self.find_ends(task) if not is_there]

    def find_ends(self, task: Task) -> list[tuple[str, bool]]:
        """Return each endpoint of a task's node, in words, and whether it is on the graph."""
        publishers = self.get_publishers_info_by_topic
        subscriptions = self.get_subscriptions_info_by_topic
        clients = [*task.calls, *task.uses]
        servers_of, clients_of = (
            partial(count_known_servers, self),
            partial(count_known_clients, self),
        )
        return [
            *((f"publisher on {t}", bool(of_others(publishers(str(t))))) for t in task.publishes),
            *((f"subscription to {t}", bool(of_others(subscriptions(str(t)))))
              for t in task.subscribes),
            *((f"{s.kind} {s}", all(map(servers_of, s.services))) for s in task.serves),
            *((f"client of {s}", all(map(clients_of, s.services))) for s in clients),
        ]  # fmt: skip

    def unserved(self, topic: Topic) -> str:
        """Return why a subscription of others on a topic hears nothing; empty if one does."""
        offers = [end.qos_profile for end in self.get_publishers_info_by_topic(str(topic))]
        demands = [
            end.qos_profile for end in of_others(self.get_subscriptions_info_by_topic(str(topic)))
        ]
        refusals = [find_refusal(offer, demand) for offer in offers for demand in demands]
        if refusals and (first := refusals[0]) is not None and all(refusals):
            return (
                f"Its subscription to {topic} demands more than any publisher offers: "
                f"{first.requested}, where {first.offered} is offered."
            )
        return ""
