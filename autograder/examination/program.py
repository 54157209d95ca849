"""What of a submitted notebook is run: its code cells in order, and the places of the exam."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Cell:
    """One code cell to run, or (``exam`` set) the place where a part of an exam is sat.

    ``key`` is the answer key of that part, if its hidden cell has one: for the examiner only.
    """

    source: str
    grade_id: str = ""
    exam: str = ""
    part: str = ""
    key: Mapping[str, Any] = field(default_factory=dict)


Program = tuple[Cell, ...]


def program_digest(program: Program, files: Mapping[str, bytes], salt: str) -> str:
    """Return a key for the results of a program: equal programs behave alike.

    ``files`` are the other files it finds, ``salt`` is what else the results depend on: the exams.
    """
    beside = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    content = json.dumps([salt, beside, [vars(cell) for cell in program]], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()
