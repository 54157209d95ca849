"""One line of the doctor's report."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

Status = Literal["ok", "warning", "problem"]
_WIDTH = len("warning")


@dataclass(frozen=True)
class HealthFinding:
    """What was looked at, how it is, and how to mend it.

    Attributes:
        name: what was looked at, in a word or two.
        status: "problem" if the course cannot run with it, "warning" if it works less well.
        message: what was seen, in a sentence.
        mend: what to do; empty if there is nothing to do.
    """

    name: str
    status: Status
    message: str
    mend: str = ""

    def as_text(self) -> str:
        """Return the lines for a terminal."""
        line = f"{self.status:<{_WIDTH}}  {self.name}: {self.message}"
        return f"{line}\n{'':<{_WIDTH}}  -> {self.mend}" if self.mend else line

    def as_data(self) -> dict[str, str]:
        """Return the same for machines."""
        return asdict(self)


def make_ok(name: str, message: str) -> HealthFinding:
    """Return a finding that all is well."""
    return HealthFinding(name, "ok", message)


def make_warning(name: str, message: str, mend: str = "") -> HealthFinding:
    """Return a finding that something works less well than it could."""
    return HealthFinding(name, "warning", message, mend)


def make_problem(name: str, message: str, mend: str = "") -> HealthFinding:
    """Return a finding that keeps the course from running."""
    return HealthFinding(name, "problem", message, mend)
