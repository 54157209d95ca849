"""One of the student's nodes under examination, on simulated time that only the examiner moves.

The examiner moves time in strides, and lets both processes come to rest after each, so that what it
observes does not depend on the load of the machine.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python

from autograder.examination.check_context import CheckContext, Endpoints, StudentError
from autograder.examination.exam import Failed
from autograder.observe.examiner.examiner_end import ExaminerEnd
from autograder.observe.examiner.services import Request
from autograder.observe.nouns import Parameter, Service, Task, Topic
from autograder.observe.patience import Patience
from autograder.observe.phrases import say_words, with_reason
from autograder.observe.span import PACES, Span
from autograder.observe.stillness import Stillness
from course.errors import WaitTimeout

STRIDE_S = 0.1
"""Seconds of the node's time between two looks at what came."""
POLLED_S, MOST_NAPS = 0.05, 2
"""Seconds of wall time, while the node's time stands still, in which a thread that goes to sleep
more often than this polls: it looks at the clock now and then, and sees late that time passed."""
LULL_S, LATE_S = 0.1, 2.0
"""Seconds of wall time in which nothing comes of such a thread, once it has caught up with the
node's time; and those that it may take for that."""


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
        draws: `Draws`, the numbers of this examination, which nobody can know beforehand.
        end: the examiner's end of its topics, services and actions.
    """

    def __init__(self, bench: CheckContext, task: Task, end: ExaminerEnd, still: Stillness) -> None:
        """Make the node in the subject's present session, and find it over DDS.

        Raises:
            StudentError: its class is missing, or its constructor raised.
        """
        self.draws = bench.draws
        self._bench, self._task, self.end, self._still = bench, task, end, still
        self._raised = frozenset(bench.subject.errors())
        self._looked_at = Counter[str]()  # messages of each topic that were in a span
        self._answers: dict[Service, tuple[float, dict[str, Any]]] = {}
        end.forget()
        self.rest()  # by now the answers to an earlier node's requests have been sent
        end.disconnect()
        for service in task.calls:
            end.serve(service)
        self._name = bench.subject.start(task.node)
        if self.wait(lambda: not self._missing()):
            for topic in task.publishes:
                end.listen(topic)
            for topic in task.subscribes:
                end.publisher(topic)
            for served in task.serves:
                end.connect(served)
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
            if why := self.end.unserved(topic):
                raise Failed(expected=expected, actual=why)
        for parameter in self._task.parameters:
            if self.get(parameter) is None:
                raise Failed(
                    expected=expected, actual=f"It has not declared a parameter `{parameter}`."
                )

    def _missing(self) -> list[str]:
        return self.end.missing(self._task)

    def _await_discovery(self) -> None:
        endpoints = {
            "publishers": [str(topic) for topic in self._task.subscribes],
            "subscribers": [
                *(str(topic) for topic in self._task.publishes),
                *(name for served in self._task.serves for name in served.topics),
            ],
            "clients": [name for served in self._task.serves for name in served.services],
            "services": [str(service) for service in self._task.calls],
        }
        self._await_seen(endpoints)
        for served in self._task.serves:
            self.wait(partial(self.end.is_served, served))

    def _await_seen(self, endpoints: Endpoints, *, there: bool = True) -> None:
        """Wait until the node has discovered each endpoint, or the loss of each."""

        def all_seen() -> bool:
            counts = self._bench.subject.sees(self._task.node, endpoints)
            return all(bool(n) is there for kind in counts.values() for n in kind.values())

        self.wait(all_seen)

    # Time.

    @property
    def now_s(self) -> float:
        """The node's time in s."""
        return self.end.now_s

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
        self.rest()  # what was sent has been dealt with before time goes on
        return self._pass(seconds, when, stride_s, PACES[0] if once else 0.0, once=once)

    def _pass(
        self, seconds: float, when: str, stride_s: float, pace: float, *, once: bool = False
    ) -> Span:
        topics = self._task.publishes
        begin = self.end.now_s
        strides = max(1, math.ceil(seconds / stride_s - 1e-9))
        for _ in range(strides):
            self._stride(seconds / strides)
            if pace:
                self._let_wall_time_pass(pace * seconds / strides)
        self._let_late_ones_come()
        came = {
            topic.name: self.end.heard(topic)[self._looked_at[topic.name] :] for topic in topics
        }
        self._looked_at.update({topic.name: len(came[topic.name]) for topic in topics})
        seen = ", ".join(
            f"{topic}: {_abridged([h.value for h in came[topic.name]])}" for topic in topics
        )
        slowly = f" at {pace:g} s of wall time a second" if pace else ""
        self._bench.note_step(f"{seconds:g} s pass{slowly}: {seen or 'nothing is listened to'}")
        return Span(
            when, begin, self.end.now_s, seconds / strides, came,
            None if once else partial(self._pass, seconds, when, min(stride_s, STRIDE_S) / 2),
            self.error_note, self._stands_still,
        )  # fmt: skip

    def advance_until(
        self, condition: Callable[[], Any], seconds: float, *, stride_s: float = STRIDE_S
    ) -> bool:
        """Let the node's time pass until a condition holds, and return whether it does.

        Args:
            condition: looked at before each stride, when both sides are at rest.
            seconds: of the node's time that may pass, at most.
            stride_s: seconds between two looks; coarser ones where it does not matter when exactly
                something happens.

        Raises:
            Failed: a callback held up the node for so long that its clock stood still.
        """
        began_s = self.now_s
        end_s = began_s + seconds
        self.rest()
        while not (holds := bool(condition())) and self.now_s < end_s - STRIDE_S / 2:
            self._stride(min(stride_s, end_s - self.now_s))
        self._bench.note_step(f"{self.now_s - began_s:.3g} of {seconds:.3g} s pass: {self._seen()}")
        return holds

    def _seen(self) -> str:
        """Return what has come and was not forgotten, for the author of the exam."""
        heard = {topic: self.end.values(topic) for topic in self._task.publishes}
        return ", ".join(f"{topic}: {_abridged(came)}" for topic, came in heard.items() if came)

    def _stride(self, seconds: float) -> None:
        self.end.now_s += seconds  # before: what comes on the way bears the stride's end
        self._advance_by(seconds)
        self.rest()
        if self._answer_what_is_due():
            self.rest()

    def forget(self, *topics: Topic) -> None:
        """Forget what has come on topics so far, so that it answers nothing that comes now."""
        for topic in topics:
            self.end.clear(topic)
            self._looked_at[topic.name] = 0

    def _advance_by(self, seconds: float) -> bool:
        """Move the node's time on; return whether some callback has begun, and not ended by now."""
        try:
            return self._bench.subject.advance(seconds)
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
        return self.end.requests(service)

    def _answer_what_is_due(self) -> bool:
        due = [
            (request, fields)
            for service, (seconds, fields) in self._answers.items()
            for request in self.end.requests(service)
            if not request.answered.done() and self.end.now_s >= request.at_s + seconds - 1e-9
        ]
        for request, fields in due:
            request.answer(**fields)
        return bool(due)

    def _let_wall_time_pass(self, seconds: float) -> None:
        with suppress(WaitTimeout):
            self._bench.session.until(lambda: False, timeout=seconds, what="a moment")

    @cached_property
    def _is_polling(self) -> bool:
        """Whether a thread looks at something again and again while time stands still."""
        outside = self._bench.outside
        before = dict(outside.ask("naps", threads=outside.ask("threads")))
        self._let_wall_time_pass(POLLED_S)
        naps = dict(outside.ask("naps", threads=[*before]))
        return any(number - before[thread] > MOST_NAPS for thread, number in naps.items())

    def _let_late_ones_come(self) -> None:
        """Wait, if a thread polls, for what it is late with: that belongs to this span."""
        if not self._is_polling:
            return
        patience = Patience(self._still, LATE_S)
        while patience.seconds_left:
            before = self._count_heard()
            self._let_wall_time_pass(LULL_S)
            if self._count_heard() == before:
                return

    def _count_heard(self) -> int:
        return sum(len(self.end.heard(topic)) for topic in self._task.publishes)

    def _stands_still(self, topic: Topic, seconds: float) -> bool:
        """Return whether nothing comes on a topic while the node's time stands still."""
        self.rest()
        before = len(self.end.heard(topic))
        with suppress(WaitTimeout):
            self._bench.session.until(
                lambda: len(self.end.heard(topic)) > before, timeout=seconds, what="a message"
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

    def call_within(
        self, service: Service, seconds: float, *, expected: str = "", **fields: Any
    ) -> Any:
        """Call a service of the node's, let time pass until it answers, and return the answer.

        Args:
            service: one that it serves.
            seconds: of the node's time that it has, as its callback may wait for something.
            expected: what is needed, a sentence, if that is more than an answer.
            fields: those of the request.

        Raises:
            Failed: no answer comes in time.
        """
        request = service.type.Request(**fields)
        future = self.end.client_of(str(service), service.type).call_async(request)
        self.require_that(
            self.advance_until(future.done, seconds),
            expected or f"{service} answers within {seconds:g} s.",
            "No answer came.",
        )
        self.rest()
        return future.result()

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
        client = self.end.client_of(name, service_type)
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
        self._bench.note_step(f"sent on {topic}: {_abridged([topic.value(message)])}")
        self.end.publisher(topic).publish(message)
        self.rest()

    # Its end, and its errors.

    def destroy(self) -> None:
        """Call the node's ``destroy_node``, as a program does that goes on without it.

        What came before does not count to the span that follows.

        Raises:
            StudentError: it raised.
        """
        self._bench.subject.stop(self._task.node, bare=True)
        self._bench.subject.collect()
        self.rest()
        for topic in self._task.publishes:
            self._looked_at[topic.name] = len(self.end.heard(topic))
        self._bench.note_step("destroy_node() was called")

    def require_gone(self) -> None:
        """Require that no endpoint of the task is left on the graph.

        Raises:
            Failed: one is.
        """
        self.wait(lambda: not any(is_there for _, is_there in self.end.find_ends(self._task)))
        if left := [f"a {what}" for what, is_there in self.end.find_ends(self._task) if is_there]:
            raise Failed(
                expected="After `destroy_node()` nothing of the node is left on the graph.",
                actual=f"There still is {', '.join(left)}.",
            )

    def require_that(self, holds: Any, expected: str, actual: str) -> None:
        """Require what the exam has observed by itself; an error of a callback's is told, too.

        Args:
            holds: whether it is as needed.
            expected: what was needed, a sentence.
            actual: what was seen instead, a sentence.

        Raises:
            Failed: it is not.
        """
        if not holds:
            raise Failed(expected=expected, actual=actual + self.error_note())

    def require_word(self, topic: Topic, word: str, within_s: float, when: str) -> None:
        """Require that one word comes on a topic since it was forgotten, and no other.

        Args:
            topic: one whose value is a text.
            word: what it says.
            within_s: seconds of the node's time that it may take.
            when: what it is about, to begin a sentence with.

        Raises:
            Failed: nothing comes in time, or something else has come, too.
        """
        self.advance_until(lambda: self.end.values(topic), within_s)
        came = self.end.values(topic)
        nothing = f"Within {within_s:.3g} s it said nothing."
        self.require_that(
            came == [word], f"{when}, {topic} says “{word}”, once.", say_words(came, nothing)
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
    task = Task(node, publishes, subscribes, serves, calls, parameters=parameters, threads=threads)

    return lambda bench: closing(Stage(bench, task))


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
