"""A real JupyterHub with its proxy and Unix users, configured by `autograder new hub`."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import Any

import psutil
import requests
from playwright.sync_api import BrowserContext

from autograder.hub import new_hub
from tests.people import People

from .lab import free_port, until

PROXY = "configurable-http-proxy"
PASSWORD = "a password of the tests"
START_TIMEOUT_S = 120.0

GRADERS = {"robots-a": "grader-a", "robots-b": "grader-b"}
"""{course: who grades it}, as the template has it."""


TOOLS = Path(sys.executable).parent
"""Where the commands of the course are."""


def problem() -> str:
    """Say why there can be no hub here; empty if there can."""
    if missing := [m for m in ("jupyterhub", "jupyterhub_idle_culler") if find_spec(m) is None]:
        return f"{missing[0]} is not installed, of the extra `hub`."
    if shutil.which(PROXY) is None:
        return f"The hub's proxy is missing: npm install --global {PROXY}"
    return ""


@dataclass(frozen=True)
class Server:
    """What a `NotebookPage` needs to know: a user's server, and the folder that it shows."""

    url: str
    work: Path


class Hub:
    """A running hub for some people; use it as a context manager.

    ``members`` is {course: {"instructors": names, "students": names}}.
    """

    def __init__(self, folder: Path, members: dict[str, dict[str, list[str]]]) -> None:
        everybody = {n for groups in members.values() for names in groups.values() for n in names}
        proxy = Path(shutil.which(PROXY) or PROXY).resolve()
        names = [*GRADERS.values(), *sorted(everybody)]
        folder.mkdir()
        self.people = People(folder, names, [proxy.parents[2]])
        self.people.set_passwords(PASSWORD)
        self.exchange = folder / "exchange"
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._log = folder / "hub.log"
        self.folder = new_hub.make_hub(folder / "hub", self.exchange, Path(sys.executable))
        self._write_settings(members)
        with (self.folder / "jupyterhub_config.py").open("a", encoding="utf-8") as config:
            config.write(
                f"\nc.ConfigurableHTTPProxy.command = [{str(proxy)!r}]\n"
                f"c.ConfigurableHTTPProxy.api_url = 'http://127.0.0.1:{free_port()}'\n"
                f"c.JupyterHub.hub_port = {free_port()}\n"
                # For `NotebookPage`, which runs JupyterLab's commands.
                "c.Spawner.args = ['--LabApp.expose_app_in_browser=True']\n"
            )

    def course_root(self, course: str) -> Path:
        """Return where a course is graded."""
        return self.people[GRADERS[course]].home / "course"

    def run_as_grader(self, course: str, *command: str) -> str:
        """Run ``autograder`` or ``nbgrader`` in a course root, as its terminal on the hub does."""
        tool = str(TOOLS / command[0])
        return self.people.run(GRADERS[course], tool, *command[1:], cwd=self.course_root(course))

    def __enter__(self) -> Hub:
        self._process = self.people.start(
            "root", sys.executable, "-m", "jupyterhub", cwd=self.folder, log=self._log
        )

        def up() -> bool:
            if self._process.poll() is not None:
                raise RuntimeError(f"The hub ended at its start:\n{self.log()[-4000:]}")
            return "JupyterHub is now running" in self.log()

        until(up, START_TIMEOUT_S, lambda: f"The hub did not start:\n{self.log()[-4000:]}")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        send_signal(self._process, signal.SIGTERM)  # it ends servers, services and proxy
        try:
            self._process.wait(timeout=60)
        finally:
            self._process.kill()
            self._process.wait()

    def log(self) -> str:
        """Return what the hub and the servers have said."""
        return self._log.read_text(errors="replace")

    def sign_in(self, context: BrowserContext, name: str) -> None:
        """Sign somebody in, in a browser, by the hub's own page."""
        page = context.new_page()
        page.goto(f"{self.url}/hub/login?next=/hub/home")
        page.get_by_label("Username").fill(name)
        page.get_by_label("Password").fill(PASSWORD)
        page.get_by_role("button", name="Sign in").click()
        page.wait_for_url(lambda url: "/hub/login" not in url)
        page.close()

    def server_of(self, name: str) -> Server:
        """Return the address and the folder of a user's server."""
        return Server(f"{self.url}/user/{name}", self.people[name].home)

    def _write_settings(self, members: dict[str, dict[str, list[str]]]) -> None:
        file = self.folder / "hub.toml"
        text = file.read_text(encoding="utf-8").replace("port = 8000", f"port = {self.port}")
        for number, (course, grader) in enumerate(GRADERS.items(), 1):
            text = text.replace(f"port = {9000 + number}", f"port = {free_port()}")
            text = text.replace(f"/home/{grader}/course", str(self.course_root(course)))
            head, mark, tail = text.partition(f"[courses.{course}]")
            for group in ("instructors", "students"):
                names = json.dumps(members.get(course, {}).get(group, []))
                tail = tail.replace(f"{group} = []", f"{group} = {names}", 1)
            text = head + mark + tail
        tomllib.loads(text)
        file.write_text(text, encoding="utf-8")


class StudentClient:
    """A student who uses the hub and their server by HTTP, as the pages' scripts do."""

    def __init__(self, hub: Hub, name: str) -> None:
        """Sign in, and start the server."""
        self._hub, self._name = hub, name
        self._session = requests.Session()
        self._session.get(f"{hub.url}/hub/login", timeout=60)
        token = self._token("/hub/")
        form = {"username": name, "password": PASSWORD, "_xsrf": token}
        self._session.post(f"{hub.url}/hub/login", data=form, timeout=60)
        self._session.get(f"{hub.url}/hub/spawn", timeout=60)
        self._wait_for_server()

    def assignments(self, course: str) -> list[dict[str, Any]]:
        """Return what the student's assignment list shows of a course."""
        return self._call("GET", f"assignments?course_id={course}")

    def act(self, action: str, course: str, assignment: str) -> list[dict[str, Any]]:
        """Press a button of the list: "fetch", "submit" or "fetch_feedback"."""
        data = {"course_id": course, "assignment_id": assignment}
        return self._call("POST", f"assignments/{action}", json=data)

    def _call(self, method: str, path: str, **options: Any) -> list[dict[str, Any]]:
        headers = {"X-XSRFToken": self._token(f"/user/{self._name}/")}
        answer = self._session.request(
            method, f"{self._hub.url}/user/{self._name}/{path}", headers=headers, timeout=120,
            **options,
        )  # fmt: skip
        answer.raise_for_status()
        said = answer.json()
        assert said["success"], said
        value: list[dict[str, Any]] = said["value"]
        return value

    def _wait_for_server(self) -> None:
        def is_up() -> bool:
            answer = self._session.get(f"{self._hub.url}/user/{self._name}/lab", timeout=60)
            return answer.ok and f"/user/{self._name}/" in answer.url and "spawn" not in answer.url

        until(is_up, START_TIMEOUT_S, lambda: self._hub.log()[-4000:])

    def _token(self, path: str) -> str:
        found = [c.value for c in self._session.cookies if c.name == "_xsrf" and c.path == path]
        return str(found[0]) if found else ""


def send_signal(process: subprocess.Popen[str], number: int) -> None:
    """Send a signal to a command that `People.start` has started.

    The signal goes to the command, not to bwrap around it: if bwrap ends, it kills the command.
    """
    found = psutil.Process(process.pid)
    [command] = found.children() if found.name() == "bwrap" else [found]
    command.send_signal(number)
