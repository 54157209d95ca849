"""What a saved notebook shows in a view's place when no kernel has the view any more.

A widget's state lives in the kernel, and JupyterLab says only "model not found" after a restart and
a reload. So each view leaves a second output, which style sheets hide while the first one lives.
Where styles are not applied (a notebook that is not trusted, another front end) both are shown.
"""

from __future__ import annotations

import time
from base64 import b64encode
from html import escape

MAX_CHARS = 20_000
"""Characters of a view's words that are kept."""

MAX_PICTURE_BYTES = 100_000
"""Bytes of SVG that a picture may have; a larger one is not kept."""

_STYLE = """
.jp-OutputArea-child:has(.rosview) + .jp-OutputArea-child:has(.rosview-saved) { display: none; }
.jp-OutputArea-child:has(.rospanel) ~ .jp-OutputArea-child:has(.rosview-saved) { display: none; }
.jp-OutputArea-child:has(+ .jp-OutputArea-child .rosview-saved):not(:has(.rosview, .rosview-saved)) { display: none; }
.rosview-saved pre { max-height: 24em; overflow: auto; }
.rosview-saved img { max-width: 100%; height: auto; }
"""  # noqa: E501 - a selector stays on one line


def saved_output(label: str, words: str, picture: str = "") -> dict[str, str]:
    """Return the second output: what the view called ``label`` shows now, in words.

    Args:
        label: what people call the view.
        words: what it shows, as text.
        picture: the same as an SVG document; "" for none. It becomes an image, so nothing in it
            can run, and a notebook that is not trusted shows it, too.

    Returns:
        Mime bundle with ``text/html`` and ``text/plain``.
    """
    note = (
        f"{label} as it was at {time.strftime('%Y-%m-%d %H:%M:%S')}. This is a saved copy and not "
        "live: to see what happens now, run the cells above again, then this one (menu Run: Run "
        "All Above Selected Cell)."
    )
    if len(words) > MAX_CHARS:
        words = f"{words[:MAX_CHARS]}\n[the rest was not saved]"
    drawn = picture.encode()
    image = ""
    if drawn and len(drawn) <= MAX_PICTURE_BYTES:
        source = f"data:image/svg+xml;base64,{b64encode(drawn).decode()}"
        image = f'<p><img src="{source}" alt="{escape(label)}; the same in words below"></p>'
    html = (
        f'<div class="rosview-saved"><style>{_STYLE}</style><p>{escape(note)}</p>'
        f"{image}<pre>{escape(words)}</pre></div>"
    )
    return {"text/html": html, "text/plain": note}
