"""The requests that are answered for an examiner, each by a small function: see `REQUESTS`.

An examiner parses what a stranger sends. So what it asks for is data with bounds, too: numbers, and
the name of a file to be compared with; never a path, nor the text of a rule.
"""

from __future__ import annotations

import subprocess
import time
from bisect import bisect_right
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Any

from autograder.processes.fair_deadline import SeenDelay
from autograder.processes.outside import process_usage
from autograder.processes.outside.holding import HeldThreads, hold_threads
from autograder.processes.outside.kernel_stillness import HANGS_S, KernelStillness
from autograder.processes.outside.sleeping import Code, Sleeper, find_sleepers
from autograder.processes.process_folders import Processes, Sandboxed
from course.util import executables

MOST_NUMBERS, LONGEST_NAME = 2000, 200
MOST_PORTS = 32
SAMPLE_S = 0.05
"""Seconds between two notes of how long the subject was kept waiting."""
MOST_SAMPLES = 20_000
TABLE = "inet ros2_course_radio"

Given = Mapping[str, Any]


class RequestError(Exception):
    """A request that is none, or cannot be answered; the message says why."""


class CannotLoseError(Exception):
    """The network cannot be made to lose packets; the message may say why."""


class Scene:
    """What requests are about: the processes of one submission and those of its examiner."""

    def __init__(self, subject: Processes, pid: int, examiner: Processes) -> None:
        """Look at these; ``pid`` is the subject's own process, by its number for itself."""
        self.subject, self.pid, self.examiner = subject, pid, examiner
        self.still = KernelStillness(subject, examiner)
        self.hold = ExitStack()
        self.held: HeldThreads | None = None
        self.code: Code = {}
        self._delay = SeenDelay(subject, pid)
        self._moments, self._marks = [time.monotonic()], [self._delay.mark()]

    def note_delay(self) -> None:
        """Note now and then for how long the subject was kept waiting by now."""
        if time.monotonic() >= self._moments[-1] + SAMPLE_S:
            if len(self._moments) >= MOST_SAMPLES:
                del self._moments[: MOST_SAMPLES // 2], self._marks[: MOST_SAMPLES // 2]
            self._moments.append(time.monotonic())
            self._marks.append(self._delay.mark())

    def kept_since(self, moment: float) -> float:
        """Return for how many s it was kept since a moment, or since the last note before it."""
        place = max(0, bisect_right(self._moments, moment) - 1)
        return self._delay.delay_since(self._marks[place])


def answer_request(scene: Scene, what: str, given: Given) -> Any:
    """Return the answer to a request, as JSON knows it.

    Raises:
        RequestError: it is none.
        CannotLoseError: this machine cannot make a network lose packets.
        HoldError: this machine does not let threads be held.
    """
    known = REQUESTS.get(what) if isinstance(what, str) else None
    if known is None:
        raise RequestError("there is no such request")
    scene.note_delay()
    return known(scene, given)


def _watch(scene: Scene, given: Given) -> None:
    scene.still = KernelStillness(scene.subject, scene.examiner)


def _rest(scene: Scene, given: Given) -> bool:
    restless, timeout = (_require_seconds(given, name) for name in ("restless", "timeout"))
    return scene.still.wait_for_rest(restless, timeout)


def _asleep(scene: Scene, given: Given) -> bool:
    return scene.still.all_asleep()


def _threads(scene: Scene, given: Given) -> list[int]:
    # Only its own threads: a session's given-up ones, for example, are never in a child.
    return process_usage.thread_ids(scene.subject.folder_of(scene.pid))


def _naps(scene: Scene, given: Given) -> list[tuple[int, int]]:
    return [
        *process_usage.count_naps(
            scene.subject, _require_numbers(given, "threads", MOST_NUMBERS)
        ).items()
    ]


def _sleepers(scene: Scene, given: Given) -> list[Sleeper]:
    threads = _require_numbers(given, "threads", MOST_NUMBERS)
    return find_sleepers(scene.subject.folder_of(scene.pid), threads, scene.code)


def _usage(scene: Scene, given: Given) -> process_usage.Usage:
    return process_usage.measure_usage(scene.subject)


def _positions(scene: Scene, given: Given) -> list[int]:
    name = given.get("file")
    if not isinstance(name, str) or len(name) > LONGEST_NAME or "/" in name:
        raise RequestError("a file needs a name")
    return process_usage.file_positions(scene.subject, name)


def _others(scene: Scene, given: Given) -> list[str]:
    return process_usage.process_names(scene.subject, scene.pid)


def _kept(scene: Scene, given: Given) -> float:
    return scene.kept_since(_require_number(given, "since"))


def _hold(scene: Scene, given: Given) -> int:
    """Hold the subject's threads until "release"; return how many there are."""
    if not isinstance(scene.subject, Sandboxed):
        raise RequestError("who is not in a sandbox cannot be held")
    scene.hold.close()
    scene.held = scene.hold.enter_context(hold_threads(scene.subject.outer_pids))
    return scene.held.threads


def _release(scene: Scene, given: Given) -> bool:
    """Let them go on; return whether DDS could not receive meanwhile (`HeldThreads.is_jammed`)."""
    jams = scene.held is not None and scene.held.is_jammed()
    scene.held = None
    scene.hold.close()
    return jams


def _lose(scene: Scene, given: Given) -> None:
    """Drop all that is sent to some UDP ports of the submission's network."""
    ports = _require_numbers(given, "ports", MOST_PORTS)
    if not ports or not all(0 < port < 2**16 for port in ports):
        raise RequestError("these are no ports")
    _run_nft(
        f"add table {TABLE}",
        f"add chain {TABLE} air {{ type filter hook input priority 0; policy accept; }}",
        f"add rule {TABLE} air udp dport {{ {', '.join(map(str, ports))} }} drop",
    )


def _deliver(scene: Scene, given: Given) -> None:
    _run_nft(f"delete table {TABLE}")


REQUESTS: Mapping[str, Callable[[Scene, Given], Any]] = {
    "watch": _watch,
    "rest": _rest,
    "asleep": _asleep,
    "threads": _threads,
    "naps": _naps,
    "sleepers": _sleepers,
    "usage": _usage,
    "positions": _positions,
    "others": _others,
    "kept": _kept,
    "hold": _hold,
    "release": _release,
    "lose": _lose,
    "deliver": _deliver,
}
"""What can be asked for."""


def _run_nft(*commands: str) -> None:
    tool = executables.find_tool("nft")
    if tool is None:
        raise CannotLoseError("nftables is not installed")
    rules = "\n".join(commands).encode()
    ran = subprocess.run([tool, "-f", "-"], input=rules, capture_output=True, check=False)
    if ran.returncode:
        said = ran.stderr.decode(errors="replace").strip().splitlines()
        raise CannotLoseError(f"nft: {said[0]}" if said else "")


def _require_number(given: Given, name: str) -> float:
    found = given.get(name)
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise RequestError(f"{name} is no number")
    try:
        return float(found)
    except OverflowError:
        raise RequestError(f"{name} is too large") from None


def _require_seconds(given: Given, name: str) -> float:
    seconds = _require_number(given, name)
    if not 0 <= seconds <= 10 * HANGS_S:
        raise RequestError(f"{name} is too long or too short")
    return seconds


def _require_numbers(given: Given, name: str, most: int) -> list[int]:
    found = given.get(name)
    if not isinstance(found, list) or len(found) > most:
        raise RequestError(f"{name} is no list, or a long one")
    if not all(isinstance(n, int) and not isinstance(n, bool) and 0 <= n < 2**31 for n in found):
        raise RequestError(f"{name} has something else than numbers in it")
    return found
