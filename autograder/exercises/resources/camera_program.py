"""The student's nodes in plain programs that are ended by Ctrl-C: nobody asks them for anything.

The harness asks a student's process to destroy a node, so that process knows when it is looked at.
A program that is interrupted is not asked. Nor is it told what time it is: it has the machine's.
What is seen there counts in the check that sees the same in the student's process.
"""

from __future__ import annotations

from autograder.examination.plain_programs import Program
from autograder.exercises.resources.camera_examiner import IMAGE, SNAPSHOT, ExaminerNode
from autograder.exercises.resources.rig import CameraRig
from autograder.observe.programs.program_observer import ProgramObserver

KEPT_KIB = 1024
"""KiB that a life, a start or a round may keep: nobody has Python collect what is garbage."""
GONE = "The program was gone: an exception left it, or an exit."


class CameraProgram(ProgramObserver):
    """A plain program of a node that has a camera, watched life after life."""

    node: ExaminerNode

    def __init__(self, rig: CameraRig, program: Program, device: str) -> None:
        """Watch ``program``, in which the camera is ``device``."""
        super().__init__(program, rig.outside, ExaminerNode)
        self.rig, self.device = rig, device

    def asked(self, device: str = "") -> list[int]:
        """Return how often each open camera of the device, or of another, was asked."""
        return self.process.file_positions(f"camera:{device or self.device}")

    def count(self) -> int:
        """Return how many pictures have come."""
        return len(self.node.pictures_of(self.device))

    def is_on_graph(self) -> bool:
        """Whether a publisher of pictures or a service for them is on the graph."""
        return bool(self.node.count_publishers(IMAGE) or self.node.count_services(SNAPSHOT))
