"""Rest: nothing is under way between examiner and subject; see `autograder.processes.outside`."""

from __future__ import annotations

from autograder.processes.outside.asking import Outside
from autograder.processes.outside.kernel_stillness import HANGS_S, RESTLESS_S

__all__ = ["HANGS_S", "RESTLESS_S", "Stillness"]


class Stillness:
    """Watches the threads of the examiner's own process and of the subject's."""

    def __init__(self, outside: Outside) -> None:
        """Watch both; what an earlier one has found of threads that never rest is forgotten."""
        self._outside = outside
        outside.ask("watch")

    @property
    def patience(self) -> float:
        """The share of grading's patience that is left for what may never come, from 0 to 1."""
        return self._outside.usual_patience * self._outside.patience

    def wait_for_rest(self, restless: float = RESTLESS_S, timeout: float = HANGS_S) -> bool:
        """Return once both are at rest, or prove to be restless; say which it was.

        See `autograder.processes.outside.kernel_stillness.KernelStillness.wait_for_rest`.
        """
        return bool(self._outside.ask("rest", restless=restless, timeout=timeout))

    def all_asleep(self) -> bool:
        """Return whether every thread of both sleeps just now; one that never does not count."""
        return bool(self._outside.ask("asleep"))
