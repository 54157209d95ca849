"""The packages whose texts come with the course, because no wheel offers them."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

from course.interfaces.building.unit import Unit
from course.interfaces.texts.definition import define_text
from course.interfaces.texts.type_names import TypeName

TEXTS = Path(__file__).parent / "bundled"
PACKAGES = ("example_interfaces",)


@functools.cache
def bundled_unit(package: str) -> Unit:
    """Return the unit of one of ``PACKAGES``: all its interfaces, built together."""
    texts: Mapping[TypeName, str] = {
        TypeName(package, file.parent.name, file.stem): file.read_text(encoding="utf-8")
        for file in sorted((TEXTS / package).glob("*/*.*"))
    }
    return Unit(package, tuple(define_text(name, text) for name, text in texts.items()))
