"""Write SVG as text; everything that is shown is escaped."""

from __future__ import annotations

from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr


def make_element(tag: str, attributes: Mapping[str, object], *children: str, text: str = "") -> str:
    """Return an element with its attributes, its text, and finished ``children`` inside."""
    named = "".join(f" {name}={quoteattr(str(value))}" for name, value in attributes.items())
    return f"<{tag}{named}>{escape(text)}{''.join(children)}</{tag}>"


def make_document(
    style: str, title: str, box: tuple[float, float, float, float], *children: str
) -> str:
    """Return an SVG document on white; ``box`` is left, top, width and height in px."""
    left, top, width, height = box
    back = make_element(
        "rect", {"x": left, "y": top, "width": width, "height": height, "fill": "#fff"}
    )
    return make_element(
        "svg",
        {
            "xmlns": "http://www.w3.org/2000/svg", "width": width, "height": height,
            "viewBox": f"{left:g} {top:g} {width:g} {height:g}",
        },
        make_element("title", {}, text=title), make_element("style", {}, style), back, *children,
    )  # fmt: skip
