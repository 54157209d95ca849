"""What a saved notebook shows in a view's place when no kernel has the view any more.

A widget's state lives in the kernel, and JupyterLab says only "model not found" after a restart and
a reload. So each view leaves a second output, which style sheets hide while the first one lives.
Where styles are not applied (a notebook that is not trusted, another front end) both are shown.
"""

from __future__ import annotations

import time
from html import escape

MAX_CHARS = 20_000
"""Characters of a view's words that are kept."""

_STYLE = """
.jp-OutputArea-child:has(.rosview) + .jp-OutputArea-child:has(.rosview-saved) { display: none; }
.jp-OutputArea-child:has(+ .jp-OutputArea-child .rosview-saved):not(:has(.rosview)) { display: none; }
.rosview-saved pre { max-height: 24em; overflow: auto; }
"""  # noqa: E501 - a selector stays on one line


def saved_output(label: str, words: str) -> dict[str, str]:
    """Return the second output: what the view called ``label`` shows now, in words.

    Mime bundle with ``text/html`` and ``text/plain``.
    """
    note = (
        f"{label} as it was at {time.strftime('%Y-%m-%d %H:%M:%S')}. This is a saved copy and not "
        "live: run this cell again to see what happens now."
    )
    if len(words) > MAX_CHARS:
        words = f"{words[:MAX_CHARS]}\n[the rest was not saved]"
    html = (
        f'<div class="rosview-saved"><style>{_STYLE}</style><p>{escape(note)}</p>'
        f"<pre>{escape(words)}</pre></div>"
    )
    return {"text/html": html, "text/plain": note}
