"""A camera driver in a plain program: its pace, what it leaves at Ctrl-C, and starts that fail.

A program takes its time to begin. So starts that fail are tried in further lives of the same one,
once it is known that the driver gives back what it takes.
"""

from __future__ import annotations

from autograder.examination.plain_programs import Life, Programs
from autograder.exercises.resources.camera_program import GONE, KEPT_KIB, CameraProgram
from autograder.exercises.resources.rig import DRIVER, RATE_HZ, CameraRig, new_device
from autograder.observe.lifecycle.observer import ENDED_S
from autograder.observe.lifecycle.process_holdings import Usage, list_kept
from autograder.observe.patience import SETTLE_S
from autograder.observe.phrases import as_phrase
from autograder.observe.programs.program_observer import Faults, require_no_fault

LIVES = 4
TRIED = 3
"""Starts that fail, beside the last of these lives."""
ALONE = "When the driver runs in a program of its own,"
ENDED = f"{ALONE} which is ended by Ctrl-C,"
OPEN, ON_GRAPH = "a camera open", "an endpoint on the graph"
LEFT = {
    OPEN: ("camera_given_back", "its destroy_node() closes the camera.", "It was still open."),
    ON_GRAPH: (
        "endpoints_gone",
        "nothing of it is on the graph.",
        "Its publisher or service still was.",
    ),
}
"""What may be left of a driver: the check in which it counts, what is needed, and what was seen."""


def require_driver_in_program(rig: CameraRig, check: str) -> None:
    """Fail if a driver in a plain program has shown something against a check."""

    def watch_driver(programs: Programs) -> Faults:
        # Destroyed twice at first; if it does not go on then, once: which of the calls was it?
        twice = _watch_program(rig, programs, twice=True)
        if not twice.stopped:
            return twice.faults
        once = _watch_program(rig, programs, twice=False)
        if not once.stopped:
            once.note_fault(
                "cleanup_twice",
                f"{ENDED} destroy_node() can be called a second time.",
                f"After the second call {twice.stopped}.",
            )
        return once.faults

    require_no_fault(rig, check, watch_driver)


def _watch_program(rig: CameraRig, programs: Programs, *, twice: bool) -> DriverWatch:
    device, stuck = new_device(), new_device("stuck")
    driver = [(DRIVER, [device])]
    then = [
        *[Life(driver)] * (LIVES - 2),
        Life(driver, tried=[(DRIVER, [stuck])] * TRIED),
        Life([(DRIVER, [new_device("unplugged")])]),
    ]
    with programs.program(driver, then=then, twice=twice) as program:
        seen = DriverWatch(rig, program, device)
        seen.watch_lives()
        if len(seen.usages) == LIVES - 1:
            seen.watch_last_life(stuck)
        return seen


class DriverWatch(CameraProgram):
    """Watches a driver: ``stopped`` tells why a life was not followed by one, if that was so."""

    stopped = ""

    def watch_lives(self) -> None:
        """Watch all lives but the last, or as many as give back what they take."""
        for life in range(LIVES - 1):
            if life > 0:
                self.program.interrupt()
            # A picture is asked for by a timer or a thread, once the nodes spin.
            began = self.program.up and self.wait(lambda: any(self.asked()))
            if not began or self.is_gone():
                self._stop()
                return
            self.wait(self.is_on_graph)
            for left in self._end_life():
                check, expected, actual = LEFT[left]
                self.note_fault(check, f"{ENDED} {expected}", actual)
            if self.faults:
                return
            self.note_usage()

    def _stop(self) -> None:
        """Note that there is no further life, because the program has gone or takes no picture."""
        gone = self.program.up and self.is_gone()
        self.stopped = "the program was gone" if gone else "the driver did not start again"
        expected = "its destroy_node() returns." if gone else "it takes pictures."
        self.note_fault(
            "camera_given_back", f"{ENDED} {expected}", GONE if gone else "It took none."
        )

    def _end_life(self) -> list[str]:
        """Interrupt the program; return what it has not given back then."""
        self.program.interrupt()
        left = [] if self.wait(lambda: not self.asked()) else [OPEN]
        left += [] if self.wait(lambda: not self.is_on_graph()) else [ON_GRAPH]
        if self.is_gone():
            self._stop()
        return left

    def watch_last_life(self, stuck: str) -> None:
        """Watch the life that has failed starts beside it; what the first has left had time to go.

        What the driver itself leaves is known by then, so what is more is left by them: nothing is
        said of it where each of its own lives leaves something.
        """
        before, nodes, came = self.process.read_usage(), len(self.find_nodes()), self.count()
        self.program.interrupt()
        # Its pictures come when the starts are over, each of which may take its second.
        if not self.wait(lambda: self.count() > came, SETTLE_S + TRIED * ENDED_S):
            pace = "None came once others had failed to start."
        else:
            pace = self.rate_fault(self.count, RATE_HZ, "pictures")
        if pace and not self.is_gone():
            wanted = f"{ALONE} it takes ten pictures a second by the machine's clock."
            self.note_fault("driver_runs", wanted, pace)
        left = self._end_life()
        if self.stopped:
            return
        self.note_usage()
        if kept := self.list_leaks(KEPT_KIB):
            self.note_fault(
                "lives_are_flat",
                f"{ENDED} it leaves no thread and no file behind, and less than 1 MiB.",
                f"Each of its lives left {as_phrase(kept)} behind.{self.process.others_note()}",
            )
            return
        left = left or self._list_left_by_starts(stuck, before, nodes)
        others = self.process.others_note()
        self.program.interrupt()
        if not self.wait(self.is_gone):
            self.note_fault(
                "failed_start",
                f"{DRIVER}('unplugged') raises in a program of its own as well, which so ends.",
                "The program went on as if all were well.",
            )
        elif left:
            self.note_fault(
                "failed_start",
                f"In a program of its own that has tried {TRIED} times to start a driver with a "
                "camera 'stuck', and has ended the one that works by Ctrl-C, nothing of them is "
                "left.",
                f"They left {as_phrase(left)}.{others}",
            )

    def _list_left_by_starts(self, stuck: str, before: Usage, nodes: int) -> list[str]:
        """Return what starts that failed have left, beside a life that left nothing."""
        if not self.wait_for_end(lambda: not self.asked(stuck)):
            return [OPEN]
        if not self.wait_for_end(lambda: len(self.find_nodes()) <= nodes):
            return ["a node on the graph"]

        def kept() -> list[str]:
            threads, files, memory = self.process.read_usage().growth_since(before)
            # Most of them: threads come and go. The life itself may keep as much memory as a start.
            most = TRIED // 2 + 1
            each = Usage(threads // most, files // most, memory // (TRIED + 1))
            return list_kept(each, KEPT_KIB)

        return [] if self.wait_for_end(lambda: not kept()) else kept()
