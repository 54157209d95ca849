"""Pictures that lie beside a notebook, taken into its feedback page.

nbgrader's exchange, and a learning platform, hand out nothing but the page itself.
"""

from __future__ import annotations

import base64
import html
import re
from pathlib import Path
from urllib.parse import unquote, urlsplit

from quizzes.attempts.record import read_plain

TYPES = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".gif": "image/gif",
    ".webp": "image/webp",
    ".bmp": "image/bmp",
    ".svg": "image/svg+xml",
}
MAX_PICTURES_BYTES = 10 * 1024 * 1024
"""Bytes of the pictures that one page takes in."""

# Between two angle brackets only, so that a page is gone through once, whatever stands in it.
_IMAGE = re.compile(r"""(<img\b[^<>]*?\ssrc\s*=\s*)(?:"([^"<>]*)"|'([^'<>]*)')""", re.IGNORECASE)


def with_pictures(page: str, folder: Path) -> str:
    """Return an HTML ``page`` that holds the pictures of ``folder`` that it shows.

    What leads out of the folder, is no picture by its name, or is more than `MAX_PICTURES_BYTES` in
    all stays the link that it was.
    """
    known: dict[str, str] = {}
    room = MAX_PICTURES_BYTES

    def source(match: re.Match[str]) -> str:
        nonlocal room
        written = html.unescape(match[2] if match[2] is not None else match[3])
        if written not in known:
            content = _read_picture(written, folder, room)
            if content is None:
                return match[0]
            kind = TYPES[Path(_linked_path(written)).suffix.lower()]
            known[written] = f"data:{kind};base64,{base64.b64encode(content).decode()}"
            room -= len(content)
        return f'{match[1]}"{known[written]}"'

    return _IMAGE.sub(source, page)


def _linked_path(written: str) -> str:
    """Return the path in a link to a file beside the page; empty if it leads elsewhere."""
    try:
        link = urlsplit(written)
    except ValueError:
        return ""
    return "" if link.scheme or link.netloc else unquote(link.path)


def _read_picture(written: str, folder: Path, room: int) -> bytes | None:
    name = _linked_path(written)
    if Path(name).suffix.lower() not in TYPES:
        return None
    try:
        path = (folder / name).resolve()
        if not path.is_relative_to(folder.resolve()):
            return None
        content = read_plain(path, room + 1)
    except (OSError, ValueError):
        return None
    return content if len(content) <= room else None
