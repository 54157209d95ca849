"""A wait may be interrupted anywhere: that is all that comes of it, and nothing stays behind."""

from __future__ import annotations

import dis
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

import pytest

import course.runtime.executor.gate
import course.runtime.waiting
from course.runtime.executor.gate import Gate
from course.runtime.waiting import Pulse

FILES = {course.runtime.executor.gate.__file__, course.runtime.waiting.__file__, threading.__file__}
PATIENCE = 30.0
INTERRUPTIBLE = ("RESUME", "CALL", "JUMP_BACKWARD", "POP_JUMP_BACKWARD")


class Interrupting:
    """Does something at one of the steps, in the files above, after which Python takes signals."""

    def __init__(self, step: int, act: Callable[[], None]) -> None:
        self.left = step
        self.act = act
        self.last: dict[FrameType, str] = {}

    def __enter__(self) -> Interrupting:
        sys.settrace(self.trace)
        return self

    def __exit__(self, *_: object) -> None:
        sys.settrace(None)

    def trace(self, frame: FrameType, event: str, argument: Any) -> Any:
        if frame.f_code.co_filename not in FILES:
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        if event == "opcode":
            if self.last.get(frame, "").startswith(INTERRUPTIBLE):
                self.left -= 1
                if self.left == -1:
                    self.act()
            self.last[frame] = dis.opname[frame.f_code.co_code[frame.f_lasti]]
        return self.trace


def interrupt() -> None:
    raise KeyboardInterrupt


def interrupted(call: Callable[[], object]) -> Iterator[None]:
    """Interrupt `call` at its first step, then at its second, and so on until it ends untouched."""
    for step in range(10_000):
        with Interrupting(step, interrupt) as interrupting:
            try:
                call()
            except KeyboardInterrupt:
                yield
        if interrupting.left >= 0:
            assert step > 5
            return
    pytest.fail("The call has no end.")


def test_a_wait_is_interrupted_anywhere_and_the_next_one_works() -> None:
    pulse = Pulse()
    for _ in interrupted(lambda: pulse.wait(pulse.count, 0.001)):
        seen = pulse.count
        threading.Timer(0.001, pulse.beat).start()
        pulse.wait(seen, PATIENCE)
        assert pulse.count != seen
        assert not pulse._waiting


def test_a_gate_that_an_interrupt_left_is_open() -> None:
    gate = Gate(lambda: None)

    def hold() -> None:
        with gate.hold_closed():
            gate.wait(0.001)

    for _ in interrupted(hold):
        assert not gate._holders
        gate.enter()
        gate.leave()


def test_a_beat_from_a_signal_handler_ends_the_wait() -> None:
    """The handler runs in the thread that waits, between two steps of what it does there."""
    for step in range(1000):
        pulse, ended = Pulse(), threading.Event()
        interrupting = Interrupting(step, pulse.beat)

        def wait(pulse: Pulse, within: Interrupting, ended: threading.Event) -> None:
            with within:
                pulse.wait(0)
            ended.set()

        threading.Thread(target=wait, args=(pulse, interrupting, ended), daemon=True).start()
        if not ended.wait(PATIENCE / 6):
            assert interrupting.left >= 0  # it waits, and the step is one that comes afterwards
            pulse.beat()
            assert ended.wait(PATIENCE)
            break
    assert step > 1


def test_the_shortest_wait_ends_however_busy_other_threads_are() -> None:
    pulse, over = Pulse(), threading.Event()

    def burn() -> None:
        while not over.is_set():
            pass

    def wait() -> None:
        for _ in range(300):
            pulse.wait(0, 1e-6)

    others = [threading.Thread(target=burn, daemon=True) for _ in range(4)]
    waiter = threading.Thread(target=wait, daemon=True)
    for thread in [*others, waiter]:
        thread.start()
    waiter.join(2 * PATIENCE)
    over.set()
    assert not waiter.is_alive()
