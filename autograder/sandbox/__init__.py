"""Where a submission runs: in a sandbox of its own, or, if it is trusted, on this machine as it is.

`choose_isolation` gives one or the other. A sandbox is a network, process, file and IPC namespace
made with bubblewrap, with limits; the examiner shares nothing with the submission but that network.
"""

from autograder.sandbox.confinement.network import SandboxStartError
from autograder.sandbox.isolation import Isolation, RunningSubject, subject_command
from autograder.sandbox.sandbox_support import (
    Abilities,
    SandboxError,
    abilities,
    choose_isolation,
    require_sandbox,
    warm_up,
)

__all__ = [
    "Abilities",
    "Isolation",
    "RunningSubject",
    "SandboxError",
    "SandboxStartError",
    "abilities",
    "choose_isolation",
    "require_sandbox",
    "subject_command",
    "warm_up",
]  # fmt: skip
