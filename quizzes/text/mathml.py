"""LaTeX to MathML, which browsers draw by themselves.

The library that converts passes on what it does not know (HTML in ``\\text``, links, styles), so
its result is taken only if it is sound XML made of MathML's own presentation elements.
"""

from __future__ import annotations

import re
from xml.etree import ElementTree

from latex2mathml.converter import convert

_NAMESPACE = "{http://www.w3.org/1998/Math/MathML}"
_ELEMENTS = {
    "math", "menclose", "mfrac", "mi", "mn", "mo", "mover", "mpadded", "mphantom", "mroot", "mrow",
    "mspace", "msqrt", "mstyle", "msub", "msubsup", "msup", "mtable", "mtd", "mtext", "mtr",
    "munder", "munderover",
}  # fmt: skip
_ATTRIBUTES = {
    "accent", "accentunder", "columnalign", "columnlines", "columnspacing", "depth", "display",
    "displaystyle", "fence", "form", "height", "largeop", "linethickness", "lspace",
    "mathbackground", "mathcolor", "mathsize", "mathvariant", "maxsize", "minsize", "movablelimits",
    "notation", "rowlines", "rowspacing", "rspace", "scriptlevel", "separator", "stretchy",
    "symmetric", "voffset", "width",
}  # fmt: skip


class LatexError(ValueError):
    """LaTeX that cannot be shown; the message is a phrase that says why."""


def from_latex(source: str, *, display: bool) -> str:
    """Return LaTeX as a MathML element, on a line of its own if ``display``.

    Raises:
        LatexError: it is not sound, or asks for more than formulas need.
    """
    try:
        converted: str = convert(source, display="block" if display else "inline")
        converted = re.sub(r"&(?!#x?[0-9A-Fa-f]+;)", "&amp;", converted)
        root = ElementTree.fromstring(converted)
    except Exception as error:
        raise LatexError(f"the LaTeX {source!r} is not sound ({type(error).__name__})") from error
    for element in root.iter():
        name = element.tag.removeprefix(_NAMESPACE)
        strange = sorted(set(element.attrib) - _ATTRIBUTES)
        if name not in _ELEMENTS or strange:
            raise LatexError(f"the LaTeX {source!r} makes a '{(strange or [name])[0]}', no formula")
        if (element.text or "").startswith("\\"):
            raise LatexError(f"the LaTeX {source!r} has the unknown command {element.text}")
    return converted
