"""What nodes did that a learner should know: raised, blocked, printed, or failed to connect."""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from typing import Generic, TypeVar

from course.cell_news.news import News
from course.graph import graph_text, reader
from course.runtime.callbacks.callback_errors import CallbackError
from course.runtime.core_session import CoreSession

_LONG_S = 3.0  # s that a callback may hold all others up before the learner is told
_SHOWN_LINES = 10  # of what a callback printed

T = TypeVar("T")


class SessionNews:
    """How much of each session's news the learner has seen."""

    def __init__(self) -> None:
        """Have told nothing yet."""
        self._errors: _BySession[dict[int, int]] = _BySession()
        self._transitions: _BySession[list[int]] = _BySession()
        self._notices: _BySession[list[int]] = _BySession()
        self._told: _BySession[set[object]] = _BySession()

    def unseen_news(self, session: CoreSession) -> list[News]:
        """Return what has happened since this was asked last."""
        news = [*self._new_errors(session), *self._new_transitions(session)]
        news += self._new_blocks(session)
        if not session.closed:
            news += [*self._new_mismatches(session), *self._new_prints(session)]
        told = self._notices.get(session, [0])
        news += [News(notice) for notice in session.notices[told[0] :]]
        told[0] = len(session.notices)
        return news

    def _new_errors(self, session: CoreSession) -> Iterator[News]:
        seen = self._errors.get(session, {})
        for index, error in enumerate(session.errors):
            if error.count > seen.get(index, 0):
                yield _news_about(error, again=index in seen)
                seen[index] = error.count

    def _new_transitions(self, session: CoreSession) -> Iterator[News]:
        latest = self._transitions.get(session, [0])
        for failure in session.failed_transitions:
            if failure.number > latest[0]:
                latest[0] = failure.number
                yield News(failure.what, failure.traceback)

    def _new_blocks(self, session: CoreSession) -> Iterator[News]:
        for blocked in session.blocked_callbacks():
            # A goal may well take its time in one of several threads: only what is in the way.
            serious = blocked.reason or (blocked.holds_up and blocked.seconds > _LONG_S)
            if serious and self._is_first(session, blocked.key):
                yield News(str(blocked))

    def _new_mismatches(self, session: CoreSession) -> Iterator[News]:
        own = session.nodes
        if not own:
            return
        graph = reader.read_graph(session.observer, own=list(own.values()))
        for topic, pair in graph.mismatches:
            mine = pair.publisher in own or pair.subscription in own
            if mine and self._is_first(session, (topic, pair.publisher, pair.subscription)):
                sentence = graph_text.describe_mismatch(topic, pair)
                yield News(f"{sentence} session.graph() shows it in red.")

    def _new_prints(self, session: CoreSession) -> Iterator[News]:
        """Say once of each node that it has printed, and where all that it prints is."""
        said: dict[str, list[str]] = {}
        for row in session.logs(last=None).rows:
            if row.level == "PRINT":
                said.setdefault(row.node, []).append(row.message)
        for node, lines in said.items():
            if self._is_first(session, ("printed", node)):
                yield News(
                    f"A callback of {node} has printed: as callbacks run while no cell does, that "
                    "goes to the log. course.logs() shows it, session.log_panel() live.",
                    "\n".join(lines[-_SHOWN_LINES:]),
                )

    def _is_first(self, session: CoreSession, key: object) -> bool:
        told = self._told.get(session, set())
        if key in told:
            return False
        told.add(key)
        return True


class _BySession(Generic[T]):
    """Something for each session, as long as there is the session."""

    def __init__(self) -> None:
        self._kept: weakref.WeakKeyDictionary[CoreSession, T] = weakref.WeakKeyDictionary()

    def get(self, session: CoreSession, first: T) -> T:
        return self._kept.setdefault(session, first)


def _news_about(error: CallbackError, *, again: bool) -> News:
    sentence = str(error)
    if not sentence.endswith((".", "!", "?")):
        sentence += "."  # what was raised may be a sentence already
    if again:
        return News(f"Again: {sentence}")
    return News(f"{sentence} The node goes on spinning.", error.traceback)
