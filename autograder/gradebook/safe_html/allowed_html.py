"""What of a submission may be shown in a browser: one list, for all that is written down of it.

The formgrader and the feedback pages render answers and outputs, and a script in them would act
with the rights of the instructor. So what may run is taken away before it is written: here is the
list of what stays, and nothing else in the autograder decides on it. A student's code is not
touched, because it is only ever shown as text.

Answers keep their words. An invisible character behind a ``<`` makes a tag that is not on the list
text for every reader of Markdown and of HTML alike, in code as well as outside of it: there is no
need to know what is code, on which readers of Markdown disagree.
"""

from __future__ import annotations

import base64
import html
import mimetypes
import re
import xml.parsers.expat
from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import nh3
from nbformat import NotebookNode
from pygments.token import STANDARD_TYPES

from autograder.assignments import submission
from autograder.examination.subject import outputs

if TYPE_CHECKING:
    from autograder.gradebook.safe_html.page_texts import Page


def _split_names(text: str) -> frozenset[str]:
    return frozenset(text.split())


_MATH_TAGS = _split_names(
    "math mi mn mo mrow ms mspace mtext msup msub msubsup mfrac msqrt mroot mover munder "
    "munderover mtable mtr mtd mstyle mpadded mphantom mmultiscripts mprescripts none semantics "
    "annotation"
)
_PLAIN_TAGS = _split_names(
    "p br hr b i u s em strong small mark del ins sub sup kbd samp var code pre q blockquote cite "
    "abbr dfn h1 h2 h3 h4 h5 h6 ul ol li dl dt dd div span table caption thead tbody tfoot tr th "
    "td colgroup col details summary figure figcaption section article"
)

EVERYWHERE = {"title", "lang", "dir", "align", "style"}
TAGS: dict[str, set[str]] = {
    **{tag: set() for tag in _PLAIN_TAGS},
    **{tag: {"display", "mathvariant", "stretchy", "columnalign", "xmlns", "encoding"}
       for tag in _MATH_TAGS},
    "a": {"href"},
    "img": {"src", "alt", "width", "height"},
    "th": {"colspan", "rowspan", "scope"},
    "td": {"colspan", "rowspan"},
    "ol": {"start"},
    "details": {"open"},
}  # fmt: skip
"""Elements and attributes that are shown. No class and no id: pages find their parts by them."""

STYLES = {
    "color", "background-color", "font-weight", "font-style", "text-align", "text-decoration",
    "white-space", "vertical-align", "border", "border-collapse", "padding", "padding-left",
}  # fmt: skip
"""Properties in a style attribute: none that moves something over something else."""

PICTURES = ("image/png", "image/jpeg", "image/gif", "image/webp")
MAX_DIAGRAM_CHARS = 32 * 1024
"""Characters of a Mermaid diagram that is shown."""

MAX_ESCAPES = 200
"""Colours in one text: nbconvert copies all that is left of a text for each of them."""

_JOINER = "\N{WORD JOINER}"
_TAG_BEGINS = re.compile(r"<(?=[a-z/!?])", re.IGNORECASE)
_TAG = re.compile(
    r"""<(?>(/?))(?>([a-z][a-z0-9]{0,20}))"""
    r"""((?>(?:\s{1,9}[a-z-]{1,20}(?:=(?:"[^"<>`]{0,500}"|'[^'<>`]{0,500}'|[\w.%#/-]{1,200}))?){0,9}))"""
    r"""\s{0,9}/?>""",
    re.IGNORECASE,
)
_ATTRIBUTE = re.compile(r"""([a-z-]+)(?:=(?:"([^"]*)"|'([^']*)'|([\w.%#/-]+)))?""", re.IGNORECASE)
_AUTOLINK = re.compile(r"<(?:https?://|mailto:)[^\s<>]{1,500}>|<[\w.+-]{1,64}@[\w.-]{1,255}>")
_PICTURE_BEGINS = re.compile(r"!\[")
_PICTURE = re.compile(
    r"""!\[[^][\\`<$\n]{0,500}\]\(((?>[^\s()<>"\\`$]*))(?:[ ]"[^"\\`<$\n]{0,200}")?\)"""
)
_LINK_BEGINS = re.compile(r"\](?=[(:])")
_PICTURE_DATA = re.compile(r"data:image/(?:png|jpeg|gif|webp|svg\+xml);base64,[A-Za-z0-9+/=]*")
_BASE64 = re.compile(r"[A-Za-z0-9+/=\s]*")
_RELATIVE = re.compile(r"[\w./%~+=,@-]*(?:[?#][\w./%~+=,@&;:?#-]*)?")
_BESIDE = re.compile(r"[\w./%~+=,@-]+")
_STYLE_LOADS = re.compile(r"\\|@import|url\(|image(?:-set)?\(|src\(", re.IGNORECASE)
_STYLE_HOLDS = re.compile(r"""url\(\s*["']?(?:#|data:)[^()\s"'\\]*["']?\s*\)""", re.IGNORECASE)
_DRAWING = re.compile(r"<svg\b.*?</svg\s*>", re.IGNORECASE | re.DOTALL)
_MERMAID_ACTION = re.compile(r"^[ \t]*(?:click\b|%%\{).*$", re.MULTILINE)

MAX_LINK_CHARS = 400
"""Characters of a link in Markdown that are read; one with a picture in it begins as it must."""


def is_link(target: str) -> bool:
    """Whether a link leads somewhere and runs nothing: to the web, into the page, or beside it."""
    if re.match(r"(?:https?://|mailto:|#)[\x21-\x7e\w]*\Z", target):
        return True
    return bool(_RELATIVE.fullmatch(target))


def is_source(target: str) -> bool:
    """Whether a browser may load something by itself: a picture held there, or a file beside it.

    Nobody is asked before that. From any other address a page of the formgrader would be asked for
    in the instructor's name, or a stranger would hear that, and when, somebody reads an answer.
    """
    if _PICTURE_DATA.fullmatch(target) or target.startswith("attachment:"):
        return True
    # An empty part stays when nbconvert takes away "files/", and is then a leading slash.
    parts = unquote(target).split("/")
    return bool(_BESIDE.fullmatch(target)) and not {"", ".."} & set(parts)


_CLASSES = {"div": {"highlight"}, "span": set(STANDARD_TYPES.values()) - {""}}
"""What colours code: the one use of classes that Markdown makes."""


def cleaned_html(text: str, *, coloured: bool = False) -> str:
    """Return HTML of which nothing runs: what `TAGS` has, and drawings as pictures.

    ``coloured`` keeps the colours of code, in HTML that Markdown was made into.
    """
    pictures = _DRAWING.sub(lambda found: _as_picture(found[0]), text)
    return nh3.clean(
        pictures, tags=set(TAGS), attributes={**TAGS, "*": EVERYWHERE},
        attribute_filter=_filter_attribute,
        url_schemes={"http", "https", "mailto", "data", "attachment"},
        filter_style_properties=STYLES, allowed_classes=_CLASSES if coloured else {},
        clean_content_tags={"script", "style", "template", "iframe", "object", "svg", "title"},
    )  # fmt: skip


def _filter_attribute(_tag: str, name: str, value: str) -> str | None:
    if name in _TARGETS:
        return value if _TARGETS[name](value.strip()) else None
    return None if name == "style" and "(" in value else value


_TARGETS: dict[str, Callable[[str], bool]] = {"href": is_link, "src": is_source}


def _as_picture(svg: str) -> str:
    """Return an ``img`` of a drawing: no browser runs what stands in a picture."""
    if not re.search(r"\sxmlns\s*=", svg[:2000]):
        svg = re.sub(r"\A<svg\b", '<svg xmlns="http://www.w3.org/2000/svg"', svg, flags=re.I)
    data = base64.b64encode(svg.encode(errors="replace")).decode()
    return f'<img alt="" src="data:image/svg+xml;base64,{data}">'


def disarm_markdown(text: str, *, tags: bool = True) -> str:
    """Return Markdown in which no link or picture is left that is not on the list, and no such tag.

    It reads as before: see the module's own words. No tag at all is left unless ``tags`` says so.
    A picture that a browser may not load is a link to it instead.
    """
    text = _PICTURE_BEGINS.sub(lambda found: _screen_picture(text, found.start()), text)
    text = _TAG_BEGINS.sub(lambda found: _screen_tag(text, found.start(), tags), text)
    return _LINK_BEGINS.sub(lambda found: _screen_link(text, found.end()), text)


def _screen_picture(text: str, place: int) -> str:
    """Return the beginning of a picture, apart from its bracket if it may not be loaded.

    It stays only where all readers of Markdown see the same picture: its words hold nothing that
    could have them look for the target somewhere else.
    """
    found = _PICTURE.match(text, place)
    return "![" if found and is_source(found[1]) else f"!{_JOINER}["


def _screen_tag(text: str, place: int, tags: bool) -> str:
    found = _TAG.match(text, place) if tags else None
    if _AUTOLINK.match(text, place) or (found and _is_listed(found[2].lower(), found[3])):
        return "<"
    return f"<{_JOINER}"


def _is_listed(tag: str, attributes: str) -> bool:
    if tag not in TAGS:
        return False
    for found in _ATTRIBUTE.finditer(attributes):
        name, value = found[1].lower(), html.unescape(found[2] or found[3] or found[4] or "")
        if name not in TAGS[tag] | EVERYWHERE:
            return False
        if name in _TARGETS and not _TARGETS[name](value):
            return False
        if name == "style" and not _is_quiet(value):
            return False
    return True


def _is_quiet(style: str) -> bool:
    rules = [rule.partition(":") for rule in style.split(";") if rule.strip()]
    return all(
        name.strip().lower() in STYLES and re.fullmatch(r"[\w\s#.%-]*", value)
        for name, _, value in rules
    )


def _screen_link(text: str, place: int) -> str:
    """Return a bracket, apart from a link's target at ``place`` if that is not on the list."""
    target = text[place + 1 : place + 1 + MAX_LINK_CHARS].lstrip(" \t\r\n")
    if target.startswith("<"):
        target = target[1:].partition(">")[0]
    else:
        target = re.split(r"[ \t\r\n)]", target, maxsplit=1)[0]
    if target.startswith("data:image/"):
        target = target.partition(",")[0] + ","
        return "]" if _PICTURE_DATA.fullmatch(target) else f"]{_JOINER}"
    return "]" if is_link(target) or is_source(target) else f"]{_JOINER}"


MAX_PLAIN_CHARS = 100_000
"""Characters that are shown of a text that is not formatted; all of it stands in the submission."""

_LINE = re.compile(r"[^\n]{200}(?=[^\n])")


def shorten_text(text: str) -> str:
    """Return what is shown of a text that is not formatted."""
    return outputs.shortened_text(text[:MAX_PLAIN_CHARS], max(len(text) - MAX_PLAIN_CHARS, 0))


def fence_text(text: str) -> str:
    """Return a text as one block of code: what takes too long to format reads the same in it.

    Its lines are short, because nbconvert looks for links in code, too, and slowly in long lines.
    """
    text = _LINE.sub(r"\g<0>\n", shorten_text(text))
    longest = max(map(len, re.findall(r"`{3,}", text)), default=2)
    fence = "`" * (longest + 1)
    return f"{fence}\n{_TAG_BEGINS.sub(f'<{_JOINER}', text)}\n{fence}"


def screen_texts(notebook: NotebookNode, released: NotebookNode, page: Page) -> None:
    """Put answers of a restored notebook in place that a page can show, quickly and for good.

    Where tags do not pair up, or a heading would take the place of a part of the formgrader's
    page, an answer is shown without them; where it takes too long to format, as it was typed. What
    stands in the ``released`` notebook is the instructor's and stays as it is.
    """
    given = {cell.source for cell in released.cells}
    taken = [part for cell in notebook.cells if (part := submission.grade_id(cell))]
    for cell in notebook.cells:
        if "attachments" in cell:
            cell.attachments = _screen_attachments(cell.attachments)
        if submission.is_locked(cell) or cell.source in given:
            continue
        if cell.cell_type == "raw":
            cell.source = _TAG_BEGINS.sub(f"<{_JOINER}", cell.source)
        elif cell.cell_type == "markdown":
            cell.source = _fit_markdown(cell.source, taken, page, cell.get("attachments", {}))
        elif cell.cell_type == "code" and page.highlight_code(cell.source) is None:
            cell.metadata["magics_language"] = "text"  # what nbconvert has for "not coloured"


def _fit_markdown(
    text: str, taken: Collection[str], page: Page, attachments: Mapping[str, Any] | None = None
) -> str:
    shown = page.format_answer(text, taken, attachments or {})
    return fence_text(text) if shown is None else shown


def screen_answer(
    text: str, taken: Collection[str], looks: Callable[[str], tuple[bool, Collection[str]]]
) -> str:
    """Return Markdown that a page can show in place of an answer.

    Args:
        text: the answer.
        taken: the grade ids of its notebook.
        looks: returns whether all elements of a Markdown text pair up, and their ids.
    """
    for tags in (True, False):
        shown = disarm_markdown(text, tags=tags)
        pairs_up, ids = looks(shown)
        if pairs_up and not any(_is_reserved(name, taken) for name in ids):
            return shown
    return fence_text(text)


def _is_reserved(name: str, taken: Collection[str]) -> bool:
    """Whether the formgrader's page, or its script, looks for one of its own parts by a name."""
    return name in ("notebook", "notebook-container", "statusmessage", "site") or any(
        name in (part, f"{part}_extra_credit", f"{part}-comment") for part in taken
    )


def _screen_attachments(attachments: Any) -> dict[str, dict[str, str]]:
    return {
        str(name): {
            kind: data for kind, data in found.items()
            if kind in (*PICTURES, "image/svg+xml") and _is_base64(data)
        }
        for name, found in attachments.items() if isinstance(found, dict)
    }  # fmt: skip


def _is_base64(data: Any) -> bool:
    return isinstance(data, str) and _BASE64.fullmatch(data) is not None


def limit_escapes(text: str) -> str:
    """Return a text of an output whose escape sequences are few enough to be shown in colour."""
    return (
        text if text.count("\x1b") <= MAX_ESCAPES else text.replace("\x1b", "\N{SYMBOL FOR ESCAPE}")
    )


def screen_output(output: Mapping[str, Any], page: Page) -> dict[str, Any]:
    """Return an output of a cell with what of it may be shown; ``page`` is that it stands on."""
    kept = dict(output)
    if "text" in kept:
        kept["text"] = limit_escapes(str(kept["text"]))
    if "traceback" in kept:
        kept["traceback"] = [limit_escapes(str(line)) for line in kept["traceback"]]
    if "data" in kept:
        kept["data"] = _screen_data(kept["data"], page)
        about = kept.get("metadata") or {}
        sizes = {
            kind: {name: value for name, value in said.items() if name in ("width", "height")}
            for kind, said in about.items() if kind in PICTURES and isinstance(said, dict)
        }  # fmt: skip
        kept["metadata"] = {kind: said for kind, said in sizes.items() if said}
    return kept


def _screen_data(data: Mapping[str, Any], page: Page) -> dict[str, Any]:
    kept: dict[str, Any] = {}
    for kind, value in data.items():
        if not isinstance(value, str):
            continue
        if kind in PICTURES and _is_base64(value):
            kept[kind] = value
        elif kind == "text/plain":
            kept[kind] = limit_escapes(value)
        elif kind == "text/html" and (cleaned := page.clean_html(value)) is not None:
            kept[kind] = cleaned
        elif kind == "text/markdown":
            kept[kind] = _fit_markdown(value, (), page)
        elif kind == "text/latex":
            kept[kind] = _TAG_BEGINS.sub("< ", value)  # which says the same in a formula
        elif kind == "text/vnd.mermaid" and len(value) <= MAX_DIAGRAM_CHARS:
            kept[kind] = disarm_markdown(_MERMAID_ACTION.sub("", value))
    drawing = data.get("image/svg+xml")
    if isinstance(drawing, str) and "text/html" not in kept:
        kept["text/html"] = _as_picture(drawing)
    if data and not kept:
        kept["text/plain"] = "[What was displayed here is not shown: it could act on its own.]"
    return kept


_ACTIVE = re.compile(r"html|[/+]xml$|/xsl$|rfc822")
_SVG_SPACE = "http://www.w3.org/2000/svg"
_PAGE_SPACE = "http://www.w3.org/1999/xhtml"
_SVG_TAGS = _split_names(
    "svg g path rect circle ellipse line polyline polygon text tspan textPath defs clipPath mask "
    "pattern linearGradient radialGradient stop marker symbol use image title desc metadata style "
    "filter feGaussianBlur feOffset feBlend feFlood feComposite feMerge feMergeNode"
)
MAX_DRAWING_BYTES = 2 * 1024 * 1024
"""Bytes of an SVG file beside a notebook that is read."""


def may_lie_beside(name: str, read: Callable[[], bytes]) -> bool:
    """Whether a file may be served from the graded copy: a browser runs nothing of it.

    The formgrader serves these files from its own address, with the rights of the instructor.
    ``read`` returns what the file ``name`` holds.
    """
    kind, packed = mimetypes.guess_type(name)
    if packed or not kind or not _ACTIVE.search(kind):
        return True
    return kind == "image/svg+xml" and is_still(read())


def is_still(svg: bytes) -> bool:
    """Whether a drawing is nothing else: no script, no page and no entity, and it loads nothing."""
    if len(svg) > MAX_DRAWING_BYTES:
        return False
    try:
        _Drawing().read(svg)
    except (ValueError, xml.parsers.expat.ExpatError):
        return False
    return True


class _Drawing:
    """Reads a drawing, and raises a ValueError at the first thing in it that is not still."""

    def __init__(self) -> None:
        self._parser = xml.parsers.expat.ParserCreate(namespace_separator=" ")
        self._parser.StartElementHandler = self._begin_element
        self._parser.EndElementHandler = self._end_element
        self._parser.CharacterDataHandler = self._add_text
        self._parser.StartDoctypeDeclHandler = self._check_doctype
        self._parser.ProcessingInstructionHandler = self._refuse
        self._in_style = False
        self._style = ""

    def read(self, svg: bytes) -> None:
        self._parser.Parse(svg, True)
        self._require_quiet(self._style)

    def _begin_element(self, tag: str, attributes: dict[str, str]) -> None:
        space, _, name = tag.rpartition(" ")
        if space == _PAGE_SPACE or (space == _SVG_SPACE and name not in _SVG_TAGS):
            self._refuse()
        self._in_style = self._in_style or name == "style"
        for attribute, value in attributes.items():
            its_space, _, its_name = attribute.rpartition(" ")
            is_target = its_name.lower() == "href"
            if its_name.lower().startswith("on"):
                self._refuse()
            if is_target and not (value.startswith("#") or is_source(value)):
                self._refuse()
            if not its_space and not is_target:
                self._require_quiet(value)

    def _end_element(self, tag: str) -> None:
        self._in_style = self._in_style and tag.rpartition(" ")[2] != "style"

    def _add_text(self, text: str) -> None:
        self._style += text if self._in_style else ""

    def _require_quiet(self, style: str) -> None:
        if _STYLE_LOADS.search(_STYLE_HOLDS.sub("", style)):
            self._refuse()

    def _check_doctype(self, _name: str, _system: Any, _public: Any, has_subset: bool) -> None:
        if has_subset:
            self._refuse()

    def _refuse(self, *_: Any) -> None:
        raise ValueError
