"""The control channel: bounded, deadlined, JSON only."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator

import pytest

from autograder.processes.channel import MAX_LINE_BYTES, Channel, ChannelClosed, ChannelTimeout


@pytest.fixture
def ends() -> Iterator[tuple[Channel, socket.socket]]:
    ours, theirs = socket.socketpair()
    channel = Channel(ours)
    yield channel, theirs
    channel.close()
    theirs.close()


def test_messages_arrive_whole_and_in_order(ends: tuple[Channel, socket.socket]) -> None:
    channel, theirs = ends
    theirs.sendall(b'{"op": "start"}\n{"op": ')
    theirs.sendall('"späť"}\n'.encode())
    assert channel.receive(5) == {"op": "start"}
    assert channel.receive(5) == {"op": "späť"}


def test_silence_ends_at_the_deadline(ends: tuple[Channel, socket.socket]) -> None:
    channel, _ = ends
    with pytest.raises(ChannelTimeout):
        channel.receive(0.01)


def test_a_closed_end_is_noticed(ends: tuple[Channel, socket.socket]) -> None:
    channel, theirs = ends
    theirs.close()
    with pytest.raises(ChannelClosed):
        channel.receive(5)
    with pytest.raises(ChannelClosed):
        channel.send({"op": "start"})


@pytest.mark.parametrize("line", [b"not json\n", b"[1, 2]\n", b'"text"\n', b"[" * 100_000 + b"\n"])
def test_what_is_no_json_object_closes_the_channel(
    ends: tuple[Channel, socket.socket], line: bytes
) -> None:
    channel, theirs = ends
    theirs.sendall(line)
    with pytest.raises(ChannelClosed):
        channel.receive(5)


@pytest.mark.parametrize("half", [b"\\uD83D", b"\\udc00", b"\xed\xa0\x80"])
def test_half_a_surrogate_pair_never_arrives(
    ends: tuple[Channel, socket.socket], half: bytes
) -> None:
    channel, theirs = ends
    theirs.sendall(b'{"' + half + b'": ["' + half + b'"], "whole": "\\ud83d\\ude00"}\n')
    if half[:1] == b"\xed":
        with pytest.raises(ChannelClosed, match="not JSON"):
            channel.receive(5)
    else:
        assert channel.receive(5) == {"?": ["?"], "whole": "\U0001f600"}


def test_an_endless_line_is_refused(ends: tuple[Channel, socket.socket]) -> None:
    channel, theirs = ends
    flood = threading.Thread(
        target=theirs.sendall, args=(b"x" * (MAX_LINE_BYTES + 70_000),), daemon=True
    )
    flood.start()
    with pytest.raises(ChannelClosed, match="more than"):
        channel.receive(30)


def test_leftovers_that_come_in_drops_do_not_come_for_ever(
    ends: tuple[Channel, socket.socket],
) -> None:
    channel, theirs = ends
    enough = threading.Event()

    def drip() -> None:
        for _ in range(200):
            theirs.sendall(b"x")
            if enough.wait(0.1):
                return

    dripping = threading.Thread(target=drip, daemon=True)
    dripping.start()
    try:
        assert 0 < len(channel.read_leftovers(1, 0.5)) < 100
    finally:
        enough.set()
        dripping.join()
