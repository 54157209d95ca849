"""Find a Chromium, or fetch one, and start it."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Browser, Error, Playwright, sync_playwright

INSTALLED = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ARGUMENTS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--disable-background-networking",
    "--disable-dev-shm-usage",
]  # fmt: skip
FETCH_TIMEOUT = 900.0  # s, for some 100 MB
PLAYWRIGHT = (sys.executable, "-m", "playwright")
FETCH = (*PLAYWRIGHT, "install", "--only-shell", "chromium")
MISSING = "error while loading shared libraries: "


class NoBrowserError(Exception):
    """There is no Chromium here, and none could be fetched; says why, and what to do."""


@contextmanager
def started() -> Iterator[Browser]:
    """Give a running browser: the machine's, or else the one that Playwright fetches.

    Raises:
        NoBrowserError: If there is none and none could be fetched, or it does not start.
    """
    tried = subprocess.run([*PLAYWRIGHT, "--version"], capture_output=True, text=True)
    if tried.returncode:
        raise _nothing(f"Playwright does not start ({_cause(tried.stderr)})")
    path = next((found for name in INSTALLED if (found := shutil.which(name))), None)
    with sync_playwright() as playwright:
        browser = _launch(playwright, path) if path else _launch_fetched(playwright)
        yield browser
        browser.close()


def _launch_fetched(playwright: Playwright) -> Browser:
    try:
        fetched = subprocess.run(FETCH, capture_output=True, text=True, timeout=FETCH_TIMEOUT)
    except subprocess.TimeoutExpired:
        raise _nothing(f"its download took more than {FETCH_TIMEOUT:g} s") from None
    if fetched.returncode:
        errors = [line for line in fetched.stderr.splitlines() if line.startswith("Error: ")]
        said = errors[-1].removeprefix("Error: ") if errors else f"exit {fetched.returncode}"
        raise _nothing(f"its download failed ({said})")
    return _launch(playwright, None)


def _launch(playwright: Playwright, path: str | None) -> Browser:
    try:
        return playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
    except Error as error:
        raise _nothing(
            f"{path or 'the fetched one'} does not start ({_cause(error.message)})"
        ) from None


def _cause(text: str) -> str:
    first, missing, library = text.strip().partition(MISSING)
    return missing + (library or first or "no reason was given").splitlines()[0].strip()


def _nothing(why: str) -> NoBrowserError:
    return NoBrowserError(f"no Chromium: {why}; install one (Debian: sudo apt install chromium)")
