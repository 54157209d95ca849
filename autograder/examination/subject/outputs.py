"""What is kept of a cell's outputs: notebook format, within bounds, no matter who made them.

A subject builds them of what its cells send, and the grader takes nothing else from it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from typing import Any

Output = dict[str, Any]

MAX_TEXT_CHARS = 64 * 1024
"""Characters kept of each stream of a cell, and of an error; a flood is cut, and says so."""

MAX_SHOWN_BYTES = 1024 * 1024
"""Bytes kept of what a cell displays, as JSON: some thirty plots."""

MAX_NOTEBOOK_CHARS = 8 * 1024 * 1024
"""Characters of outputs, as JSON, that are kept of a notebook."""

CUT = "[further outputs were cut off here]\n"

_MAX_LEVELS = 20
"""Levels of lists and objects in what is displayed as JSON."""

_JSON_TYPE = re.compile(r"application/(?:json|[\w.+-]+\+json)")
_PLAIN_VALUE = re.compile(r"[\w.% -]{0,40}")

_DATA_TYPES = ("display_data", "execute_result")


def stream_output(text: str, name: str = "stdout") -> Output:
    """Return an output that is text of a stream."""
    return {"output_type": "stream", "name": name, "text": text}


def shortened_text(text: str, dropped: int) -> str:
    """Return a text that says how many characters of it are missing at its end, if any are."""
    return f"{text}\n[{dropped} more characters were cut off here]\n" if dropped else text


def error_output(name: Any, value: Any, lines: Iterable[Any]) -> Output:
    """Return an output that is an error: its type, its message, and its traceback."""
    kept, room = [], MAX_TEXT_CHARS
    for line in map(str, lines):
        kept.append(_shorten_text(line, room))
        room -= len(line)
        if room < 0:
            break
    return {
        "output_type": "error", "ename": str(name)[:200],
        "evalue": _shorten_text(str(value), MAX_TEXT_CHARS), "traceback": kept,
    }  # fmt: skip


def _shorten_text(text: str, room: int) -> str:
    return shortened_text(text[:room], max(len(text) - room, 0))


def displayable_data(data: Any, metadata: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what a notebook can hold of a display's data by MIME type, and of what is said of it.

    Of that, only simple values such as a width are kept: they go into a page as they are.
    """
    kept = {mime: value for mime, value in data.items() if _is_data(mime, value)}
    about = metadata if isinstance(metadata, dict) else {}
    return kept, {
        mime: {name: value for name, value in said.items() if _is_simple(name, value)}
        for mime, said in about.items()
        if mime in kept and isinstance(said, dict)
    }


def is_output(output: Any) -> bool:
    """Whether something is an output as this module keeps them, which nbgrader can take."""
    match output:
        case {"output_type": "stream", "name": "stdout" | "stderr", "text": str(), **more}:
            return not more
        case {"output_type": "display_data", "data": dict(), "metadata": dict(), **more}:
            return not more and _is_shown(output)
        case {
            "output_type": "execute_result", "data": dict(), "metadata": dict(),
            "execution_count": int() | None, **more,
        }:  # fmt: skip
            return not more and _is_shown(output)
        case {
            "output_type": "error", "ename": str(), "evalue": str(), "traceback": list() as lines,
            **more,
        }:  # fmt: skip
            return not more and all(isinstance(line, str) for line in lines)
    return False


def is_data(output: Output) -> bool:
    """Whether an output is a display, or the value of a cell."""
    return output["output_type"] in _DATA_TYPES


def is_error(output: Output) -> bool:
    """Whether an output is what a cell raised."""
    return bool(output["output_type"] == "error")


def json_size(output: Output) -> int:
    """Return how many bytes an output has as JSON."""
    return len(json.dumps(output, ensure_ascii=False).encode(errors="replace"))


def only_error(outputs: list[Output]) -> list[Output]:
    """Return what is kept of a cell's outputs if there are too many: why nbgrader fails a test."""
    kept = []
    for output in outputs:
        if is_error(output) or output.get("name") == "stderr":
            short = {name: text[:200] for name, text in output.items() if isinstance(text, str)}
            kept.append({**output, **short, **({"traceback": []} if "traceback" in output else {})})
    return kept[-1:]


def of_test(outputs: list[Output], points: float) -> list[Output]:
    """Return the outputs of a test as nbgrader can score them.

    It takes the value of the cell for its score and stumbles over more than the test's ``points``,
    and over a value without a text: those become displays, which it passes over.
    """
    return [
        {**{name: item for name, item in output.items() if name != "execution_count"},
         "output_type": "display_data"}
        if output["output_type"] == "execute_result" and not _is_score(output, points)
        else output
        for output in outputs
    ]  # fmt: skip


def _is_score(output: Output, points: float) -> bool:
    try:
        return 0 <= float(output["data"].get("text/plain", "")) <= points
    except ValueError:
        return False


class OutputNotebook:
    """The outputs of all cells of a notebook, within bounds."""

    def __init__(self, cells: list[list[Output]]) -> None:
        """Put the outputs into ``cells``, a list for each code cell."""
        self.cells = cells
        self.cut = False
        self._sizes = [0] * len(cells)

    def put_outputs(self, number: int, outputs: list[Output]) -> None:
        """Have a cell show these outputs; of those that are too many, what it raised is left."""
        self._sizes[number] = len(json.dumps(outputs))
        if sum(self._sizes) > MAX_NOTEBOOK_CHARS:
            self.cut = True
            outputs = only_error(outputs)
            self._sizes[number] = len(json.dumps(outputs))
        self.cells[number] = outputs


def _is_shown(output: Output) -> bool:
    data, metadata = output["data"], output["metadata"]
    return displayable_data(data, metadata) == (data, metadata)


def _is_data(mime: Any, value: Any) -> bool:
    if not isinstance(mime, str):
        return False
    if not _JSON_TYPE.fullmatch(mime):
        return isinstance(value, str)
    return not _is_deep(value, _MAX_LEVELS) and _is_json(value)


def _is_json(value: Any) -> bool:
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError):
        return False
    return True


def _is_deep(value: Any, levels: int) -> bool:
    if not isinstance(value, (dict, list, tuple)):
        return False
    items = value.values() if isinstance(value, dict) else value
    return not levels or any(_is_deep(item, levels - 1) for item in items)


def _is_simple(name: Any, value: Any) -> bool:
    if isinstance(value, float):
        return abs(value) < 1e9
    texts = [text for text in (name, value) if not isinstance(text, int)]
    return all(isinstance(text, str) and _PLAIN_VALUE.fullmatch(text) for text in texts)
