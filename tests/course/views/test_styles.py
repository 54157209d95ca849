"""The styles of a view touch no other view, in whatever order a page shows them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from course.views.shared import live_widget

STYLES = {
    path.stem: path.read_text("utf-8")
    for path in sorted((Path(live_widget.__file__).parents[1] / "static").glob("*.css"))
}
SHARED = ("live", "forms")
"""Styles of more than one view: they stand for little, so that a view's own ones come before."""


def selectors(style: str) -> list[str]:
    text = re.sub(r"/\*.*?\*/", "", style, flags=re.DOTALL)
    return [one.strip() for rule in re.findall(r"([^{}]+)\{", text) for one in rule.split(",")]


@pytest.mark.parametrize("name", [name for name in STYLES if name not in SHARED])
def test_every_style_of_a_view_names_a_class_that_no_other_view_has(name: str) -> None:
    family = name.partition("_")[0]
    others = {
        found
        for other, style in STYLES.items()
        if other.partition("_")[0] != family
        for found in re.findall(r"\.([\w-]+)", style)
    }
    for selector in selectors(STYLES[name]):
        assert set(re.findall(r"\.([\w-]+)", selector)) - others, selector


def test_what_views_share_begins_at_their_root_and_stands_for_little() -> None:
    assert all(one.startswith(":where(.rosview) ") for one in selectors(STYLES["forms"]))
    assert all(one.startswith(".rosview") for one in selectors(STYLES["live"]))
