"""A camera driver in a plain program that is ended by SIGINT: what it then has not given back.

The harness asks a student's process to destroy a node, so that process knows when it is looked at.
A program that is interrupted is not asked. Nor is it told what time it is: it has the machine's.

A program takes its time to begin. So what else is to be seen of the notebook's nodes unasked comes
in further lives of it, once it is known that the driver gives back what it takes: starts that fail,
and a managed camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median_low

from autograder.examination.exam import Failed
from autograder.examination.plain_programs import Life, Programs
from autograder.exercises.resources.camera_duties import DRIVER
from autograder.exercises.resources.camera_usage import Usage
from autograder.exercises.resources.managed_life import MANAGED, ManagedLife, watch_managed
from autograder.exercises.resources.program_observer import ProgramObserver
from autograder.exercises.resources.rig import ENDED, PERIOD, CameraRig
from autograder.observe.patience import SETTLE_S
from autograder.observe.phrases import as_phrase

LIVES = 4
TRIED = 3
"""Starts that fail, beside the last of these lives."""
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
    destroy_node() does, if that is not nothing. ``of_starts`` tells of what starts left that failed
    during one more life. ``own_nodes`` is False if the notebook's own cells have left no node
    running between the lives. ``managed`` is what was seen of a managed camera, and
    ``start_raises`` whether the program ended where its driver could not start; None if it did not
    go so far.
    """

    worked: bool = True
    raised: bool = False
    left_open: bool = False
    left_on_graph: bool = False
    usages: tuple[Usage, ...] = ()
    others: str = ""
    pace: str = ""
    harmed: str = ""
    of_starts: str = ""
    own_nodes: bool = True
    managed: ManagedLife | None = None
    start_raises: bool | None = None

    @property
    def went_on(self) -> bool:
        """Whether each life but the last was followed by one."""
        return self.worked and not self.raised

    @property
    def is_clean(self) -> bool:
        """Whether nothing was left of any of them."""
        left = self.left_open or self.left_on_graph or self.of_starts
        return self.went_on and not left and not (self.usages and _list_leaks(self.kept_per_life()))

    def kept_per_life(self) -> Usage:
        """Return what a life leaves behind: the median, as something else may come or go once.

        For memory it is the minimum: the first life also warms up, by more on a busy machine, and
        failed starts happen during the last one.
        """
        grown = [after.growth_since(before) for before, after in pairwise(self.usages)]
        threads, files, memory = zip(*grown, strict=True)
        return Usage(median_low(threads), median_low(files), min(memory))


def require_pace(rig: CameraRig) -> None:
    """Fail unless a driver takes ten pictures a second where nobody but the machine tells time."""
    if (lives := seen_lives(rig)) is not None and lives.pace:
        raise Failed(
            expected="When the driver runs in a program of its own, it takes ten pictures a second "
            "by the machine's clock.",
            actual=lives.pace,
        )


def require_no_harm_at_the_end(rig: CameraRig) -> None:
    """Fail unless a driver may be destroyed twice at Ctrl-C."""
    if (lives := seen_lives(rig)) is not None and lives.harmed:
        raise _make_failure("destroy_node() can be called a second time.", lives.harmed)


def require_off_graph_at_the_end(rig: CameraRig) -> None:
    """Fail unless a driver's endpoints go at Ctrl-C."""
    if (lives := seen_lives(rig)) is not None and lives.left_on_graph:
        raise _make_failure("nothing of it is on the graph.", "Its publisher or service still was.")


def require_closed_at_the_end(rig: CameraRig) -> None:
    """Fail unless a driver closes its camera at Ctrl-C."""
    if (lives := seen_lives(rig)) is None:
        return
    if not lives.worked:
        raise _make_failure("it takes pictures.", "It took none.")
    if lives.raised:
        raise _make_failure(
            "its destroy_node() returns.", "The program was gone: an exception left it, or an exit."
        )
    if lives.left_open:
        raise _make_failure("its destroy_node() closes the camera.", "It was still open.")


def require_nothing_kept_at_the_end(rig: CameraRig) -> None:
    """Fail if each life of a driver leaves a thread, a file or memory in the program."""
    lives = seen_lives(rig)
    if lives is None or len(lives.usages) < LIVES:
        return
    if left := _list_leaks(lives.kept_per_life()):
        raise _make_failure(
            "it leaves no thread and no file behind, and less than 1 MiB.",
            f"Each of its lives left {as_phrase(left)} behind.{lives.others}",
        )


def _list_leaks(kept: Usage) -> list[str]:
    left = ["a thread"] if kept.threads > 0 else []
    left += ["an open file"] if kept.files > 0 else []
    left += [f"{kept.memory // 1024} MiB of memory"] if kept.memory >= MEMORY else []
    return left


def seen_lives(rig: CameraRig) -> Lives | None:
    """Return what was seen, once a notebook; None where there are no such programs."""
    if rig.programs is not None and Lives.__name__ not in rig.memory:
        rig.memory[Lives.__name__] = _watch_twice(rig, rig.programs)
    return lives_so_far(rig)


def lives_so_far(rig: CameraRig) -> Lives | None:
    """Return what was seen; None where nobody has looked: the driver does not even work."""
    found = rig.memory.get(Lives.__name__)
    assert found is None or isinstance(found, Lives)
    return found


def _watch_twice(rig: CameraRig, programs: Programs) -> Lives:
    """Watch a driver that is destroyed twice at first, and if it does not go on after that, once.

    Only then it is known which of the two calls it was.
    """
    twice = _watch_program(rig, programs, twice=True)
    if twice.went_on:
        return twice
    once = _watch_program(rig, programs, twice=False)
    if not once.went_on:
        return once
    harm = "the program was gone" if twice.raised else "the driver did not start again"
    return replace(once, harmed=f"After the second call {harm}.")


def _watch_program(rig: CameraRig, programs: Programs, *, twice: bool) -> Lives:
    device, stuck = rig.new_device(), rig.new_device("stuck")
    driver = [(DRIVER, [device])]
    then = [
        *[Life(driver)] * (LIVES - 2),
        Life(driver, tried=[(DRIVER, [stuck])] * TRIED),
        Life([(MANAGED, [])]),
        Life([(DRIVER, [rig.new_device("unplugged")])]),
    ]
    with programs.program(driver, then=then, twice=twice) as program:
        seen = ProgramObserver(rig, program)
        lives = _watch_lives(seen, device)
        if len(lives.usages) == LIVES - 1:
            lives = _watch_last_life(seen, lives, device, stuck)
        return _watch_others(seen, lives) if lives.is_clean else lives


def _watch_lives(seen: ProgramObserver, device: str) -> Lives:
    """Watch all lives but the last, or as many as go on."""
    lives = Lives()
    for life in range(LIVES - 1):
        if life > 0:
            seen.program.interrupt()
        lives = _begin_life(seen, lives, device)
        if not lives.went_on:
            return lives
        lives = _end_life(seen, lives, device)
        if not lives.went_on or lives.left_open or lives.left_on_graph:
            return lives
        usage = _settled_usage(seen, lives.usages)
        lives = replace(lives, usages=(*lives.usages, usage), others=seen.rig.process_note())
    return lives


def _begin_life(seen: ProgramObserver, lives: Lives, device: str) -> Lives:
    # A picture is asked for by a timer or a thread, once the nodes spin.
    if not seen.program.up or not (
        seen.wait(lambda: any(seen.rig.open_cameras(device))) or seen.is_gone()
    ):
        return replace(lives, worked=False)
    if seen.is_gone():
        return replace(lives, raised=True)
    seen.wait(seen.is_working)
    return lives


def _end_life(seen: ProgramObserver, lives: Lives, device: str) -> Lives:
    seen.program.interrupt()
    closed = seen.wait(lambda: not seen.rig.open_cameras(device))
    off_graph = seen.wait(lambda: not seen.is_working())
    if seen.is_gone():
        return replace(lives, raised=True)
    return replace(lives, left_open=not closed, left_on_graph=not off_graph)


def _watch_last_life(seen: ProgramObserver, lives: Lives, device: str, stuck: str) -> Lives:
    """Watch the life that has failed starts beside it; what the first has left had time to go.

    What the driver itself leaves is known by then, so what is more is left by them: nothing is said
    of it where each of its own lives leaves something.
    """
    rig, before, nodes = seen.rig, seen.rig.process.read_usage(), len(seen.find_nodes())
    came = len(seen.node.pictures_of(device))
    seen.program.interrupt()
    # Its pictures come when the starts are over, each of which may take its second.
    if not seen.wait(lambda: len(seen.node.pictures_of(device)) > came, SETTLE_S + TRIED * ENDED):
        if seen.is_gone():
            return replace(lives, raised=True)
        return replace(lives, pace="None came once others had failed to start.")
    lives = replace(lives, pace=seen.pace_fault(device, 1 / PERIOD))
    last = _end_life(seen, lives, device)
    if last.raised:
        return last
    usage = _settled_usage(seen, lives.usages)
    lives = replace(lives, usages=(*lives.usages, usage), others=rig.process_note())
    if _is_freed_late(seen, lives):
        lives = replace(lives, usages=())
    if not lives.is_clean:
        return lives
    open_ = last.left_open or not rig.wait_for_end(
        lambda: not rig.open_cameras(stuck), seen.session
    )
    left = ["a camera open"] if open_ else []
    left += ["an endpoint on the graph"] if last.left_on_graph else []
    if not left and not seen.wait_for_end(lambda: len(seen.find_nodes()) <= nodes):
        left = ["a node on the graph"]

    def kept() -> list[str]:
        threads, files, memory = rig.process.read_usage().growth_since(before)
        # Most of them: threads come and go. The life itself may keep as much memory as a start.
        most = TRIED // 2 + 1
        return _list_leaks(Usage(threads // most, files // most, memory // (TRIED + 1)))

    if not left and not rig.wait_for_end(lambda: not kept(), seen.session):
        left = kept()
    return replace(
        lives, of_starts=f"They left {as_phrase(left)}.{rig.process_note()}" if left else ""
    )


def _watch_others(seen: ProgramObserver, lives: Lives) -> Lives:
    """Watch a managed camera in the program of drivers that gave everything back."""
    own = {*seen.find_nodes()}
    lives = replace(lives, own_nodes=bool(own))
    seen.program.interrupt()
    managed = watch_managed(seen, own=own)
    if not managed.is_clean:
        return replace(lives, managed=managed)
    seen.program.interrupt()
    return replace(lives, managed=managed, start_raises=seen.wait(seen.is_gone))


def _settled_usage(seen: ProgramObserver, before: Sequence[Usage]) -> Usage:
    """Return what the program holds, once no more goes that the task gives a second to go.

    Where a life has left something once, each may: that is waited for at the end of them.
    """
    rig = seen.rig
    rig.wait_for_rest()  # its node may be off the graph, and its last threads and files go just now

    def gone() -> bool:
        # Memory alone is not waited for: a thread that ends gives it back, or nobody.
        return not _list_leaks(rig.process.read_usage().growth_since(before[-1])._replace(memory=0))

    if len(before) == 1 or (before and not _list_leaks(before[-1].growth_since(before[-2]))):
        rig.wait_for_end(gone, seen.session)
    return rig.process.read_usage()


def _is_freed_late(seen: ProgramObserver, lives: Lives) -> bool:
    """Whether what each of these lives has left behind goes by itself, if late.

    A thread that looks every few seconds whether it is to end is too slow, and no leak. One that
    does not sleep for a time does not wake up by itself.
    """
    rig, first = seen.rig, lives.usages[0]
    if not _list_leaks(lives.kept_per_life()) or not (wakes := rig.process.wake_times()):
        return False

    def a_life() -> Usage:
        return Usage(
            *(more // (LIVES - 1) for more in rig.process.read_usage().growth_since(first))
        )

    return seen.wait(lambda: not _list_leaks(a_life()), min(SETTLE_S, max(wakes) + ENDED))


def _make_failure(expected: str, actual: str) -> Failed:
    return Failed(expected=f"{WHEN} {expected}", actual=actual)
