"""A notebook open in JupyterLab in a real browser, and everything that went over its wires."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

from playwright.sync_api import BrowserContext, Locator, Request, WebSocket

from .lab import Lab

TIMEOUT = 240_000
"""Milliseconds until a condition in the page counts as one that never comes; the machine may be
busy with much else."""

LOCAL = {"127.0.0.1", "localhost"}


@dataclass(frozen=True)
class Watched:
    """What went to a page in a while, and how it coped.

    Attributes:
        seconds: how long it was watched.
        updates: sizes in bytes of the widget updates that came in.
        longest: the longest time in ms between two drawings of the page.
        drawings: how often the page was drawn.
    """

    seconds: float
    updates: list[int]
    longest: float
    drawings: int


class NotebookPage:
    """One browser window on one notebook. It records requests, frames and console errors."""

    def __init__(self, lab: Lab, context: BrowserContext) -> None:
        self.lab = lab
        self.requests: list[str] = []
        self.frames: list[str] = []
        self.errors: list[str] = []
        self.page = context.new_page()
        self.page.set_default_timeout(TIMEOUT)
        self.page.on("request", self._on_request)
        self.page.on("websocket", self._on_websocket)
        self.page.on("console", self._on_console)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.path = ""

    def open(self, path: str) -> None:
        """Open a notebook of the work folder and wait until its kernel is idle."""
        self.path = path
        self.page.goto(f"{self.lab.url}/lab/tree/{quote(path)}?reset")
        self.wait_until_ready()

    def open_first(self, name: str) -> None:
        """Go where the server sends a browser at its start, and wait for the notebook ``name``."""
        self.path = name
        self.page.goto(f"{self.lab.url}/")
        self.wait_until_ready()

    def follow(self, link: Locator, path: str) -> None:
        """Click on a link to a notebook of the work folder and wait for it."""
        link.click()
        self.path = path
        self.wait_until_ready()

    def reload(self) -> None:
        """Reload the page, as F5 does."""
        self.page.reload()
        self.wait_until_ready()

    def wait_until_ready(self) -> None:
        """Wait for the notebook, for its kernel to be idle, and for the start screen to go."""
        name = self.path.rpartition("/")[2]
        self.page.wait_for_function(
            """name => {
                const panel = window.jupyterapp?.shell?.currentWidget;
                return panel?.context?.isReady && panel.title.label === name &&
                    panel.sessionContext.isReady &&
                    panel.sessionContext.session?.kernel?.connectionStatus === 'connected' &&
                    panel.sessionContext.session.kernel.status === 'idle';
            }""",
            arg=name,
        )
        self.page.locator("#jupyterlab-splash").wait_for(state="detached")

    def command(self, name: str, arguments: dict[str, Any] | None = None) -> None:
        """Run one of JupyterLab's commands and wait until it is done."""
        self.page.evaluate(
            "async ([name, args]) => { await window.jupyterapp.commands.execute(name, args) }",
            [name, arguments or {}],
        )

    def run_cell(self, number: int) -> None:
        """Run one cell, counted from 0, and wait until the kernel has finished it."""
        self.page.evaluate(
            "number => { window.jupyterapp.shell.currentWidget.content.activeCellIndex = number }",
            number,
        )
        self.command("notebook:run-cell")
        self.wait_until_ready()

    def start_cell(self, number: int) -> None:
        """Run one cell, counted from 0, and do not wait."""
        self.page.evaluate(
            """number => {
                window.jupyterapp.shell.currentWidget.content.activeCellIndex = number;
                window.jupyterapp.commands.execute('notebook:run-cell');
            }""",
            number,
        )

    def write_cell(self, number: int, source: str) -> None:
        """Replace what stands in a cell, counted from 0."""
        self.page.evaluate(
            "([number, source]) => { window.jupyterapp.shell.currentWidget.content.widgets[number]"
            ".model.sharedModel.setSource(source) }",
            [number, source],
        )

    def run_all(self) -> None:
        """Run all cells and wait until the kernel has finished them."""
        self.command("notebook:run-all-cells")
        self.wait_until_ready()

    def restart_kernel(self) -> None:
        """Restart the kernel, and wait until it is ready again."""
        self.page.evaluate(
            "async () => { await window.jupyterapp.shell.currentWidget.sessionContext"
            ".restartKernel() }"
        )
        self.wait_until_ready()

    def wait_for_kernel(self, status: str) -> None:
        """Wait until the kernel is "busy" or "idle"."""
        self.page.wait_for_function(
            "status => window.jupyterapp.shell.currentWidget.sessionContext.session.kernel"
            ".status === status",
            arg=status,
        )

    def save(self) -> dict[str, Any]:
        """Save the notebook; return what stands in its file."""
        self.command("docmanager:save")
        content: dict[str, Any] = json.loads((self.lab.work / self.path).read_text())
        return content

    def scroll_to(self, number: int) -> None:
        """Bring a cell, counted from 0, into sight."""
        self.page.evaluate(
            "number => window.jupyterapp.shell.currentWidget.content.scrollToItem(number, 'start')",
            number,
        )

    def cell(self, number: int) -> Locator:
        """Return a cell of the notebook, counted from 0."""
        return self.page.locator(f'.jp-Notebook [data-windowed-list-index="{number}"]')

    def cell_count(self) -> int:
        """Return how many cells the notebook has."""
        count: int = self.page.evaluate(
            "() => window.jupyterapp.shell.currentWidget.content.widgets.length"
        )
        return count

    def cells(self) -> list[str]:
        """Return the sources of the cells."""
        sources: list[str] = self.page.evaluate(
            "() => window.jupyterapp.shell.currentWidget.content.widgets"
            ".map(cell => cell.model.sharedModel.getSource())"
        )
        return sources

    def watch(self, seconds: float) -> Watched:
        """Look at the page for so many seconds; see `Watched`."""
        self.frames.clear()
        passed, longest, drawings = self.page.evaluate(
            """most => new Promise(resolve => {
                const start = performance.now();
                let last = start, longest = 0, drawings = 0;
                const tick = now => {
                    longest = Math.max(longest, now - last);
                    last = now;
                    drawings += 1;
                    if (now - start < most) requestAnimationFrame(tick);
                    else resolve([(now - start) / 1000, longest, drawings]);
                };
                requestAnimationFrame(tick);
            })""",
            seconds * 1000,
        )
        updates = [f for f in self.frames if '"comm_msg"' in f and '"update"' in f]
        return Watched(passed, [len(frame) for frame in updates], longest, drawings)

    def theme(self, name: str) -> None:
        """Choose a theme ("JupyterLab Dark") and wait until it is on."""
        self.command("apputils:change-theme", {"theme": name})
        self.page.locator(f'body[data-jp-theme-name="{name}"]').wait_for(state="attached")
        self.page.locator("#jupyterlab-splash").wait_for(state="detached")

    def foreign_requests(self) -> list[str]:
        """Return the requests to anywhere but this machine."""
        return [
            url for url in self.requests
            if urlsplit(url).scheme not in ("data", "blob") and urlsplit(url).hostname not in LOCAL
        ]  # fmt: skip

    def screenshot(self, path: Path) -> None:
        """Write what the window shows to a PNG file."""
        self.page.screenshot(path=path)

    def _on_request(self, request: Request) -> None:
        self.requests.append(request.url)

    def _on_websocket(self, socket: WebSocket) -> None:
        self.requests.append(socket.url.replace("ws://", "http://", 1))
        for event in ("framereceived", "framesent"):
            socket.on(event, self._on_frame)

    def _on_frame(self, payload: str | bytes) -> None:
        self.frames.append(
            payload if isinstance(payload, str) else payload.decode("utf-8", "replace")
        )

    def _on_console(self, message: Any) -> None:
        if message.type == "error":
            where = re.sub(r"\?.*", "", message.location.get("url", ""))
            self.errors.append(f"{message.text} ({where})")
