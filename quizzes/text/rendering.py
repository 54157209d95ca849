"""From a bank's Markdown to HTML that needs nothing else: no script, no style, no request.

HTML in the Markdown is text, code becomes spans of pygments' classes, LaTeX becomes MathML, and
images become data URIs.
"""

from __future__ import annotations

import base64
import html
import mimetypes
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token
from mdit_py_plugins.dollarmath import dollarmath_plugin
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name
from pygments.util import ClassNotFound

from quizzes.text.mathml import LatexError, from_latex

IMAGES = {"image/svg+xml", "image/png", "image/jpeg", "image/gif", "image/webp"}
MAX_IMAGE_BYTES = 512 * 1024
"""Largest image in bytes: it travels inside the widget's state."""


class RenderError(ValueError):
    """A text that cannot be shown; the message is a phrase that says why."""


def render_block(text: str, folder: Path) -> str:
    """Return Markdown as HTML; images are looked for in ``folder``.

    Raises:
        RenderError: an image is not there or not one that can be shown, or LaTeX is not sound.
    """
    return str(_make_parser().render(text, {"folder": folder}))


def render_inline(text: str, folder: Path) -> str:
    """Return Markdown as HTML for inside a line; a text with a fence or a list stays a block.

    Raises:
        RenderError: as `render_block`.
    """
    rendered = render_block(text, folder).strip()
    inner = rendered.removeprefix("<p>").removesuffix("</p>")
    single = rendered == f"<p>{inner}</p>" and "<p>" not in inner
    return inner if single else rendered


def render_code(source: str, language: str = "python") -> str:
    """Return a piece of code as HTML, each token in a span of its pygments class."""
    try:
        lexer = get_lexer_by_name(language or "text")
    except ClassNotFound:
        lexer = get_lexer_by_name("text")
    inner: str = highlight(source.strip("\n"), lexer, HtmlFormatter(nowrap=True))
    # The box can be scrolled by keyboard, which needs a place in the tab order and a name.
    return (
        '<pre class="quiz-code" tabindex="0" role="region" aria-label="Code" '
        f'data-lm-suppress-shortcuts="true"><code>{inner.rstrip()}</code></pre>'
    )


def render_plain(text: str) -> str:
    """Return Markdown as plain text on one line, for places that hold nothing else."""
    words: list[str] = []
    for token in _make_parser().parse(text):
        words.append(" " if token.block else "")
        for child in token.children or [token]:
            if child.type == "image":
                words.append(str(child.content))
            elif child.type in ("softbreak", "hardbreak"):
                words.append(" ")
            else:
                words.append(child.content)
    return " ".join("".join(words).split())


def picture_sources(text: str) -> list[str]:
    """Return where the pictures of a Markdown text come from, in order."""
    inner = (child for token in _make_parser().parse(text) for child in token.children or ())
    return [str(child.attrGet("src")) for child in inner if child.type == "image"]


def check_text(text: str, folder: Path) -> None:
    """Return if ``text`` can be rendered.

    Raises:
        RenderError: it cannot; the message says why.
    """
    if "![" in text or "$" in text:
        render_block(text, folder)


@cache
def _make_parser() -> Any:
    markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
    markdown.use(
        dollarmath_plugin, allow_digits=False, allow_space=False, double_inline=True,
        renderer=lambda source, options: _render_math(
            source, display=bool(options["display_mode"])
        ),
    )  # fmt: skip
    markdown.add_render_rule("fence", _render_fence)
    markdown.add_render_rule("code_block", _render_fence)
    markdown.add_render_rule("image", _render_image)
    return markdown


def _render_math(source: str, *, display: bool) -> str:
    try:
        return from_latex(source, display=display)
    except LatexError as error:
        raise RenderError(str(error)) from error


def _render_fence(
    _renderer: RendererHTML, tokens: Sequence[Token], index: int, _options: Any, _env: Any
) -> str:
    token = tokens[index]
    return render_code(token.content, (token.info.split() or [""])[0]) + "\n"


def _render_image(
    _renderer: RendererHTML, tokens: Sequence[Token], index: int, _options: Any, env: Any
) -> str:
    token = tokens[index]
    source = str(token.attrGet("src") or "")
    alternative = token.content.strip()
    if not alternative:
        raise RenderError(f"the image '{source}' needs a description in its brackets")
    uri = data_uri(source, env["folder"])
    return f'<img src="{uri}" alt="{html.escape(alternative)}">'


def data_uri(source: str, folder: Path) -> str:
    """Return an image of the bank's folder as a data URI.

    Raises:
        RenderError: it is not there, lies elsewhere, is too large, or is no image.
    """
    path = (folder / source).resolve()
    if "://" in source or not path.is_relative_to(folder.resolve()):
        raise RenderError(f"the image '{source}' must lie in the folder of the bank")
    kind = mimetypes.guess_type(path.name)[0]
    if kind not in IMAGES:
        raise RenderError(f"the image '{source}' is none of SVG, PNG, JPEG, GIF and WebP")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise RenderError(f"the image '{source}' cannot be read ({error.strerror})") from None
    if len(content) > MAX_IMAGE_BYTES:
        raise RenderError(f"the image '{source}' is larger than {MAX_IMAGE_BYTES // 1024} kB")
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
