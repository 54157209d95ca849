"""What the live views cost: frames and bytes a second, the page's drawings, the kernel's processor.

Run it as ``python -m tests.benchmarks.bench_views`` in the repository's folder; ``--json`` prints
the figures for machines. A real JupyterLab and a real Chromium show a publisher at 20 Hz and at
1 kHz, by turns without views and with three of them, in one run, so that a busy machine is busy
for all. Nothing here is a test: timing is shown, never asserted.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import nbformat
from playwright.sync_api import BrowserContext

from tests import robot
from tests.browser import chromium
from tests.browser.lab import Lab
from tests.browser.notebook_page import NotebookPage
from tests.browser.test_views import SETUP

VIEWS = ('session.timeline("chatter")', "session.log_panel()", "session.graph()")
RATES = (20.0, 1000.0)  # Hz
Figures = dict[str, float]


def watch(lab: Lab, context: BrowserContext, rate: float, views: int, seconds: float) -> Figures:
    """Return the figures of one turn: a publisher at ``rate`` Hz, and so many views of it."""
    cells = [SETUP.format(rate=rate), *VIEWS[:views]]
    notebook = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_code_cell(source) for source in cells],
        metadata={"kernelspec": {"name": "python3", "display_name": "Python 3"}},
    )
    nbformat.write(notebook, lab.work / "bench.ipynb")
    page = NotebookPage(lab, context)
    page.open("bench.ipynb")
    page.run_all()
    (kernel,) = lab.kernel_processes()
    before = kernel.cpu_times()
    seen = page.watch(seconds)
    after = kernel.cpu_times()
    busy = after.user + after.system - before.user - before.system
    page.page.close()
    lab.end_kernels()
    return {
        "frames a second": len(seen.updates) / seen.seconds,
        "kilobytes a second": sum(seen.updates) / seen.seconds / 1000,
        "drawings of the page a second": seen.drawings / seen.seconds,
        "longest time without a drawing, ms": seen.longest,
        "processor of the kernel, %": 100 * busy / seen.seconds,
    }


@contextmanager
def browser() -> Iterator[BrowserContext]:
    """Give a window of a real browser."""
    with chromium.started() as running:
        yield running.new_context(viewport={"width": 1280, "height": 900})


def main() -> None:
    """Measure and print medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--rounds", type=int, default=2, help="turns of each kind")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of a turn")
    options = parser.parse_args()
    turns: dict[str, list[Figures]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder, Lab(Path(folder)) as lab, browser() as context:
        shutil.copy(robot.__file__, lab.work / "robot.py")
        for _ in range(options.rounds):
            for rate in RATES:
                for views in (0, len(VIEWS)):
                    figures = watch(lab, context, rate, views, options.seconds)
                    turns[f"{rate:g} Hz, {views} views"].append(figures)
    results = {
        title: {name: statistics.median(turn[name] for turn in own) for name in own[0]}
        for title, own in turns.items()
    }
    results["machine"] = {"cores": float(os.cpu_count() or 0), "load": os.getloadavg()[0]}
    if options.json:
        sys.stdout.write(json.dumps(results, indent=2) + "\n")
        return
    for title, figures in results.items():
        lines = [f"  {name:36} {value:10.1f}\n" for name, value in figures.items()]
        sys.stdout.write("".join([f"\n{title}\n", *lines]))


if __name__ == "__main__":
    main()
