"""What is no answer to what was asked is never the grader's fault."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import pytest

from autograder.examination.check_context import (
    MAX_ERROR,
    MAX_NOTES,
    MAX_REPLY_BYTES,
    StudentError,
    Subject,
    SubjectGone,
)
from autograder.processes.channel import Channel

Say = Callable[..., None]


@pytest.fixture
def ends() -> Iterator[tuple[Subject, Say]]:
    """Give the examiner's end, and what says things in a harness's place."""
    ours, theirs = socket.socketpair()
    channel = Channel(ours, MAX_REPLY_BYTES)

    def send(text: bytes) -> None:
        with suppress(OSError):  # nobody reads all of what is too long
            theirs.sendall(text)

    def say(reply: Any) -> None:
        text = json.dumps(reply).encode() + b"\n"
        threading.Thread(target=send, args=(text,), daemon=True).start()

    yield Subject(channel), say
    channel.close()
    theirs.close()


ASKED: list[tuple[Callable[[Subject], Any], dict[str, Any]]] = [
    (lambda s: s.start("A"), {}),
    (lambda s: s.start("A"), {"node": ["/a"]}),
    (lambda s: s.start_all("A"), {}),
    (lambda s: s.start_all("A"), {"labels": 5}),
    (lambda s: s.start_all("A"), {"labels": [["a"]]}),
    (lambda s: s.value("A"), {}),
    (lambda s: s.sees("A", {"services": ["/s"]}), {"counts": {"services": {}}}),
    (lambda s: s.sees("A", {"services": ["/s"]}), {"counts": {"services": {"/s": float("inf")}}}),
    (lambda s: s.wall_waits(), {"waits": None}),
    (lambda s: s.errors(), {}),
    (lambda s: s.thread_errors(), {"of_threads": {"a": 1}}),
    (lambda s: s.own_errors(), {"errors": [{"told": "x"}]}),
    (lambda s: s.own_errors(), {"errors": {"a": 1}}),
    (lambda s: s.collect(), {"ok": False}),
    (lambda s: s.collect(), {"ok": False, "error": {"a": 1}}),
    (lambda s: s.collect(), {"missing": 5}),
]


@pytest.mark.parametrize(("ask", "reply"), ASKED)
def test_a_reply_of_another_kind_ends_the_examination(
    ends: tuple[Subject, Say], ask: Callable[[Subject], Any], reply: dict[str, Any]
) -> None:
    subject, say = ends
    say({"ok": True, **reply})
    with pytest.raises(SubjectGone, match="wrote to the grader's own channel"):
        ask(subject)
    with pytest.raises(SubjectGone, match="wrote to the grader's own channel"):
        subject.collect()


def test_a_reply_of_any_size_ends_the_examination(ends: tuple[Subject, Say]) -> None:
    subject, say = ends
    say({"ok": False, "error": "x" * 2 * MAX_REPLY_BYTES})
    with pytest.raises(SubjectGone, match="more than 524288 bytes"):
        subject.collect()


def test_what_is_told_is_cut(ends: tuple[Subject, Say]) -> None:
    subject, say = ends
    say({"ok": False, "error": "x" * 100_000, "trace": "y" * 100_000})
    with pytest.raises(StudentError) as raised:
        subject.collect()
    assert (len(str(raised.value)), len(raised.value.trace)) == (MAX_ERROR, 4000)
    say({"ok": True, "errors": ["x" * 10_000] * 30})
    assert [len(error) for error in subject.errors()] == [MAX_ERROR] * 30
    say({"ok": True, "waits": ["x"] * 1000})
    assert len(subject.wall_waits()) == MAX_NOTES
