"""Do once a run what nbgrader itself does again for every submission.

Also keep what its database really raised: nbgrader itself passes on a log, which may hold anything.

For each student it compiles every HTML template. It opens the gradebook many times, and each time
it makes a new database engine, compiles its SQL from nothing and looks for every table. For each
cell it sends queries to the gradebook, and compares the schema of the cell's metadata with the
schema of schemas. Writing a student's scores and feedback spent two thirds of its time on that.
Half of what was left of feedback's went into a second reading of each page, which ours do not need.
"""

from __future__ import annotations

import hashlib
import html
import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import CodeType
from typing import Any

import nbconvert.exporters.html
import nbgrader.api
import sqlalchemy
from jinja2 import BytecodeCache, Environment, pass_context
from jinja2.bccache import Bucket
from jsonschema.exceptions import best_match
from jsonschema.validators import validator_for
from nbconvert.exporters import HTMLExporter
from nbformat import NotebookNode, from_dict
from nbgrader import nbgraderformat
from nbgrader.api import (
    Assignment,
    BaseCell,
    Comment,
    Grade,
    Gradebook,
    Notebook,
    SourceCell,
    SubmittedAssignment,
    SubmittedNotebook,
)  # fmt: skip
from sqlalchemy.exc import DataError, IntegrityError
from sqlalchemy.orm import scoped_session, sessionmaker
from traitlets.config import Config

from autograder.gradebook.feedback import feedback_page
from autograder.gradebook.safe_html import allowed_html, page_texts
from autograder.gradebook.safe_html.page_texts import Page
from autograder.gradebook.safe_html.pictures import with_pictures


class _Compiled(BytecodeCache):
    """Compiled templates of this process, by what they are made of."""

    def __init__(self) -> None:
        self._codes: dict[tuple[str, str], CodeType] = {}

    def load_bytecode(self, bucket: Bucket) -> None:
        bucket.code = self._codes.get((bucket.key, bucket.checksum))

    def dump_bytecode(self, bucket: Bucket) -> None:
        if bucket.code is not None:
            self._codes[bucket.key, bucket.checksum] = bucket.code


_compiled = _Compiled()

_open = Gradebook.__init__


TOO_LONG = "It takes too long to format this text, so it is shown as it was typed."


class FeedbackExporter(HTMLExporter):
    """The course's own page of feedback, from templates that are compiled once.

    A configuration that names another template (``c.FeedbackExporter.template_name``) has its way.
    """

    def __init__(self, config: Config | None = None, **more: Any) -> None:
        """Make an exporter as nbgrader and nbconvert do."""
        ours = Config()
        ours.FeedbackExporter.template_name = feedback_page.TEMPLATE
        ours.FeedbackExporter.extra_template_basedirs = [str(feedback_page.TEMPLATES)]
        ours.merge(config or Config())
        super().__init__(config=ours, **more)  # type: ignore[no-untyped-call]

    def from_notebook_node(
        self, nb: NotebookNode, resources: Any = None, **more: Any
    ) -> tuple[Any, dict[str, Any]]:
        """Return the page, with the pictures that lie beside the notebook in it.

        nbconvert parses each page that it has made, to give pictures a text to read aloud and to
        close the tags that were left open. What is formatted here has both already.
        """
        self._texts = Page()
        self.filters["highlight_code"] = self._colour_code
        with _in_place(nbconvert.exporters.html, "BeautifulSoup", _AsItIs):
            page, resources = super().from_notebook_node(nb, resources, **more)
        folder = resources.get("metadata", {}).get("path")
        return with_pictures(page, Path(folder)) if folder else page, resources

    def _preprocess(self, nb: NotebookNode, resources: Any) -> tuple[NotebookNode, Any]:
        nb, resources = super()._preprocess(nb, resources)  # type: ignore[no-untyped-call]
        for cell in nb.cells:
            if cell.cell_type == "raw":
                cell.source = html.escape(cell.source)
            elif cell.cell_type == "code" and not cell.metadata.get("nbgrader", {}).get("grade"):
                cell.outputs = [self._screen_output(output) for output in cell.outputs]
        resources["feedback"] = feedback_page.describe_feedback(nb, resources, self.parent)
        return nb, resources

    def default_filters(self) -> Iterator[tuple[str, Any]]:
        """Give nbconvert's filters, the slow ones made elsewhere and with bounds."""
        yield from super().default_filters()  # type: ignore[no-untyped-call]
        yield "markdown2html", self._format_markdown
        yield "strip_files_prefix", _return_unchanged  # it is done where the rest is done

    @pass_context
    def _format_markdown(self, context: Any, text: str) -> str:
        attachments = context.get("cell", {}).get("attachments", {})
        made = self._texts.format_markdown(text, attachments)
        return _as_typed(text) if made is None else made

    def _colour_code(self, text: str, language: Any = None, metadata: Any = None) -> str:
        chosen = language or (metadata or {}).get("magics_language") or "ipython3"
        made = self._texts.highlight_code(text or " ", str(chosen))
        return _as_typed(text) if made is None else made

    def _screen_output(self, output: NotebookNode) -> NotebookNode:
        return from_dict(allowed_html.screen_output(output, self._texts))  # type: ignore[no-untyped-call,no-any-return]

    def _create_environment(self) -> Environment:
        environment: Environment = super()._create_environment()  # type: ignore[no-untyped-call]
        environment.bytecode_cache = _compiled
        return environment

    @staticmethod
    def is_warm() -> bool:
        """Whether templates have been compiled: for feedback that was written, or a warm-up."""
        return bool(_compiled._codes)

    @classmethod
    def warm_up(cls, notebook: NotebookNode) -> None:
        """Compile what feedback is made with, by rendering a ``notebook`` for nobody.

        What highlights code and renders Markdown is warm then, too.
        """
        page_texts.warm_up()
        with suppress(Exception):  # only time is lost: where it matters, nbgrader meets it, too
            cls().from_notebook_node(notebook)


def _return_unchanged(text: str) -> str:
    return text


def _as_typed(text: str) -> str:
    return f"<p><em>{TOO_LONG}</em></p><pre>{html.escape(allowed_html.shorten_text(text))}</pre>"


class _AsItIs(str):
    """A page in place of its parsed form, in which nothing is to be changed."""

    def __new__(cls, page: str, **_: Any) -> _AsItIs:
        return super().__new__(cls, page)

    def select(self, _selector: str) -> tuple[()]:
        """Find nothing."""
        return ()


@contextmanager
def _in_place(owner: Any, name: str, ours: Any) -> Iterator[None]:
    """Have an attribute of a library's be ours for the block."""
    own = getattr(owner, name)
    setattr(owner, name, ours)
    try:
        yield
    finally:
        setattr(owner, name, own)


class _Schemas:
    """Compares data with schemas as `jsonschema` does, but looks once whether one is sound.

    Also once at what is equal: the cells of an assignment have the same metadata at each student.
    """

    def __init__(self) -> None:
        self._validators: dict[str, Any] = {}
        self._valid: set[bytes] = set()  # digests of data and schemas

    def validate(self, instance: Any, schema: Any) -> None:
        """Raise ValidationError unless ``instance`` follows a ``schema``."""
        text = json.dumps(schema)
        both = hashlib.sha256(json.dumps([instance, text]).encode()).digest()
        if both in self._valid:
            return
        if text not in self._validators:
            kind = validator_for(schema)
            kind.check_schema(schema)
            self._validators[text] = kind(schema)
        error = best_match(self._validators[text].iter_errors(instance))
        if error is not None:
            raise error
        self._valid.add(both)


_schemas = _Schemas()


Rows = Callable[[Any, tuple[str, ...]], Iterable[tuple[str, Any]]]
"""Returns what a database has of a notebook, or of one handed in, by the names of its cells."""


def _finds_at_once(find: Callable[..., Any], rows: Rows) -> Callable[..., Any]:
    """Return a replacement for ``find`` whose first call reads the rows of all cells of a notebook.

    The open gradebook keeps them for the calls that follow.
    """

    def find_kept(gradebook: Any, cell: str, *where: str) -> Any:
        known = vars(gradebook).setdefault(rows.__name__, {})
        if where not in known:
            known[where] = dict(rows(gradebook.db, where))
        row = known[where].get(cell)
        return find(gradebook, cell, *where) if row is None else row

    return find_kept


def _query_grades(db: Any, where: tuple[str, ...]) -> Iterable[tuple[str, Any]]:
    return _of_a_submission(db, Grade, *where)


def _query_comments(db: Any, where: tuple[str, ...]) -> Iterable[tuple[str, Any]]:
    return _of_a_submission(db, Comment, *where)


def _of_a_submission(
    db: Any, kind: Any, notebook: str, assignment: str, student: str
) -> Iterable[tuple[str, Any]]:
    query = db.query(BaseCell.name, kind).join(kind, kind.cell_id == BaseCell.id)
    query = query.join(SubmittedNotebook, SubmittedNotebook.id == kind.notebook_id)
    query = query.join(Notebook, Notebook.id == SubmittedNotebook.notebook_id)
    query = query.join(
        SubmittedAssignment, SubmittedAssignment.id == SubmittedNotebook.assignment_id
    )
    query = query.join(Assignment, Assignment.id == SubmittedAssignment.assignment_id)
    found: Iterable[tuple[str, Any]] = query.filter(
        Notebook.name == notebook,
        Assignment.name == assignment,
        SubmittedAssignment.student_id == student,
    ).all()
    return found


def _source_cells(db: Any, where: tuple[str, ...]) -> Iterable[tuple[str, Any]]:
    notebook, assignment = where
    query = db.query(SourceCell.name, SourceCell)
    query = query.join(Notebook, Notebook.id == SourceCell.notebook_id)
    query = query.join(Assignment, Assignment.id == Notebook.assignment_id)
    found: Iterable[tuple[str, Any]] = query.filter(
        Notebook.name == notebook, Assignment.name == assignment
    ).all()
    return found


FINDS = {
    "find_grade": _query_grades, "find_comment": _query_comments, "find_source_cell": _source_cells,
}  # fmt: skip
"""What nbgrader asks a gradebook for, cell by cell, and what answers for all cells at once."""


class Engines:
    """One database engine for each gradebook, in place of one for each time that it is opened."""

    def __init__(self) -> None:
        """Have none yet."""
        self._engines: dict[str, Any] = {}
        self._found: set[tuple[object, ...] | None] = set()
        self._raised: list[str] = []

    @property
    def raised_errors(self) -> str:
        """What the database raised since nbgrader last began to use these engines."""
        return "\n".join(self._raised)

    def get_engine(self, url: str, **options: Any) -> Any:
        """Return the engine for ``url``; ``options`` are those of `sqlalchemy.create_engine`."""
        if url not in self._engines:
            engine = sqlalchemy.create_engine(url, **{"future": True, **options})
            sqlalchemy.event.listen(engine, "handle_error", self._note_error)
            self._engines[url] = engine
        return self._engines[url]

    @contextmanager
    def use_engines(self, *, of_one_pass: bool = False) -> Iterator[None]:
        """Have nbgrader use these engines. What it closes, an engine opens again when needed.

        Args:
            of_one_pass: whether a gradebook is opened for one pass over a notebook that was handed
                in, in which no cell of the assignment comes or goes: what has been found there
                is not looked for, or read, again.
        """
        self._raised.clear()

        def open_(
            gradebook: Any,
            db_url: str,
            course_id: str = "default_course",
            authenticator: Any = None,
        ) -> None:
            known = self._identify_course(db_url, course_id)
            if known is None or known not in self._found:
                _open(gradebook, db_url, course_id, authenticator)
                self._found.add(self._identify_course(db_url, course_id))
                return
            gradebook.engine = self.get_engine(db_url)
            session = sessionmaker(
                bind=gradebook.engine, future=True, expire_on_commit=not of_one_pass
            )
            gradebook.db = scoped_session(session)
            gradebook.course_id, gradebook.authenticator = course_id, authenticator

        with (
            _in_place(nbgrader.api, "create_engine", self.get_engine),
            _in_place(Gradebook, "__init__", open_),
            _in_place(nbgraderformat.common, "jsonschema", _schemas),
            ExitStack() as finds,
        ):
            for name, rows in FINDS.items() if of_one_pass else ():
                find = _finds_at_once(getattr(Gradebook, name), rows)
                finds.enter_context(_in_place(Gradebook, name, find))
            yield

    def _identify_course(self, url: str, course: str) -> tuple[object, ...] | None:
        """Return which course in which file is meant, if it is there: it may be replaced."""
        try:
            status = Path(self.get_engine(url).url.database or "").stat()
        except OSError:
            return None
        return url, course, status.st_dev, status.st_ino

    def _note_error(self, context: Any) -> None:
        # An entry that contradicts another one says nothing about the database.
        if not isinstance(context.sqlalchemy_exception, (IntegrityError, DataError)):
            self._raised.append(str(context.original_exception))
