"""A real JupyterLab of its own for tests: a free port, and folders that nobody else uses."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

import psutil

START_TIMEOUT = 300.0


JUPYTERLAB = (sys.executable, "-m", "jupyterlab")
COURSE_LAB = (
    sys.executable,
    "-c",
    "from course.command_line.launch import course; course()",
    "lab",
)


class Lab:
    """A running JupyterLab; ``work`` is its folder of notebooks. Use it as a context manager.

    With ``by_course`` it is started as a student does, by ``course lab``, which makes ``work``.
    """

    def __init__(self, folder: Path, work: Path | None = None, *, by_course: bool = False) -> None:
        self.work = work or folder / "work"
        self._by_course = by_course
        # Jupyter's connection files are Unix paths of at most 107 bytes: a short place of its own.
        self._runtime = tempfile.TemporaryDirectory(prefix="lab-")
        self._log = folder / "lab.log"
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        places = {name: folder / name for name in ("config", "data", "ipython", "home")}
        for place in (self.work, *places.values()):
            place.mkdir(parents=True, exist_ok=True)
        self._environment = {
            **{k: v for k, v in os.environ.items() if k != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"},
            "JUPYTER_CONFIG_DIR": str(places["config"]), "JUPYTER_DATA_DIR": str(places["data"]),
            "JUPYTER_RUNTIME_DIR": self._runtime.name, "IPYTHONDIR": str(places["ipython"]),
            "JUPYTERLAB_SETTINGS_DIR": str(places["config"] / "lab" / "user-settings"),
            "JUPYTERLAB_WORKSPACES_DIR": str(places["config"] / "lab" / "workspaces"),
            "ROS_LOG_DIR": str(places["home"] / "log"), "PYDEVD_DISABLE_FILE_VALIDATION": "1",
        }  # fmt: skip
        self.settings("@jupyterlab/apputils-extension", "notification", {
            "checkForUpdates": False, "fetchNews": "false", "doNotDisturbMode": True,
        })  # fmt: skip

    def settings(self, extension: str, plugin: str, values: dict[str, Any]) -> None:
        """Write a user's settings of JupyterLab; a page that is loaded later follows them."""
        place = Path(self._environment["JUPYTERLAB_SETTINGS_DIR"]) / extension
        place.mkdir(parents=True, exist_ok=True)
        (place / f"{plugin}.jupyterlab-settings").write_text(json.dumps(values))

    def __enter__(self) -> Lab:
        start = (*COURSE_LAB, str(self.work)) if self._by_course else JUPYTERLAB
        command = [
            *start, "--no-browser", "--expose-app-in-browser",
            "--ip=127.0.0.1", f"--port={self.port}",
            "--ServerApp.port_retries=0", "--IdentityProvider.token=", "--allow-root",
            "--ServerApp.password=", "--ServerApp.disable_check_xsrf=True",
            "--LabApp.news_url=None", "--LabApp.check_for_updates_class="
            "jupyterlab.NeverCheckForUpdate",
        ]  # fmt: skip
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                command, cwd=self.work, env=self._environment, stdin=subprocess.DEVNULL,
                stdout=log, stderr=subprocess.STDOUT,
            )  # fmt: skip
        self._wait_until_up()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        self._process.terminate()
        try:
            self._process.wait(timeout=30)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._runtime.cleanup()

    def log(self) -> str:
        """Return what the server has said."""
        return self._log.read_text(errors="replace")

    def kernels(self) -> list[dict[str, Any]]:
        """Return the server's running kernels."""
        found: list[dict[str, Any]] = self._request("GET", "/api/kernels")
        return found

    def kernel_processes(self) -> list[psutil.Process]:
        """Return the processes of the running kernels."""
        children = psutil.Process(self._process.pid).children(recursive=True)
        return [child for child in children if "ipykernel_launcher" in " ".join(child.cmdline())]

    def end_kernels(self) -> None:
        """Shut down every kernel; each test begins without."""
        for kernel in self.kernels():
            self._request("DELETE", f"/api/kernels/{kernel['id']}")

    def _request(self, method: str, path: str) -> Any:
        request = urllib.request.Request(f"{self.url}{path}", method=method)
        with urllib.request.urlopen(request, timeout=30) as response:
            content = response.read()
        return json.loads(content) if content else None

    def _wait_until_up(self) -> None:
        def up() -> bool:
            if self._process.poll() is not None:
                raise RuntimeError(f"JupyterLab ended at its start:\n{self.log()[-4000:]}")
            try:
                self._request("GET", "/api/status")
            except (urllib.error.URLError, OSError):
                return False
            return True

        until(up, START_TIMEOUT, lambda: f"JupyterLab did not start:\n{self.log()[-4000:]}")


def until(condition: Callable[[], bool], timeout: float, failure: Callable[[], str]) -> None:
    """Wait for something outside of a page; raises AssertionError at the deadline."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(failure())
        time.sleep(0.05)  # between two looks at the condition


def free_port() -> int:
    """Return a port of this machine that nobody listens on just now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
