"""What `%load_ext course` adds: `%%interface`, `%ros`, news of nodes, notes of progress."""

from __future__ import annotations

from typing import Any

from course.cell_news.errors import explain_error
from course.cell_news.news import News
from course.cell_news.session_news import SessionNews
from course.cell_news.spin_watch import SpinWatch
from course.interfaces import magic
from course.ros_magic import magic as ros_magic
from course.runtime.context import close_order
from course.runtime.core_session import CoreSession
from course.workspace.journal.notes import CellNotes


def load_ipython_extension(shell: Any) -> None:
    """Set up a notebook's shell; IPython calls this for `%load_ext course`. Idempotent."""
    magic.register(shell)
    ros_magic.register(shell)
    unload_ipython_extension(shell)
    for session in close_order.known_sessions():
        if isinstance(session, CoreSession) and session.closed:
            _news.unseen_news(session)  # of cells that ran before: no news of the next one
    shell.events.register("pre_run_cell", _watch.begin_cell)
    shell.events.register("post_run_cell", _report_news)


def unload_ipython_extension(shell: Any) -> None:
    """Stop reporting; IPython calls this for `%unload_ext course`."""
    for event, callback in (("pre_run_cell", _watch.begin_cell), ("post_run_cell", _report_news)):
        if callback in shell.events.callbacks[event]:
            shell.events.unregister(event, callback)


_news = SessionNews()
_watch = SpinWatch()
_notes = CellNotes()


def _report_news(result: Any) -> None:
    from IPython.display import display

    _watch.end_cell()
    if problem := _notes.note_cell(result):
        display(News(problem))  # type: ignore[no-untyped-call]
    if hint := explain_error(getattr(result, "error_in_exec", None)):
        display(News(hint))  # type: ignore[no-untyped-call]
    for session in close_order.known_sessions():
        if isinstance(session, CoreSession):
            if not session.closed:
                session.take_back_stolen_nodes()
            for item in _news.unseen_news(session):
                display(item)  # type: ignore[no-untyped-call]
