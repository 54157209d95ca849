"""A camera driver in a plain program that is ended by SIGINT: what it then has not given back.

The harness asks a student's process to destroy a node, so that process knows when it is looked at.
A program that is interrupted is not asked. Nor is it told what time it is: it has the machine's.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median_low
from typing import Any

from autograder.examination.exam import Failed
from autograder.examination.plain_programs import Program, Programs
from autograder.exercises.resources.camera_duties import DRIVER
from autograder.exercises.resources.examiner_node import IMAGE, SNAPSHOT, ExaminerNode
from autograder.exercises.resources.process_usage import Usage
from autograder.exercises.resources.rig import ENDED, PERIOD, CameraRig
from autograder.observe.patience import SETTLE_S, Patience
from autograder.observe.phrases import capitalized, phrase, pictures
from autograder.observe.stillness import Stillness
from autograder.processes.fair_deadline import FairDeadline

LIVES = 4
COUNTED = 8
"""Pictures whose rate is taken, in about as many tenths of a second."""
SLOWEST, FASTEST = 0.6 / PERIOD, 1.6 / PERIOD
"""Pictures a second that are taken for ten: a busy machine is no fault of a driver's."""
TAKES = 3
"""Of a rate, as pictures that have been held up come many at a time."""
MEMORY = 1024  # KiB a life: nobody has Python collect what is garbage
WHEN = "When the driver runs in a program of its own, which is ended by Ctrl-C,"


@dataclass(frozen=True)
class Lives:
    """What was seen of a driver's lives in a plain program.

    ``worked`` is whether it took pictures in each, ``raised`` whether its end was that of the
    program; ``left_open`` and ``left_on_graph`` are what it had not given back after one, and
    ``usages`` what the program held after each, unless what came with them went
    later; ``others`` tells of processes that were left then.
    ``pace`` tells of pictures that do not come ten times a second, ``harmed`` of what a second
    destroy_node() does, if that is not nothing.
    """

    worked: bool = True
    raised: bool = False
    left_open: bool = False
    left_on_graph: bool = False
    usages: tuple[Usage, ...] = ()
    others: str = ""
    pace: str = ""
    harmed: str = ""

    @property
    def went_on(self) -> bool:
        """Whether each life but the last was followed by one."""
        return self.worked and not self.raised

    def kept(self) -> Usage:
        """Return what a life leaves behind: the median, as something else may come or go once."""
        grown = [after.grown(before) for before, after in pairwise(self.usages)]
        return Usage(*map(median_low, zip(*grown, strict=True)))


def require_pace(rig: CameraRig) -> None:
    """Fail unless a driver takes ten pictures a second where nobody but the machine tells time."""
    if (lives := _lives(rig)) is not None and lives.pace:
        raise Failed(
            expected="When the driver runs in a program of its own, it takes ten pictures a second "
            "by the machine's clock.",
            actual=lives.pace,
        )


def require_no_harm_at_the_end(rig: CameraRig) -> None:
    """Fail unless a driver may be destroyed twice at Ctrl-C."""
    if (lives := _lives(rig)) is not None and lives.harmed:
        raise _failed("destroy_node() can be called a second time.", lives.harmed)


def require_off_graph_at_the_end(rig: CameraRig) -> None:
    """Fail unless a driver's endpoints go at Ctrl-C."""
    if (lives := _lives(rig)) is not None and lives.left_on_graph:
        raise _failed("nothing of it is on the graph.", "Its publisher or service still was.")


def require_closed_at_the_end(rig: CameraRig) -> None:
    """Fail unless a driver closes its camera at Ctrl-C."""
    if (lives := _lives(rig)) is None:
        return
    if not lives.worked:
        raise _failed("it takes pictures.", "It took none.")
    if lives.raised:
        raise _failed(
            "its destroy_node() returns.", "The program was gone: an exception left it, or an exit."
        )
    if lives.left_open:
        raise _failed("its destroy_node() closes the camera.", "It was still open.")


def require_nothing_kept_at_the_end(rig: CameraRig) -> None:
    """Fail if each life of a driver leaves a thread, a file or memory in the program."""
    lives = _lives(rig)
    if lives is None or len(lives.usages) < LIVES:
        return
    if left := _leaks(lives.kept()):
        raise _failed(
            "it leaves no thread and no file behind, and less than 1 MiB.",
            f"Each of its lives left {phrase(left)} behind.{lives.others}",
        )


def _leaks(kept: Usage) -> list[str]:
    left = ["a thread"] if kept.threads > 0 else []
    left += ["an open file"] if kept.files > 0 else []
    left += [f"{kept.memory // 1024} MiB of memory"] if kept.memory >= MEMORY else []
    return left


def _lives(rig: CameraRig) -> Lives | None:
    """Return what was seen, once a notebook; None where there are no such programs."""
    if rig.programs is None:
        return None
    if Lives.__name__ not in rig.memory:
        rig.memory[Lives.__name__] = _watch_twice(rig, rig.programs)
    found = rig.memory[Lives.__name__]
    assert isinstance(found, Lives)
    return found


def _watch_twice(rig: CameraRig, programs: Programs) -> Lives:
    """Watch a driver that is destroyed twice at first, and if it does not go on after that, once.

    Only then it is known which of the two calls it was.
    """
    twice = _watch(rig, programs, twice=True)
    if twice.went_on:
        return twice
    once = _watch(rig, programs, twice=False)
    if not once.went_on:
        return once
    harm = "the program was gone" if twice.raised else "the driver did not start again"
    return replace(once, harmed=f"After the second call {harm}.")


def _watch(rig: CameraRig, programs: Programs, *, twice: bool) -> Lives:
    device = rig.device()
    with programs.program([(DRIVER, [device])], twice=twice) as program:
        watcher = program.session.run(ExaminerNode)
        assert isinstance(watcher, ExaminerNode)
        return _watch_lives(rig, program, watcher, device)


def _watch_lives(rig: CameraRig, program: Program, watcher: ExaminerNode, device: str) -> Lives:
    def on_graph() -> bool:
        return bool(watcher.count_publishers(IMAGE) or watcher.count_services(SNAPSHOT))

    still = Stillness(rig.outside)

    def comes(condition: Callable[[], Any]) -> bool:
        return Patience(still).wait(program.session, condition)

    lives = Lives()
    for life in range(LIVES):
        # A picture is asked for by a timer or a thread, once the nodes spin.
        if not program.up or not comes(lambda: any(rig.cameras(device)) or program.ended()):
            return replace(lives, worked=False)
        if program.ended():
            return replace(lives, raised=True)
        comes(on_graph)
        if life == LIVES - 1:  # so what the first has left has a second more to go by itself
            comes(lambda: watcher.of(device))
            lives = replace(lives, pace=_pace(rig, program, watcher, device))
        program.interrupt()
        closed = comes(lambda: not rig.cameras(device))
        off_graph = comes(lambda: not on_graph())
        if program.ended():
            return replace(lives, raised=True)
        if not closed or not off_graph:
            return replace(lives, left_open=not closed, left_on_graph=not off_graph)
        usage = _usage(rig, program, lives.usages)
        lives = replace(lives, usages=(*lives.usages, usage), others=rig.others())
        if life == LIVES - 1 and _goes(rig, program, lives):
            lives = replace(lives, usages=())
        program.interrupt()
    return lives


def _pace(rig: CameraRig, program: Program, watcher: ExaminerNode, device: str) -> str:
    """Return how many pictures come in what time, unless that is about ten a second."""

    def came() -> int:
        return len(watcher.of(device))

    for _ in range(TAKES):
        begun, before = time.monotonic(), came()
        deadline = FairDeadline(COUNTED / SLOWEST, rig.outside.delay)
        while (left := deadline.left) and came() < before + COUNTED:
            program.wait(lambda most=before + COUNTED: came() >= most, left)  # type: ignore[misc]
        number, seconds = came() - before, time.monotonic() - begun
        if number >= COUNTED and number <= seconds * FASTEST:
            return ""
    return f"{capitalized(pictures(number))} came in {seconds:.1f} s."


def _usage(rig: CameraRig, program: Program, before: Sequence[Usage]) -> Usage:
    """Return what the program holds, once no more goes that the task gives a second to go.

    Where a life has left something once, each may: that is waited for at the end of them.
    """
    if len(before) == 1 or (before and not _leaks(before[-1].grown(before[-2]))):
        last = before[-1]
        rig.ends(lambda: not _leaks(rig.process.usage().grown(last)), program.session)
    return rig.process.usage()


def _goes(rig: CameraRig, program: Program, lives: Lives) -> bool:
    """Whether what each of these lives has left behind goes by itself, if late.

    A thread that looks every few seconds whether it is to end is too slow, and no leak. One that
    does not sleep for a time does not wake up by itself.
    """
    first = lives.usages[0]
    if not _leaks(lives.kept()) or not (wakes := rig.process.wakes()):
        return False

    def a_life() -> Usage:
        return Usage(*(more // (LIVES - 1) for more in rig.process.usage().grown(first)))

    return program.wait(lambda: not _leaks(a_life()), min(SETTLE_S, max(wakes) + ENDED))


def _failed(expected: str, actual: str) -> Failed:
    return Failed(expected=f"{WHEN} {expected}", actual=actual)
