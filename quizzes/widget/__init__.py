"""The quiz as a widget: controls in the browser, answers and marking in the kernel.

The browser gets texts and letters, and sends letters back. What is right, and why, is not in
anything that it gets before an attempt is submitted.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import anywidget
import traitlets

from quizzes.errors import QuizError
from quizzes.widget import view

if TYPE_CHECKING:
    from quizzes.quiz import Quiz

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

    def __init__(self, quiz: Quiz) -> None:
        """Show ``quiz`` as it stands."""
        self._quiz = quiz
        self._shown: tuple[int, int] | None = None
        self._trouble = ""
        super().__init__()
        self.layout.width = "100%"
        self.on_msg(self._on_message)
        self._update()

    def _ipython_display_(self, **kwargs: Any) -> None:
        from IPython.display import display

        data, metadata = self._repr_mimebundle_(**kwargs) or ({}, {})
        display(data, metadata=metadata, raw=True)  # type: ignore[no-untyped-call]
        display({"text/html": _SAVED, "text/plain": _GONE}, raw=True)  # type: ignore[no-untyped-call]

    def _on_message(self, _widget: Any, content: Any, _buffers: Any) -> None:
        """Do what the browser asks; whatever else it sends is passed over."""
        if not isinstance(content, dict):
            return
        kind = content.get("type")
        if kind == "hello":
            self.send({"type": "here", "id": content.get("id")})
            return
        # A second click, or a second window, may speak of an attempt that is over: it is dropped.
        if content.get("attempt") == self._quiz.attempt:
            self._do(str(kind), content)
        self._update()
        self.send({"type": "done", "id": content.get("id")})

    def _do(self, kind: str, content: dict[str, Any]) -> None:
        try:
            if kind == "answer":
                self._quiz.answer(content.get("number", 0), content.get("answer"))
            elif kind == "submit":
                self._quiz.submit()
            elif kind == "retry" and self._quiz.result is not None:
                self._quiz.retry()
            self._trouble = ""
        except QuizError as error:
            self._trouble = str(error)

    def _update(self) -> None:
        quiz = self._quiz
        shown = (quiz.attempt, len(quiz.attempts))
        with self.hold_sync():
            if shown != self._shown:  # rendering takes a moment, and an answer changes none of it
                self._shown = shown
                self.paper = view.paper(quiz)
            self.answers = {
                str(item.number): quiz.given.get(item.concept.id, "") for item in quiz.items
            }
            self.result = view.result(quiz)
            self.notice = self._trouble or quiz.notice
