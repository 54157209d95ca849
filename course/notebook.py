"""What `%load_ext course` adds: `%%interface`, `%ros`, news of nodes, notes of progress."""

from __future__ import annotations

import html
import weakref
from typing import Any

from rclpy.exceptions import NotInitializedException

from course.interfaces import magic
from course.ros_magic import magic as ros_magic
from course.runtime.callbacks.callback_errors import CallbackError
from course.runtime.context import close_order
from course.runtime.core_session import CoreSession
from course.workspace.journal.notes import CellNotes

_LONG_S = 3.0  # s that a callback may hold all others up before the learner is told
_INIT_TWICE = "Context.init() must only be called once"


def load_ipython_extension(shell: Any) -> None:
    """Set up a notebook's shell; IPython calls this for `%load_ext course`. Idempotent."""
    magic.register(shell)
    ros_magic.register(shell)
    unload_ipython_extension(shell)
    for session in close_order.known_sessions():
        if isinstance(session, CoreSession) and session.closed:
            _reported.unseen_news(session)  # of cells that ran before: no news of the next one
    shell.events.register("post_run_cell", _report_news)


def unload_ipython_extension(shell: Any) -> None:
    """Stop reporting; IPython calls this for `%unload_ext course`."""
    if _report_news in shell.events.callbacks["post_run_cell"]:
        shell.events.unregister("post_run_cell", _report_news)


class News:
    """Something that the learner should know, shown under the cell that has just run."""

    def __init__(self, sentence: str, detail: str = "") -> None:
        """Show `sentence`, with `detail` (a traceback) to unfold."""
        self.sentence = sentence
        self.detail = detail

    def __repr__(self) -> str:
        """Return it as text."""
        return "\n".join(part for part in (self.sentence, self.detail) if part)

    def _repr_html_(self) -> str:
        sentence = html.escape(self.sentence)
        if self.detail:
            detail = html.escape(self.detail)
            sentence = f"<details><summary>{sentence}</summary><pre>{detail}</pre></details>"
        style = "border-left:4px solid #c60;padding:.3em .8em"
        return f'<div style="{style}">{sentence}</div>'


class _Reported:
    """How much of each session's news the learner has seen."""

    def __init__(self) -> None:
        self._errors: weakref.WeakKeyDictionary[Any, dict[int, int]] = weakref.WeakKeyDictionary()
        self._transitions: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()
        self._notices: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()
        self._blocked: weakref.WeakKeyDictionary[Any, set[Any]] = weakref.WeakKeyDictionary()

    def unseen_news(self, session: CoreSession) -> list[News]:
        seen = self._errors.setdefault(session, {})
        news = []
        for index, error in enumerate(session.errors):
            if error.count > seen.get(index, 0):
                news.append(_news_about(error, again=index in seen))
                seen[index] = error.count
        latest = self._transitions.get(session, 0)
        for failure in session.failed_transitions:
            if failure.number > latest:
                self._transitions[session] = failure.number
                news.append(News(failure.what, failure.traceback))
        known = self._blocked.setdefault(session, set())
        for blocked in session.blocked_callbacks():
            # A goal may well take its time in one of several threads: only what is in the way.
            serious = blocked.reason or (blocked.holds_up and blocked.seconds > _LONG_S)
            if serious and blocked.key not in known:
                known.add(blocked.key)
                news.append(News(str(blocked)))
        told = self._notices.get(session, 0)
        news += [News(notice) for notice in session.notices[told:]]
        self._notices[session] = len(session.notices)
        return news


_reported = _Reported()
_notes = CellNotes()


def _news_about(error: CallbackError, *, again: bool) -> News:
    sentence = str(error)
    if not sentence.endswith((".", "!", "?")):
        sentence += "."  # what was raised may be a sentence already
    if again:
        return News(f"Again: {sentence}")
    return News(f"{sentence} The node goes on spinning.", error.traceback)


def _report_news(result: Any) -> None:
    from IPython.display import display

    if problem := _notes.note_cell(result):
        display(News(problem))  # type: ignore[no-untyped-call]
    error = getattr(result, "error_in_exec", None)
    if isinstance(error, RuntimeError) and _INIT_TWICE in str(error):
        display(  # type: ignore[no-untyped-call]
            News(
                "The course's session has initialised rclpy for this notebook already: leave "
                "rclpy.init() out, or call course.close() before it."
            )
        )
    if isinstance(error, NotInitializedException):
        display(  # type: ignore[no-untyped-call]
            News(
                "This node was made where rclpy was not initialised: pass its class to the "
                "session, without parentheses, as in course.run(Talker), or call course.session() "
                "first."
            )
        )
    for session in close_order.known_sessions():
        if isinstance(session, CoreSession):
            if not session.closed:
                session.take_back_stolen_nodes()
            for item in _reported.unseen_news(session):
                display(item)  # type: ignore[no-untyped-call]
