"""Runs a notebook's code cells in this process, as a kernel would, and collects their outputs."""

# mypy: allow-untyped-calls
# IPython leaves most of its functions untyped.

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any

from IPython.core.displayhook import DisplayHook
from IPython.core.displaypub import DisplayPublisher
from IPython.core.interactiveshell import InteractiveShell
from traitlets import Type
from traitlets.config import Config

MAX_OUTPUT = 64 * 1024
"""Characters kept of one stream of one cell, and of what it displays; a flood is cut, and says so.

The rest is dropped as it comes: a cell that prints for ever is not one that needs too much memory.
"""
_DISPLAY = 100  # characters that a display counts as, beside what is in it

Output = dict[str, Any]


class _Stream(io.TextIOBase):
    """Keeps the beginning of what is written to it."""

    def __init__(self) -> None:
        self._kept: list[str] = []
        self._room = MAX_OUTPUT
        self._dropped = 0

    def writable(self) -> bool:
        return True

    def write(self, text: str) -> int:
        if not isinstance(text, str):
            raise TypeError(f"write() argument must be str, not {type(text).__name__}")
        kept = text[: max(self._room, 0)]  # less than nothing if threads write at once
        self._room -= len(kept)
        self._dropped += len(text) - len(kept)
        if kept:
            self._kept.append(kept)
        return len(text)

    def text(self) -> str:
        return _shortened("".join(self._kept), self._dropped)


class _Shown:
    """Keeps the first displays of a cell."""

    def __init__(self) -> None:
        self.outputs: list[Output] = []
        self._room = MAX_OUTPUT

    def add(self, formats: dict[str, Any]) -> None:
        """Keep one display: its text by MIME type."""
        if self._room < 0:
            return
        data = {mime: value for mime, value in formats.items() if isinstance(value, str)}
        self._room -= _DISPLAY + sum(len(value) for value in data.values())
        if self._room < 0:
            self.outputs.append(_stream("[further outputs were cut off here]\n"))
        else:
            self.outputs.append({"output_type": "display_data", "data": data, "metadata": {}})


class _Hook(DisplayHook):
    """Keeps the value of a cell's last expression instead of printing it."""

    def write_output_prompt(self) -> None:
        """Print no prompt."""

    def write_format_data(self, format_dict: dict[str, Any], md_dict: Any = None) -> None:
        _shell_of(self).shown.add(format_dict)


class _Publisher(DisplayPublisher):
    """Keeps what a cell displays."""

    def publish(self, data: Any, *_: Any, **__: Any) -> None:
        _shell_of(self).shown.add(data)

    def clear_output(self, wait: bool = False) -> None:
        """Keep it all: the record of a run is not an animation."""


class CellShell(InteractiveShell):
    """An IPython shell that keeps what a cell shows and raises instead of printing it."""

    displayhook_class = Type(_Hook)
    display_pub_class = Type(_Publisher)

    def __init__(self, **kwargs: Any) -> None:
        """Start with nothing shown."""
        self.shown = _Shown()
        self.last_error: Output | None = None
        self.first_error: BaseException | None = None
        super().__init__(**kwargs)

    def _showtraceback(
        self, etype: type[BaseException], evalue: BaseException, stb: list[str]
    ) -> None:
        self.first_error = self.first_error or evalue
        self.last_error = {
            "output_type": "error",
            "ename": getattr(etype, "__name__", str(etype)),
            "evalue": _cut(str(evalue)),
            "traceback": [_cut(line) for line in stb],
        }

    @contextmanager
    def _tee(self, channel: str) -> Iterator[None]:
        # IPython 9 would keep a second copy for its history: all that is written, without bounds.
        yield

    def ask_exit(self) -> None:
        """Ignore ``exit``: the rest of the notebook is still run."""


def _shell_of(part: Any) -> CellShell:
    shell: CellShell = part.shell
    return shell


def make_shell() -> CellShell:
    """Return this process's shell: no history file, no prompt, no colours."""
    config = Config()
    config.HistoryManager.enabled = False
    config.InteractiveShell.colors = "NoColor"
    shell: CellShell = CellShell.instance(config=config)
    return shell


def run_cell(shell: CellShell, source: str, number: int) -> list[Output]:
    """Run one cell and return its outputs in notebook format; an error is one of them.

    Args:
        shell: what runs it.
        source: the cell's text.
        number: which of the notebook's code cells it is, from 1: tracebacks say so.
    """
    shell.last_error = None
    shell.execution_count = number
    shell.shown = _Shown()
    out, err = _Stream(), _Stream()
    with redirect_stdout(out), redirect_stderr(err):
        shell.run_cell(source, store_history=True)
    streams = [(out.text(), "stdout"), (err.text(), "stderr")]
    outputs = [_stream(text, name) for text, name in streams if text]
    outputs += shell.shown.outputs
    if shell.last_error is not None:
        outputs.append(shell.last_error)
    return outputs


def _stream(text: str, name: str = "stdout") -> Output:
    return {"output_type": "stream", "name": name, "text": text}


def _cut(text: str) -> str:
    return _shortened(text[:MAX_OUTPUT], max(len(text) - MAX_OUTPUT, 0))


def _shortened(text: str, dropped: int) -> str:
    if not dropped:
        return text
    return f"{text}\n[{dropped} more characters were cut off here]\n"
