"""A sentence under a cell."""

from __future__ import annotations

import html


class News:
    """Something that the learner should know, shown under the cell that has just run."""

    def __init__(self, sentence: str, detail: str = "") -> None:
        """Show `sentence`, with `detail` (a traceback) to unfold."""
        self.sentence = sentence
        self.detail = detail

    def __repr__(self) -> str:
        """Return it as text."""
        return "\n".join(part for part in (self.sentence, self.detail) if part)

    def _repr_html_(self) -> str:
        sentence = html.escape(self.sentence)
        if self.detail:
            detail = html.escape(self.detail)
            sentence = f"<details><summary>{sentence}</summary><pre>{detail}</pre></details>"
        style = "border-left:4px solid #c60;padding:.3em .8em"
        return f'<div style="{style}">{sentence}</div>'
