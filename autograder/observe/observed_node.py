"""One of the student's nodes under examination, on simulated time that only the examiner moves.

The examiner moves time in strides, and lets both processes come to rest after each, so that what it
observes does not depend on the load of the machine.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python

from autograder.examination.check_context import CheckContext, StudentError
from autograder.examination.exam import Failed
from autograder.observe.examiner_end import ExaminerEnd, Request
from autograder.observe.nouns import Parameter, Service, Topic
from autograder.observe.participants import of_others
from autograder.observe.patience import Patience
from autograder.observe.phrases import with_reason
from autograder.observe.span import PACES, Span
from autograder.observe.stillness import Stillness
from course.errors import WaitTimeout

STRIDE_S = 0.1
"""Seconds of the node's time between two looks at what came."""


@dataclass(frozen=True)
class Task:
    """What the node of a task is connected to.

    Attributes:
        node: the name of its class in the notebook.
        publishes: topics that it publishes on.
        subscribes: topics that it listens to.
        serves: its services.
        calls: services that it is a client of, which the examiner plays.
        parameters: those that it declares.
        threads: how many run its callbacks.
    """

    node: str
    publishes: Sequence[Topic] = ()
    subscribes: Sequence[Topic] = ()
    serves: Sequence[Service] = ()
    calls: Sequence[Service] = ()
    parameters: Sequence[Parameter] = ()
    threads: int = 1


@dataclass(frozen=True)
class Change:
    """What became of a wish to set a parameter: see `ObservedNode.set`."""

    parameter: Parameter
    value: Any
    accepted: bool
    reason: str
    present: Any
    before: Any

    def require_accepted(self) -> None:
        """Require that the parameter has the value now.

        Raises:
            Failed: it was refused, or the parameter has another value all the same.
        """
        wanted = f"The parameter `{self.parameter}` can be set to {self.value!r}."
        if not self.accepted:
            raise Failed(expected=wanted, actual=f"It was refused, {with_reason(self.reason)}.")
        if not _is_same(self.present, self.value):
            raise Failed(expected=wanted, actual=f"It said yes, and is {self.present!r} now.")

    def require_refused(self, *, with_a_reason: bool = True) -> None:
        """Require that it was refused, and that the parameter has the value that it had.

        Raises:
            Failed: it was accepted, or changed all the same, or no reason was given.
        """
        wanted = f"The parameter `{self.parameter}` cannot be set to {self.value!r}"
        if self.accepted:
            raise Failed(expected=f"{wanted}.", actual=f"It can: it is {self.present!r} now.")
        if not _is_same(self.present, self.before):
            raise Failed(
                expected=f"{wanted}, and stays {self.before!r}.",
                actual=f"It was refused, and is {self.present!r} now.",
            )
        if with_a_reason and not self.reason.strip():
            raise Failed(
                expected=f"{wanted}, and the node says why: `reason` of its result.",
                actual="It was refused without a reason.",
            )


class ObservedNode:
    """One of the student's nodes at work: looks at it, asks it, and moves its time.

    Attributes:
        draws: the numbers of this examination, which nobody can know beforehand.
    """

    def __init__(self, bench: CheckContext, task: Task, end: ExaminerEnd, still: Stillness) -> None:
        """Make the node in the subject's present session, and find it over DDS.

        Raises:
            StudentError: its class is missing, or its constructor raised.
        """
        self.draws = bench.draws
        self._bench, self._task, self._end, self._still = bench, task, end, still
        self._raised = frozenset(bench.subject.errors())
        self._looked_at = Counter[str]()  # messages of each topic that were in a span
        self._answers: dict[Service, tuple[float, dict[str, Any]]] = {}
        end.forget()
        for service in task.calls:
            end.serve(service)
        self._name = bench.subject.start(task.node)
        if self.wait(lambda: not self._missing()):
            for topic in task.publishes:
                end.listen(topic)
            for topic in task.subscribes:
                end.publisher(topic)
            for service in task.serves:
                end.client_of(str(service), service.type)
            self._await_discovery()
        self.rest()

    # What it has.

    def require_endpoints(self) -> None:
        """Require that the node has every topic, service and parameter of its task.

        Raises:
            Failed: one is missing, or cannot be connected to.
        """
        expected = f"{self._task.node} has every endpoint of the task right after it was made."
        if missing := self._missing():
            raise Failed(
                expected=expected, actual=f"There is {', '.join(missing)}.{self.error_note()}"
            )
        for topic in self._task.subscribes:
            if why := self._end.unserved(topic):
                raise Failed(expected=expected, actual=why)
        for parameter in self._task.parameters:
            if self.get(parameter) is None:
                raise Failed(
                    expected=expected, actual=f"It has not declared a parameter `{parameter}`."
                )

    def _missing(self) -> list[str]:
        return [f"no {what}" for what, is_there in self._ends() if not is_there]

    def _ends(self) -> list[tuple[str, bool]]:
        """Return each end that the task wants, in words, and whether it is on the graph."""
        task, end = self._task, self._end
        publishers, subscriptions = (
            end.get_publishers_info_by_topic,
            end.get_subscriptions_info_by_topic,
        )
        return [
            *((f"publisher on {t}", bool(of_others(publishers(str(t))))) for t in task.publishes),
            *(
                (f"subscription to {t}", bool(of_others(subscriptions(str(t)))))
                for t in task.subscribes
            ),
            *((f"service {s}", bool(end.count_services(str(s)))) for s in task.serves),
            *((f"client of {s}", bool(end.count_clients(str(s)))) for s in task.calls),
        ]

    def _await_discovery(self) -> None:
        endpoints = {
            "publishers": [str(topic) for topic in self._task.subscribes],
            "subscribers": [str(topic) for topic in self._task.publishes],
            "clients": [str(service) for service in self._task.serves],
            "services": [str(service) for service in self._task.calls],
        }

        def all_seen() -> bool:
            counts = self._bench.subject.sees(self._task.node, endpoints)
            return all(number for kind in counts.values() for number in kind.values())

        self.wait(all_seen)
        for service in self._task.serves:
            self.wait(self._end.client_of(str(service), service.type).service_is_ready)

    # Time.

    @property
    def now_s(self) -> float:
        """The node's time in s."""
        return self._end.now_s

    def advance(
        self, seconds: float, when: str = "", *, once: bool = False, stride_s: float = STRIDE_S
    ) -> Span:
        """Let so much of the node's time pass, and return what came since time last passed.

        Args:
            seconds: of the node's time.
            when: what this span is in words, to begin a sentence with: "After a pause".
            once: it cannot be repeated, as what was set off is over then: time passes slowly at
                once, and a rate that is not right is not taken again.
            stride_s: seconds between two looks; when a message came is known to one.

        Raises:
            Failed: a callback held up the node for so long that its clock stood still.
        """
        return self._pass(seconds, when, stride_s, PACES[0] if once else 0.0, once=once)

    def _pass(
        self, seconds: float, when: str, stride_s: float, pace: float, *, once: bool = False
    ) -> Span:
        topics = self._task.publishes
        begin = self._end.now_s
        strides = max(1, math.ceil(seconds / stride_s - 1e-9))
        for _ in range(strides):
            self._end.now_s += seconds / strides  # before: what comes bears the stride's end
            self._advance_by(seconds / strides)
            self.rest()
            if self._answer_what_is_due():
                self.rest()
            if pace:
                self._let_wall_time_pass(pace * seconds / strides)
        came = {
            topic.name: self._end.heard(topic)[self._looked_at[topic.name] :] for topic in topics
        }
        self._looked_at.update({topic.name: len(came[topic.name]) for topic in topics})
        seen = ", ".join(
            f"{topic}: {_abridged([h.value for h in came[topic.name]])}" for topic in topics
        )
        slowly = f" at {pace:g} s of wall time a second" if pace else ""
        self._bench.note_step(f"{seconds:g} s pass{slowly}: {seen or 'nothing is listened to'}")
        return Span(
            when, begin, self._end.now_s, seconds / strides, came,
            None if once else partial(self._pass, seconds, when, min(stride_s, STRIDE_S) / 2),
            self.error_note, self._stands_still,
        )  # fmt: skip

    def _advance_by(self, seconds: float) -> None:
        try:
            self._bench.subject.advance(seconds)
        except StudentError:
            waits = self._bench.subject.wall_waits()
            where = f" One waits in {waits[0].rstrip('.')}." if waits else ""
            raise Failed(
                expected=f"No callback of {self._task.node} stops the node's clock, which the node "
                "hears in its default callback group.",
                actual="A callback held up the node so that even its clock stood still."
                + where
                + self.error_note(),
            ) from None

    def answer_after(self, service: Service, seconds: float, **fields: Any) -> None:
        """Have requests to a service that the examiner plays answered after so much of its time.

        Args:
            service: one of ``calls``.
            seconds: of the node's time, from a request to its answer.
            fields: those of the answer.
        """
        self._answers[service] = seconds, fields

    def requests(self, service: Service) -> list[Request]:
        """Return the requests that the node has sent to a service which the examiner plays."""
        return self._end.requests(service)

    def _answer_what_is_due(self) -> bool:
        due = [
            (request, fields)
            for service, (seconds, fields) in self._answers.items()
            for request in self._end.requests(service)
            if not request.answered.done() and self._end.now_s >= request.at_s + seconds - 1e-9
        ]
        for request, fields in due:
            request.answer(**fields)
        return bool(due)

    def _let_wall_time_pass(self, seconds: float) -> None:
        with suppress(WaitTimeout):
            self._bench.session.until(lambda: False, timeout=seconds, what="a moment")

    def _stands_still(self, topic: Topic, seconds: float) -> bool:
        """Return whether nothing comes on a topic while the node's time stands still."""
        self.rest()
        before = len(self._end.heard(topic))
        with suppress(WaitTimeout):
            self._bench.session.until(
                lambda: len(self._end.heard(topic)) > before, timeout=seconds, what="a message"
            )
            return False
        return True

    def rest(self) -> None:
        """Return when all that was sent has been dealt with, on both sides."""
        self._still.wait_for_rest()

    def wait(self, condition: Callable[[], Any]) -> bool:
        """Wait for something of DDS's own, while the node's time stands still; return if it came.

        How long is a matter of `Patience`: little, once nobody is at work on it.
        """
        return Patience(self._still).wait(self._bench.session, condition)

    # Parameters and services.

    def get(self, parameter: Parameter) -> Any:
        """Return the value of a parameter, or None if the node has not declared it.

        Raises:
            Failed: the node does not answer.
        """
        request = GetParameters.Request(names=[parameter.name])
        reply = self._ask("get_parameters", GetParameters, request)
        if not reply.values or reply.values[0].type == ParameterType.PARAMETER_NOT_SET:
            return None
        return parameter_value_to_python(reply.values[0])

    def require(self, parameter: Parameter, value: Any) -> None:
        """Require that a parameter has a value.

        Raises:
            Failed: it has another one.
        """
        if not _is_same(present := self.get(parameter), value):
            raise Failed(
                expected=f"The parameter `{parameter}` is {value!r}.",
                actual=f"It is {present!r}."
                if present is not None
                else "The node has not declared it.",
            )

    def describe(self, parameter: Parameter) -> ParameterDescriptor:
        """Return the descriptor of a parameter, as ``ros2 param describe`` shows it.

        Raises:
            Failed: the node does not answer.
        """
        request = DescribeParameters.Request(names=[parameter.name])
        reply = self._ask("describe_parameters", DescribeParameters, request)
        return reply.descriptors[0] if reply.descriptors else ParameterDescriptor()

    def require_described(self, parameter: Parameter) -> None:
        """Require that the node says what a parameter is for.

        Raises:
            Failed: its description is empty.
        """
        if not self.describe(parameter).description.strip():
            raise Failed(
                expected=f"The parameter `{parameter}` has a description, which "
                f"`ros2 param describe` shows.",
                actual="Its description is empty.",
            )

    def set(self, parameter: Parameter, value: Any) -> Change:
        """Ask the node to set a parameter, as ``ros2 param set`` does, and return what it says.

        Raises:
            Failed: the node does not answer.
        """
        before = self.get(parameter)
        message = RosParameter(parameter.name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[message])
        reply = self._ask("set_parameters", SetParameters, request)
        (result,) = reply.results or [None]
        made = Change(
            parameter, value, bool(result and result.successful),
            str(result.reason) if result else "", self.get(parameter), before,
        )  # fmt: skip
        said = "accepted" if made.accepted else f"refused, {with_reason(made.reason)}"
        self._bench.note_step(f"{parameter} set to {value!r}: {said}; it is {made.present!r} now")
        return made

    def call(self, service: Service, **fields: Any) -> Any:
        """Call a service of the node's while its time stands still, and return the answer.

        Args:
            service: one that it serves.
            fields: those of the request.

        Raises:
            Failed: no answer comes.
        """
        reply = self._call(str(service), service.type, service.type.Request(**fields))
        self._bench.note_step(f"{service} called with {fields}: {reply}")
        return reply

    def require_success(self, service: Service, **fields: Any) -> Any:
        """Call a service whose answer says whether it succeeded, and require that it did.

        Args:
            service: one whose response has ``success`` and ``message``.
            fields: those of the request.

        Raises:
            Failed: no answer comes, or it says no.
        """
        reply = self.call(service, **fields)
        if not reply.success:
            asked = ", ".join(f"{name}={value!r}" for name, value in fields.items())
            raise Failed(
                expected=f"{service} succeeds when it is called with {asked or 'nothing'}.",
                actual=f"It answered success=False, {with_reason(reply.message)}.",
            )
        return reply

    def _ask(self, what: str, service_type: Any, request: Any) -> Any:
        return self._call(f"{self._name}/{what}", service_type, request)

    def _call(self, name: str, service_type: Any, request: Any) -> Any:
        client = self._end.client_of(name, service_type)
        expected = f"The service {name} answers, also while the node has other work."
        if not self.wait(client.service_is_ready):
            raise Failed(expected=expected, actual=f"There is no service {name}.")
        future = client.call_async(request)
        if not self.wait(future.done):
            future.cancel()
            raise Failed(expected=expected, actual=f"No answer came.{self.error_note()}")
        self.rest()
        return future.result()

    def send(self, topic: Topic, message: Any) -> None:
        """Publish a message on a topic that the node listens to, and let it deal with it."""
        self._end.publisher(topic).publish(message)
        self.rest()

    # Its end, and its errors.

    def destroy(self) -> None:
        """Call the node's ``destroy_node``, as a program does that goes on without it.

        Raises:
            StudentError: it raised.
        """
        self._bench.subject.stop(self._task.node, bare=True)
        self._bench.subject.collect()
        self._bench.note_step("destroy_node() was called")

    def require_gone(self) -> None:
        """Require that no endpoint of the task is left on the graph.

        Raises:
            Failed: one is.
        """
        self.wait(lambda: not any(is_there for _, is_there in self._ends()))
        if left := [f"a {what}" for what, is_there in self._ends() if is_there]:
            raise Failed(
                expected="After `destroy_node()` nothing of the node is left on the graph.",
                actual=f"There still is {', '.join(left)}.",
            )

    def error_note(self) -> str:
        """Return what a callback raised since the node was made, as a sentence to add."""
        raised = [e for e in self._bench.subject.errors() if e not in self._raised]
        return f" A callback raised an error, in {raised[-1].rstrip('.')}." if raised else ""


class Stage:
    """Gives each check of an exam a fresh node of the student's, in a fresh session."""

    def __init__(self, bench: CheckContext, task: Task) -> None:
        """Bring up the examiner's end; the student's node comes with each check."""
        bench.session.participate()
        self._bench, self._task = bench, task
        end = bench.session.run(ExaminerEnd)
        assert isinstance(end, ExaminerEnd)
        self._end, self._still = end, Stillness(bench.outside)

    @contextmanager
    def for_check(self) -> Iterator[ObservedNode]:
        """Make a node for the length of a check, in a session whose time begins at 0.

        In one where time has gone on a constructor would find the clock at 0, and a thread that it
        starts would have to catch up.

        Raises:
            StudentError: it cannot be made.
        """
        self._bench.subject.open(threads=self._task.threads, sim_time=True)
        self._end.now_s = 0.0
        yield ObservedNode(self._bench, self._task, self._end, self._still)

    def close(self) -> None:
        """Take the examiner's end down."""
        self._bench.session.stop(self._end)


def one_node(
    node: str,
    *,
    publishes: Sequence[Topic] = (),
    subscribes: Sequence[Topic] = (),
    serves: Sequence[Service] = (),
    calls: Sequence[Service] = (),
    parameters: Sequence[Parameter] = (),
    threads: int = 1,
) -> Callable[[CheckContext], Any]:
    """Return what an `Exam` of one node takes: each check gets a fresh `ObservedNode`.

    Args:
        node: the name of the class in the notebook.
        publishes: topics that it publishes on.
        subscribes: topics that it listens to.
        serves: its services.
        calls: services that it is a client of, which the examiner plays.
        parameters: those that it declares.
        threads: how many run its callbacks.

    Example:
        >>> from std_msgs.msg import String
        >>> from autograder.examination.exam import Exam
        >>> exam = Exam("talker", one_node("Talker", publishes=[Topic("chatter", String)]))
    """
    task = Task(node, publishes, subscribes, serves, calls, parameters, threads)

    @contextmanager
    def stage(bench: CheckContext) -> Iterator[Stage]:
        made = Stage(bench, task)
        try:
            yield made
        finally:
            made.close()

    return stage


def _abridged(values: Sequence[Any]) -> str:
    """Return what came on a topic, its middle left out if it is much."""
    texts = [f"{value!r}"[:60] for value in values]
    if len(texts) > 8:
        texts[4:-3] = [f"… {len(texts) - 7} more …"]
    return ", ".join(texts) or "nothing"


def _is_same(present: Any, value: Any) -> bool:
    if isinstance(value, float) and isinstance(present, float):
        return math.isclose(present, value, rel_tol=1e-9, abs_tol=1e-12)
    return type(present) is type(value) and bool(present == value)
