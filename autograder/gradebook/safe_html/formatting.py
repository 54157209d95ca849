"""The process that makes HTML of a submission's texts: see `page_texts`.

The process that has loaded everything only waits. A fork of it formats, and the next fork takes its
place once it is over its bounds. So nothing has to be loaded again.
"""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import sys
import time
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

from nbconvert.filters import Highlight2HTML, strip_files_prefix
from nbconvert.filters.markdown_mistune import IPythonRenderer, MarkdownWithMath

from autograder.gradebook.safe_html import allowed_html
from autograder.gradebook.safe_html.page_texts import LENGTH, MAX_REPLY_BYTES

MAX_MEMORY_BYTES = 1024 * 1024 * 1024
_VOID = {"area", "br", "col", "embed", "hr", "img", "input", "link", "meta", "wbr"}
_NO_ALT = re.compile(r"<img(?![^<>]*\salt=)", re.IGNORECASE)
_ALT = '<img alt="No description has been provided for this image"'


def serve_requests() -> None:
    """Format what comes on standard input, until it ends."""
    while (request := _read_request()) is not None:
        begun = time.process_time()
        # The signal that comes then ends this process: no parser can put it off.
        signal.setitimer(signal.ITIMER_PROF, request["seconds"])
        try:
            reply = _WAYS[request["do"]](request)
        except (MemoryError, RecursionError):
            reply = {"over": True}
        except Exception as error:  # noqa: BLE001 - a stranger's text: parsers fail in many ways
            reply = {"over": True, "why": type(error).__name__}
        signal.setitimer(signal.ITIMER_PROF, 0)
        _write_reply({**reply, "spent": time.process_time() - begun})


def _format_markdown(request: dict[str, Any]) -> dict[str, Any]:
    made = strip_files_prefix(_render_markdown(request["text"], request["attachments"]))  # type: ignore[no-untyped-call]
    return {"made": _NO_ALT.sub(_ALT, allowed_html.cleaned_html(made, coloured=True))}


def _format_answer(request: dict[str, Any]) -> dict[str, Any]:
    def elements(text: str) -> tuple[bool, list[str]]:
        made = _render_markdown(text, request["attachments"])
        strip_files_prefix(made)  # type: ignore[no-untyped-call]  # the formgrader does, for long
        found = _Elements()
        found.feed(made)
        found.close()
        return found.pair_up and not found.open, found.ids

    return {"made": allowed_html.screen_answer(request["text"], request["taken"], elements)}


def _render_markdown(text: str, attachments: dict[str, Any]) -> str:
    return MarkdownWithMath(IPythonRenderer(escape=False, attachments=attachments)).render(text)


def _highlight_code(request: dict[str, Any]) -> dict[str, Any]:
    return {"made": Highlight2HTML(pygments_lexer=request["language"])(request["text"])}  # type: ignore[no-untyped-call]


def _clean_html(request: dict[str, Any]) -> dict[str, Any]:
    return {"made": _NO_ALT.sub(_ALT, allowed_html.cleaned_html(request["text"]))}


_WAYS: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "markdown": _format_markdown, "answer": _format_answer,
    "code": _highlight_code, "html": _clean_html,
}  # fmt: skip


class _Elements(HTMLParser):
    """Whether elements pair up, and their ids."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.pair_up = True
        self.ids: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.ids += [value for name, value in attrs if name in ("id", "name") and value]
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)

    def handle_endtag(self, tag: str) -> None:
        if tag in _VOID:
            return
        if not self.open or self.open.pop() != tag:
            self.pair_up = False


def _read_request() -> dict[str, Any] | None:
    length = _read_bytes(LENGTH.size)
    if len(length) < LENGTH.size:
        return None
    request: dict[str, Any] = json.loads(_read_bytes(LENGTH.unpack(length)[0]))
    return request


def _read_bytes(count: int) -> bytes:
    parts = []
    while count and (part := os.read(0, min(count, 1 << 20))):
        parts.append(part)
        count -= len(part)
    return b"".join(parts)


def _write_reply(reply: dict[str, Any]) -> None:
    data = json.dumps(reply).encode()
    if len(data) > MAX_REPLY_BYTES:
        data = b'{"over": true}'
    data = LENGTH.pack(len(data)) + data
    while data:
        data = data[os.write(1, data) :]


def main() -> None:
    """Have a fork of this process serve, and the next one after it, until the input ends."""
    Highlight2HTML()("import this")  # type: ignore[no-untyped-call]  # loads the lexers
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    while True:
        child = os.fork()
        if not child:
            try:
                serve_requests()
            finally:
                os._exit(0)
        _, status = os.waitpid(child, 0)
        if os.WIFEXITED(status):
            sys.exit()
        _write_reply({"over": True})


if __name__ == "__main__":
    main()
