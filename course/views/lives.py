"""What lives of a node have left behind: a picture, and the numbers as a table."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from course.messages.yaml_text import format_count
from course.views.pictures.lives_svg import draw_lives
from course.watch.lives import Held, left_each

COLUMNS = ("threads", "open files", "nodes and endpoints")
ABOUT = (
    "Measured in this process, up to 1 s after the end of each life. One life came before them: it "
    "is not counted, as it also starts what the session needs. A notebook's own threads come and "
    "go, so one more or less says nothing."
)


class Lives:
    """Lives of a node, and what this process held after each.

    Attributes:
        held: first what it held before them, then what it held after each.
    """

    def __init__(self, held: Sequence[Held]) -> None:
        """Show what was ``held``."""
        self.held = list(held)

    @property
    def left(self) -> list[Held]:
        """What each life has left behind."""
        return left_each(self.held)

    @property
    def summary(self) -> str:
        """What all of them together have left, in a sentence."""
        total = self.held[-1].without(self.held[0])
        count = format_count(len(self.held) - 1, "life").replace("lifes", "lives")
        parts = [
            f"{number} more {what if number != 1 else what.removesuffix('s')}"
            for what, number in zip(COLUMNS, total, strict=True)
            if number > 0
        ]
        return f"{count}: {', '.join(parts) or 'nothing'} left behind."

    def __repr__(self) -> str:
        """Return the numbers as a table."""
        lines = [self.summary, " " * 8 + "".join(f"{name:>21}" for name in COLUMNS)]
        lines += [
            f"{name:8}" + "".join(f"{text:>21}" for text in texts) for name, texts in self._rows()
        ]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        head = "".join(f'<th scope="col">{name}</th>' for name in ("", *COLUMNS))
        rows = "".join(
            f'<tr><th scope="row">{name}</th>'
            + "".join(f"<td>{escape(text)}</td>" for text in texts)
            + "</tr>"
            for name, texts in self._rows()
        )
        return (
            f"<p><strong>{escape(self.summary)}</strong></p>"
            f"{draw_lives(self.held, COLUMNS, self.summary)}"
            f"<details><summary>The numbers</summary><table><thead><tr>{head}</tr></thead>"
            f"<tbody>{rows}</tbody></table><p>{escape(ABOUT)}</p></details>"
        )

    def _rows(self) -> list[tuple[str, list[str]]]:
        """Return the name of each row, and its texts: "24 (+1)" after a life that left one."""
        rows = [("before", [str(number) for number in self.held[0]])]
        for life, (held, left) in enumerate(zip(self.held[1:], self.left, strict=True), 1):
            texts = [
                f"{now} ({more:+d})" if more else str(now)
                for now, more in zip(held, left, strict=True)
            ]
            rows.append((f"life {life}", texts))
        return rows
