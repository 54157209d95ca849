"""The experiment of many lives: does the process grow with every driver that is started and ended?

One life proves little: a thread may still be ending, a library fills its caches, a notebook has
threads of its own. What grows with each of 50 lives, in both halves of them, is a leak.
"""

from __future__ import annotations

from autograder.bench import StudentError
from autograder.exam import Failed
from autograder.rigs.camera import CameraRig
from autograder.rigs.process import Usage

DRIVER = "CameraDriver"
WARM_UP, LIVES = 5, 25
MEMORY = 100  # KiB a life
WORDS = {"threads": "threads", "files": "open files"}
PICTURES = 0.5  # s of simulated time that a life lasts: five pictures of 64 KiB


def live(rig: CameraRig, lives: int) -> None:
    """Start and end the driver ``lives`` times, then collect what is garbage."""
    device = rig.device()
    for _ in range(lives):
        rig.start(DRIVER, device)
        rig.advance(PICTURES)
        rig.stop(DRIVER)
        # A thread of the driver may close the camera a moment later.
        rig.wait(lambda: not rig.cameras(device))
    rig.subject.collect()


def growth(rig: CameraRig) -> Usage:
    """Return what the process has grown by in 25 lives: the lesser of two times, item by item."""
    live(rig, WARM_UP)
    halves = []
    for _ in range(2):
        before = rig.process.usage()
        live(rig, LIVES)
        rig.wait(lambda since=before: not leaks(rig.process.usage().grown(since)))  # type: ignore[misc]
        halves.append(rig.process.usage().grown(before))
    first, second = halves
    return Usage(
        min(first.threads, second.threads),
        min(first.files, second.files),
        min(first.memory, second.memory),
    )


def leaks(grown: Usage) -> list[str]:
    """Return what ``grown`` says that 25 lives leaked, a phrase each."""
    found = []
    if grown.threads >= LIVES / 2:
        found.append(f"{_each(grown.threads)} of its threads")
    if grown.files >= LIVES / 2:
        found.append(f"{_each(grown.files)} of its open files")
    if grown.memory >= LIVES * MEMORY:
        found.append(f"{grown.memory // LIVES} KiB of memory")
    return found


def _each(grown: int) -> str:
    return {1: "one", 2: "two"}.get(round(grown / LIVES), "some")


def failing_starts(rig: CameraRig, kind: str, times: int) -> None:
    """Fail unless the constructor raises, and the process keeps none of its threads and files."""
    before = rig.process.usage()
    for _ in range(times):
        attempt(rig, rig.device(kind))
    rig.subject.collect()
    # Half of them: a notebook has threads of its own, which come and go.
    for what in ("threads", "files"):

        def grown(what: str = what) -> int:
            return int(getattr(rig.process.usage().grown(before), what))

        if not rig.wait(lambda grown=grown: grown() < times / 2):  # type: ignore[misc]
            raise Failed(
                expected="A driver that cannot start leaves nothing behind, no thread and no file.",
                actual=f"After {times} such starts the process had {grown()} more {WORDS[what]} "
                "than before.",
            )


def attempt(rig: CameraRig, device: str) -> None:
    """Start the driver on a ``device`` that has something wrong with it, as bare rclpy would."""
    try:
        rig.subject.start(DRIVER, device, bare=True)
    except StudentError:
        return
    rig.stop(DRIVER)
    raise Failed(
        expected=f"{DRIVER}({device!r}) raises: who starts a driver must learn that it has no "
        "picture to give.",
        actual="It made a node as if all were well.",
    )
