"""Pages made from templates: all text in them is escaped, and what is missing is an error."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

_SHARED = Path(__file__).with_name("templates")
"""What pages extend, and what several of them show."""


def fill_template(template: Path, **shown: object) -> str:
    """Return the page that a ``template`` makes of what is to be ``shown``."""
    return _open_folder(template.parent).get_template(template.name).render(shown)


@cache
def _open_folder(folder: Path) -> Environment:
    return Environment(
        loader=FileSystemLoader([folder, _SHARED]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
