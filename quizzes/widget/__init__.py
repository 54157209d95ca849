"""The quiz as a widget: controls in the browser, answers and marking in the kernel.

The browser gets texts and letters, and sends letters back. What is right, and why, is not in
anything that it gets before an attempt is submitted.
"""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import anywidget
import traitlets

from quizzes.errors import QuizError
from quizzes.taking.quiz_core import QuizCore
from quizzes.widget import widget_state

_HERE = Path(__file__).parent

_GONE = "This quiz is not connected: run this cell again. Your answers and attempts are kept."
_SAVED = f"""<div class="quiz-gone"><style>
.jp-OutputArea-child:has(.quiz) + .jp-OutputArea-child:has(.quiz-gone) {{ display: none; }}
.jp-OutputArea-child:has(+ .jp-OutputArea-child .quiz-gone):not(:has(.quiz)) {{ display: none; }}
</style><p>{_GONE}</p></div>"""
"""A second output, which takes the place of the first when no kernel has the widget any more."""


class QuizWidget(anywidget.AnyWidget):
    """Shows one quiz. What the learner does arrives as messages; what to show are the traits.

    ``paper`` are the questions, ``answers`` the answers by question number, ``result`` what came
    of the attempt or None, ``notice`` a sentence about something that should be known.
    """

    _esm = _HERE / "quiz.js"
    _css = _HERE / "quiz.css"
    paper = traitlets.Dict().tag(sync=True)
    answers = traitlets.Dict().tag(sync=True)
    result: Any = traitlets.Dict(allow_none=True, default_value=None).tag(sync=True)
    notice = traitlets.Unicode().tag(sync=True)

    def __init__(self, quiz: QuizCore) -> None:
        """Show ``quiz`` as it stands."""
        self._quiz = quiz
        self._shown: tuple[int, int] | None = None
        self._trouble = ""
        self._newest: dict[tuple[str, int], int] = {}
        self._one_by_one = threading.RLock()
        super().__init__()
        self.layout.width = "100%"
        self.on_msg(self._on_message)
        self._update_traits()

    def _ipython_display_(self, **kwargs: Any) -> None:
        from IPython.display import display

        data, metadata = self._repr_mimebundle_(**kwargs) or ({}, {})
        display(data, metadata=metadata, raw=True)  # type: ignore[no-untyped-call]
        display({"text/html": _SAVED, "text/plain": _GONE}, raw=True)  # type: ignore[no-untyped-call]

    def _on_message(self, _widget: Any, content: Any, _buffers: Any) -> None:
        """Do what the browser asks; whatever else it sends is passed over.

        JupyterLab sends a new widget's first messages to the kernel's main thread and later ones to
        another, so two may come at a time, and the second before the first.
        """
        if isinstance(content, dict):
            with self._one_by_one:
                self._obey_message(content)

    def _obey_message(self, content: dict[str, Any]) -> None:
        kind = content.get("type")
        if kind == "hello":
            self.send({"type": "here", "id": content.get("id")})
            return
        # A second click, or a second window, may speak of an attempt that is over: it is dropped.
        if content.get("attempt") == self._quiz.attempt:
            self._do_action(str(kind), content)
        self._update_traits()
        self.send({"type": "done", "id": content.get("id")})

    def _do_action(self, kind: str, content: dict[str, Any]) -> None:
        try:
            if kind == "answer":
                self._answer_question(content, content.get("number", 0), content.get("answer"))
            elif kind == "submit":
                self._answer_all(content)
                self._quiz.submit()
            elif kind == "retry" and self._quiz.result is not None:
                self._quiz.retry()
            self._trouble = ""
        except QuizError as error:
            self._trouble = str(error)

    def _answer_question(self, content: dict[str, Any], number: Any, answer: Any) -> None:
        """Answer a question, unless the same page has sent a newer answer before."""
        view, order = content.get("view"), content.get("order")
        if isinstance(view, str) and isinstance(order, int) and isinstance(number, int):
            if order < self._newest.get((view, number), 0):
                return
            self._newest[view, number] = order
        self._quiz.answer(number, answer)

    def _answer_all(self, content: dict[str, Any]) -> None:
        """Take up what the page showed when it was submitted: an answer may still be on its way."""
        shown = content.get("answers")
        if self._quiz.result is None and isinstance(shown, dict):
            for item in self._quiz.items:
                if (answer := shown.get(str(item.number), "")) != "":
                    self._answer_question(content, item.number, answer)

    def _update_traits(self) -> None:
        quiz = self._quiz
        shown = (quiz.attempt, len(quiz.attempts))
        with self.hold_sync():
            if shown != self._shown:  # rendering takes a moment, and an answer changes none of it
                self._shown = shown
                self.paper = widget_state.paper_data(quiz)
            self.answers = {
                str(item.number): quiz.given.get(item.concept.id, "") for item in quiz.items
            }
            self.result = widget_state.result_data(quiz)
            self.notice = self._trouble or quiz.notice
