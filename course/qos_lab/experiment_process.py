"""One experiment: ``python -m course.qos_lab.experiment_process`` reads JSON, writes the outcome.

The reader lives here, the writer in a process of its own. With ``--link`` both are in a network
namespace of which this process is the root.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.context import Context
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from std_msgs.msg import UInt32

from course.qos_lab import link, private_stdout
from course.qos_lab.experiment import COUNT, RATE_HZ, Experiment, ExperimentOutcome
from course.qos_lab.rules import is_reliable
from course.qos_lab.writer import TOPIC

MATCH_TIMEOUT_S = 8.0
ACK_TIMEOUT_S = 15.0  # lost messages are repaired at heartbeats, every 3 s by default
END = 4_000_000_000
"""The number of a last message that is not counted: what comes before it has come."""


class ReceiveGate(MutuallyExclusiveCallbackGroup):
    """A callback group that leaves messages in their queue as long as it is closed.

    Events pass: a closed reader still learns that it is connected.
    """

    def __init__(self) -> None:
        """Be open."""
        super().__init__()
        self.closed = False

    def can_execute(self, entity: Any) -> bool:
        """Whether ``entity`` may run now."""
        held = self.closed and isinstance(entity, Subscription)
        return not held and super().can_execute(entity)


class Reader:
    """The reader's side: a subscription that is spun when it is asked to."""

    def __init__(
        self, context: Context, experiment: Experiment, outcome: ExperimentOutcome
    ) -> None:
        """Subscribe as requested; what arrives is entered into ``outcome``."""
        self._outcome = outcome
        self._executor = SingleThreadedExecutor(context=context)
        self._node = Node(
            "reader", context=context, enable_rosout=False, start_parameter_services=False
        )
        self.ended = False
        self.gate = ReceiveGate()
        events = SubscriptionEventCallbacks(
            incompatible_qos=self._on_incompatible, deadline=self._on_deadline,
            liveliness=self._on_liveliness, matched=self._on_matched, use_default_callbacks=False,
        )  # fmt: skip
        take: Any = self._take_message  # rclpy's annotation does not know of the second argument
        self._subscription = self._node.create_subscription(
            UInt32, TOPIC, take, experiment.requested.to_rclpy(), callback_group=self.gate,
            event_callbacks=events,
        )  # fmt: skip
        self._executor.add_node(self._node)

    def spin_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Run callbacks until ``condition`` holds; return whether it did within ``timeout`` s."""
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                return False
            self._executor.spin_once(timeout_sec=0.02)
        return True

    def drain(self) -> None:
        """Run callbacks until nothing is left to do."""
        count = -1
        while count != len(self._outcome.received):
            count = len(self._outcome.received)
            for _ in range(5):
                self._executor.spin_once(timeout_sec=0.02)

    @property
    def is_decided(self) -> bool:
        """Whether DDS has connected the two, or said why not."""
        return self._outcome.connected or bool(self._outcome.broken)

    def _take_message(self, message: UInt32, info: dict[str, int]) -> None:
        if message.data == END:
            self.ended = True
            return
        self._outcome.received.append(message.data)
        late = (info["received_timestamp"] - info["source_timestamp"]) / 1e6
        self._outcome.latency_ms.append(round(late, 3))

    def _on_matched(self, event: Any) -> None:
        self._outcome.connected = self._outcome.connected or event.current_count > 0

    def _on_incompatible(self, event: Any) -> None:
        self._outcome.broken = qos_policy_name_from_kind(event.last_policy_kind)

    def _on_deadline(self, event: Any) -> None:
        self._outcome.deadlines_missed = event.total_count

    def _on_liveliness(self, event: Any) -> None:
        if event.not_alive_count:
            self._outcome.liveliness_lost = True


class ExperimentWriter:
    """The writer's process."""

    def __init__(self) -> None:
        """Start it."""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "course.qos_lab.writer"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip

    def carry_out(self, verb: str, value: Any) -> Any:
        """Have a line carried out; return the answer."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps({verb: value}) + "\n")
        self._process.stdin.flush()
        reply = self._process.stdout.readline()
        if not reply:
            raise RuntimeError(f"the writer ended when it was asked to {verb}")
        return json.loads(reply)

    def do_beside(self, verb: str, value: Any) -> Callable[[], bool]:
        """Have a line carried out while the reader goes on; the result says whether it is done."""
        thread = threading.Thread(target=self.carry_out, args=(verb, value))
        thread.start()
        return lambda: not thread.is_alive()

    def end(self) -> None:
        """Let the process end."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class RunningExperiment:
    """Carries one experiment out."""

    def __init__(self, experiment: Experiment, *, lossy: bool) -> None:
        """Prepare ``experiment``; ``lossy`` says that the link can drop packets."""
        self._experiment = experiment
        self._outcome = ExperimentOutcome(lossy=lossy and experiment.drop_percent > 0)
        self._context = Context()
        rclpy.init(args=[], context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._writer = ExperimentWriter()

    def run(self) -> ExperimentOutcome:
        """Run it and return what was seen."""
        self._writer.carry_out("offer", vars(self._experiment.offered))
        {
            "stream": self._run_stream, "late joiner": self._late_joiner,
            "slow reader": self._run_slow,
            "deadline": self._run_deadline, "liveliness": self._run_liveliness,
        }[self._experiment.scenario]()  # fmt: skip
        self._writer.end()
        self._context.try_shutdown()
        return self._outcome

    def _connect_reader(self, *, closed: bool = False) -> Reader | None:
        reader = Reader(self._context, self._experiment, self._outcome)
        reader.gate.closed = closed
        reader.spin_until(lambda: reader.is_decided, MATCH_TIMEOUT_S)
        if not self._outcome.connected:
            return None
        self._writer.carry_out("matched", MATCH_TIMEOUT_S)
        return reader

    def _run_stream(self) -> None:
        if reader := self._connect_reader():
            self._set_loss(self._experiment.loss)
            self._publish_messages(reader)
            self._set_loss(0)
            self._collect_rest(reader)

    def _late_joiner(self) -> None:
        self._writer.carry_out("publish", (0, COUNT, RATE_HZ * 4))
        self._outcome.sent = COUNT
        # What is sent again comes in several packets. A reader that took the first message between
        # two of them would have room for one more, now and then.
        if reader := self._connect_reader(closed=True):
            if is_reliable(self._experiment):
                self._writer.carry_out("acked", ACK_TIMEOUT_S)
            reader.gate.closed = False
            self._collect_rest(reader)

    def _run_slow(self) -> None:
        if reader := self._connect_reader():
            witness = self._start_witness()
            self._set_loss(self._experiment.loss)
            self._writer.carry_out("publish", (0, COUNT, RATE_HZ * 4))
            self._outcome.sent = COUNT
            self._set_loss(0)
            if is_reliable(self._experiment):
                self._writer.carry_out("acked", ACK_TIMEOUT_S)
            witness()
            reader.drain()

    def _run_deadline(self) -> None:
        if reader := self._connect_reader():
            self._publish_messages(reader, COUNT // 2)
            longest = self._experiment.requested.deadline or self._experiment.offered.deadline
            done = self._writer.do_beside("pause", 3 * longest or 0.3)
            reader.spin_until(done, 200.0)
            self._publish_messages(reader, COUNT - COUNT // 2, first=COUNT // 2)
            self._collect_rest(reader)

    def _run_liveliness(self) -> None:
        if reader := self._connect_reader():
            self._publish_messages(reader)
            self._collect_rest(reader)
            lease = self._experiment.requested.lease or self._experiment.offered.lease
            reader.spin_until(lambda: self._outcome.liveliness_lost, 3 * lease or 0.3)

    def _publish_messages(self, reader: Reader, count: int = COUNT, first: int = 0) -> None:
        """Publish one message after the other, and let the reader look after each.

        So its queue is never long because the machine is busy: only the slow reader is slow.
        """
        for number in range(first, first + count):
            have = len(self._outcome.received)
            self._writer.carry_out("publish", (number, 1, RATE_HZ))
            reader.spin_until(lambda have=have: len(self._outcome.received) > have, 1 / RATE_HZ)  # type: ignore[misc]
        self._outcome.sent += count

    def _collect_rest(self, reader: Reader) -> None:
        """Take what is still on its way, until it is certain that nothing more will come."""
        if is_reliable(self._experiment):
            done = self._writer.do_beside("acked", ACK_TIMEOUT_S)
            reader.spin_until(done, ACK_TIMEOUT_S + 1)
        else:
            # Nothing is repaired, and a message that is sent later comes later.
            self._writer.carry_out("publish", (END, 1, RATE_HZ))
            reader.spin_until(lambda: reader.ended, 2.0)
        reader.drain()

    def _start_witness(self) -> Callable[[], None]:
        """Return a function that waits until the last message has reached this process.

        Another subscription of the same participant gets each message with the reader's, which
        must not look into its queue yet.
        """
        executor = SingleThreadedExecutor(context=self._context)
        node = Node(
            "witness", context=self._context, enable_rosout=False, start_parameter_services=False
        )
        seen: list[int] = []
        qos = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT)

        def see(message: Any) -> None:
            seen.append(message.data)

        subscription = node.create_subscription(UInt32, TOPIC, see, qos)
        executor.add_node(node)

        def spin(condition: Callable[[], bool], timeout: float) -> None:
            end = time.monotonic() + timeout
            while not condition() and time.monotonic() < end:
                executor.spin_once(timeout_sec=0.02)

        spin(lambda: subscription.get_publisher_count() > 0, MATCH_TIMEOUT_S)
        return lambda: spin(lambda: COUNT - 1 in seen, 2.0)

    def _set_loss(self, percent: int) -> None:
        if self._outcome.lossy:
            link.set_loss(percent)


def main() -> None:
    """Run the process."""
    answer = private_stdout.claim_stdout()
    lossy = "--link" in sys.argv
    if lossy:
        link.bring_up()
    experiment = Experiment.from_json(sys.stdin.readline())
    answer(RunningExperiment(experiment, lossy=lossy).run().to_json())


if __name__ == "__main__":
    main()
