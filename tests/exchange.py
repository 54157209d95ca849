"""nbgrader's exchange with students who are folders: what they submit and fetch goes through it."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

import nbformat
from nbformat import NotebookNode
from nbgrader.auth import Authenticator
from nbgrader.coursedir import CourseDirectory
from nbgrader.exchange.default import (
    Exchange,
    ExchangeFetchFeedback,
    ExchangeReleaseAssignment,
    ExchangeSubmit,
)
from traitlets.config import Config

COURSE = "ros2-course"


@dataclass(frozen=True)
class StudentExchange:
    """An exchange at ``root``, of the course at ``course``; students' homes lie in ``homes``."""

    root: Path
    course: Path
    homes: Path
    assignment: str

    def release(self) -> None:
        """Hand the assignment out, and have the course know the exchange.

        All students are the user that runs this, as on a hub in one container.
        """
        self.root.mkdir()
        self.root.chmod(0o777)
        with (self.course / "nbgrader_config.py").open("a") as config:
            config.write(
                f"\nc.Exchange.root = {str(self.root)!r}\nc.ExchangeCollect.check_owner = False\n"
            )
        self._run(ExchangeReleaseAssignment, "", root=str(self.course))

    def submit(self, student: str, notebook: NotebookNode | str, name: str) -> Path:
        """Have a student hand in; return what lies in the exchange then."""
        work = self.homes / student / self.assignment
        work.mkdir(parents=True, exist_ok=True)
        if isinstance(notebook, str):
            (work / f"{name}.ipynb").write_text(notebook, encoding="utf-8")
        else:
            nbformat.write(notebook, work / f"{name}.ipynb")
        before = {*self.inbound.iterdir()}
        self._run(ExchangeSubmit, student)
        [path] = {*self.inbound.iterdir()} - before
        return path

    @property
    def inbound(self) -> Path:
        return self.root / COURSE / "inbound"

    def fetch_feedback(self, student: str) -> dict[str, str]:
        """Have a student fetch; return {time of submission: page}, of all that there is."""
        if (self.root / COURSE / "feedback").is_dir():  # or nbgrader says so
            self._run(ExchangeFetchFeedback, student)
        folder = self.homes / student / self.assignment / "feedback"
        return {p.parent.name: p.read_text(encoding="utf-8") for p in folder.rglob("*.html")}

    def _run(self, of: type[Exchange], student: str, root: str = "") -> None:
        home = self.homes / student
        config = Config()
        config.Exchange.root = str(self.root)
        config.Exchange.cache = str(home / "cache")
        config.Exchange.assignment_dir = str(home)
        config.CourseDirectory.course_id = COURSE
        config.CourseDirectory.assignment_id = self.assignment
        config.CourseDirectory.root = root or str(home)
        if student:
            config.CourseDirectory.student_id = student
        course = CourseDirectory(config=config)
        at_work = of(coursedir=course, authenticator=Authenticator(config=config), config=config)
        at_work.log = logging.getLogger("exchange of the tests")
        at_work.start()
