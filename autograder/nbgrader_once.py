"""What nbgrader does anew for every submission, and need do only once a run.

And what its database really raised: nbgrader itself passes on a log, in which anything may stand.

Its converters compile every HTML template for each student, and each of its many openings of the
gradebook makes a database engine of its own, whose SQL is then compiled from nothing. Both took
half of the time in which a student's scores and feedback are written.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import CodeType
from typing import Any

import nbgrader.api
import sqlalchemy
from jinja2 import BytecodeCache, Environment
from jinja2.bccache import Bucket
from nbconvert.exporters import HTMLExporter
from nbformat import NotebookNode
from sqlalchemy.exc import DataError, IntegrityError


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


class FeedbackExporter(HTMLExporter):
    """nbconvert's HTML, from templates that are compiled once."""

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

        nbgrader's template is one of nbconvert's ``classic``, with which most of it is compiled,
        and what highlights code and renders Markdown as well.
        """
        with suppress(Exception):  # only time is lost: where it matters, nbgrader meets it, too
            cls(template_name="classic").from_notebook_node(notebook)


class Engines:
    """One database engine for each gradebook, in place of one for each time that it is opened."""

    def __init__(self) -> None:
        """Have none yet."""
        self._engines: dict[str, Any] = {}
        self._raised: list[str] = []

    @property
    def raised(self) -> str:
        """What the database raised since nbgrader last began to use these engines."""
        return "\n".join(self._raised)

    def engine(self, url: str, **options: Any) -> Any:
        """Return the engine for ``url``; ``options`` are those of `sqlalchemy.create_engine`."""
        if url not in self._engines:
            engine = sqlalchemy.create_engine(url, **options)
            sqlalchemy.event.listen(engine, "handle_error", self._note)
            self._engines[url] = engine
        return self._engines[url]

    @contextmanager
    def shared(self) -> Iterator[None]:
        """Have nbgrader use these engines. What it closes, an engine opens again when needed."""
        self._raised.clear()
        own = nbgrader.api.create_engine
        nbgrader.api.create_engine = self.engine
        try:
            yield
        finally:
            nbgrader.api.create_engine = own

    def _note(self, context: Any) -> None:
        # An entry that contradicts another one says nothing about the database.
        if not isinstance(context.sqlalchemy_exception, (IntegrityError, DataError)):
            self._raised.append(str(context.original_exception))
