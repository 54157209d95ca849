"""Runs a notebook's code cells in this process, as a kernel would, and collects their outputs."""

# mypy: allow-untyped-calls
# IPython leaves most of its functions untyped.

from __future__ import annotations

from typing import Any

from IPython.core.displayhook import DisplayHook
from IPython.core.displaypub import DisplayPublisher
from IPython.core.interactiveshell import InteractiveShell
from IPython.utils.capture import capture_output
from traitlets import Type
from traitlets.config import Config

MAX_OUTPUT = 64 * 1024
"""Characters kept of one stream of one cell; a flood is cut, and says so."""

Output = dict[str, Any]


class _Hook(DisplayHook):
    """Keeps the value of a cell's last expression instead of printing it."""

    def write_output_prompt(self) -> None:
        """Print no prompt."""

    def write_format_data(self, format_dict: dict[str, Any], md_dict: Any = None) -> None:
        _shell_of(self).shown.append(format_dict)


class _Publisher(DisplayPublisher):
    """Keeps what a cell displays."""

    def publish(self, data: Any, *_: Any, **__: Any) -> None:
        _shell_of(self).shown.append(data)

    def clear_output(self, wait: bool = False) -> None:
        """Keep it all: the record of a run is not an animation."""


class CellShell(InteractiveShell):
    """An IPython shell that keeps what a cell shows and raises instead of printing it."""

    displayhook_class = Type(_Hook)
    display_pub_class = Type(_Publisher)

    def __init__(self, **kwargs: Any) -> None:
        """Start with nothing shown."""
        self.shown: list[dict[str, Any]] = []
        self.last_error: Output | None = None
        super().__init__(**kwargs)

    def _showtraceback(
        self, etype: type[BaseException], evalue: BaseException, stb: list[str]
    ) -> None:
        self.last_error = {
            "output_type": "error",
            "ename": getattr(etype, "__name__", str(etype)),
            "evalue": _cut(str(evalue)),
            "traceback": [_cut(line) for line in stb],
        }

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
    shell.shown.clear()
    with capture_output(display=False) as captured:
        shell.run_cell(source, store_history=True)
    outputs: list[Output] = []
    for name in ("stdout", "stderr"):
        if text := getattr(captured, name):
            outputs.append(_stream(_cut(text), name))
    room = MAX_OUTPUT
    for shown in shell.shown:
        data = {mime: value for mime, value in shown.items() if isinstance(value, str)}
        room -= sum(len(value) for value in data.values())
        if room < 0:
            outputs.append(_stream("[further outputs were cut off here]\n"))
            break
        outputs.append({"output_type": "display_data", "data": data, "metadata": {}})
    if shell.last_error is not None:
        outputs.append(shell.last_error)
    return outputs


def _stream(text: str, name: str = "stdout") -> Output:
    return {"output_type": "stream", "name": name, "text": text}


def _cut(text: str) -> str:
    if len(text) <= MAX_OUTPUT:
        return text
    return f"{text[:MAX_OUTPUT]}\n[{len(text) - MAX_OUTPUT} more characters were cut off here]\n"
