"""Where a submission runs: in a sandbox of its own, or, if it is trusted, on this machine as it is.

`place` gives one or the other. A sandbox is a network, process, file and IPC namespace made with
bubblewrap, with limits; the examiner shares nothing with the submission but that network.
"""

from autograder.sandbox.network import BoxError
from autograder.sandbox.place import Place, RunningSubject, subject_command
from autograder.sandbox.probe import (
    Abilities,
    SandboxError,
    abilities,
    choose_place,
    require_sandbox,
    warm_up,
)

__all__ = [
    "Abilities", "BoxError", "Place", "RunningSubject", "SandboxError", "abilities", "choose_place",
    "require_sandbox", "subject_command", "warm_up",
]  # fmt: skip
