"""The warden of one submission: answers its examiner, who is in a sandbox, from outside of it.

Started as ``python -P -m autograder.processes.outside.warden --examiner FD`` in the submission's
network. The engine tells over standard input whom it is about, in one line of JSON: the first
processes of both sandboxes, ``{"subject": ..., "examiner": ...}``, the subject's own process,
``"pid"``, and those that hold its sandbox, ``"ours"``, both by their numbers in it. ``FD`` is the
channel to the examiner, whose every line is a request (see `warden_requests`). It ends with either.
"""

from __future__ import annotations

import argparse
import json
import socket
import sys
from collections.abc import Sequence
from typing import Any

from autograder.processes.channel import Channel, ChannelClosed
from autograder.processes.descriptors import readable_descriptors
from autograder.processes.outside import warden_requests
from autograder.processes.outside.holding import HoldError
from autograder.processes.outside.warden_requests import CannotLoseError, RequestError, Scene
from autograder.processes.process_folders import Sandboxed

MAX_REQUEST_BYTES = 64 * 1024
"""Bytes of the longest request."""


def serve_requests(engine: int, examiner: Channel) -> None:
    """Answer requests until engine or examiner has gone."""
    scene: Scene | None = None
    while True:
        ready = readable_descriptors([engine, examiner], None)
        if engine in ready:
            with open(engine, encoding="utf-8", closefd=False) as lines:
                line = lines.readline()
            if not line:
                return
            scene = _make_scene(json.loads(line))
        elif examiner.fileno() in ready:
            request = examiner.receive()
            examiner.send(_answer_request(scene, request))


def _make_scene(told: dict[str, Any]) -> Scene | None:
    try:
        subject, examiner = Sandboxed(told["subject"], told["ours"]), Sandboxed(told["examiner"])
        return Scene(subject, told["pid"], examiner)
    except OSError:
        return None  # one of them has ended


def _answer_request(scene: Scene | None, request: dict[str, Any]) -> dict[str, Any]:
    what = request.pop("what", "")
    if scene is None:
        return {"error": "there is nobody to look at"}
    try:
        return {"answer": warden_requests.answer_request(scene, what, request)}
    except RequestError as error:
        return {"error": str(error)}
    except CannotLoseError as error:
        return {"cannot": str(error)}
    except HoldError as error:
        return {"no_hold": str(error)}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the process; returns its exit code."""
    parser = argparse.ArgumentParser(prog="autograder.processes.outside.warden")
    parser.add_argument(
        "--examiner", type=int, required=True, help="file descriptor to be asked on"
    )
    options = parser.parse_args(arguments)
    try:
        serve_requests(0, Channel(socket.socket(fileno=options.examiner), MAX_REQUEST_BYTES))
    except ChannelClosed:
        return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
