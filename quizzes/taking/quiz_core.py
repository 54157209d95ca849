"""A quiz as a learner takes it: answer, submit, look at the feedback, try another one."""

from __future__ import annotations

import datetime
import functools
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

from quizzes.attempts import quiz_answers
from quizzes.attempts.quiz_answers import Answer
from quizzes.attempts.record import Attempt, Given
from quizzes.attempts.storage import AttemptsFile
from quizzes.bank import selection
from quizzes.bank.contents import Bank
from quizzes.bank.selection import Paper, PaperItem
from quizzes.errors import AnswerError, QuizError, UnwritableError
from quizzes.marking import regrade, scoring
from quizzes.marking.scoring import QuestionResult
from quizzes.marking.wording import QuestionText
from quizzes.taking import demonstration
from quizzes.taking.identity import current_login, validate_name

Arguments = ParamSpec("Arguments")
Back = TypeVar("Back")


def _with_lock(
    method: Callable[Concatenate[QuizCore, Arguments], Back],
) -> Callable[Concatenate[QuizCore, Arguments], Back]:
    """Let one thread at a time in: a widget's messages are handled while a cell runs."""

    @functools.wraps(method)
    def locked(self: QuizCore, /, *args: Arguments.args, **kwargs: Arguments.kwargs) -> Back:
        with self._lock:
            return method(self, *args, **kwargs)

    return locked


class QuizCore:
    """One learner's quiz. Make it with `quizzes.load`.

    Answers that were given but not submitted, and the attempts made so far, are restored from the
    folder. ``notice`` says in a sentence if something about them should be known.
    """

    def __init__(self, bank: Bank, *, student: str = "", folder: Path | None = None) -> None:
        """Take the quiz of ``bank`` as ``student`` and keep attempts in ``folder``.

        Raises:
            QuizError: the student's name is no text that can be saved.
        """
        self.bank = bank
        self.student = validate_name(student or current_login())
        self._file = AttemptsFile((folder or Path.cwd()).absolute(), bank.quiz)
        self._lock = threading.RLock()
        self.notice = ""
        self.attempts: list[Attempt] = []
        self._paper: Paper
        self._answers: dict[str, Answer] = {}
        self._result: QuestionResult | None = None
        self.reload()

    @_with_lock
    def reload(self) -> None:
        """Take up what is saved: an attempt that was begun, else the last one with its result."""
        found, self.notice = self._file.read()
        mine = [a for a in found if (a.quiz, a.student) == (self.bank.quiz, self.student)]
        self.attempts = [regrade.refresh_score(self.bank, attempt) for attempt in mine]
        if self._restore_draft():
            return
        last = regrade.mark_again(self.bank, self.attempts[-1]) if self.attempts else None
        if last is None:
            self._begin_attempt(self._next_number())
        else:
            self._paper, self._result = last.paper, last
            self._answers = {mark.item.concept.id: mark.answer for mark in last.marks}

    # What a learner sees

    @property
    def attempt(self) -> int:
        """The number of the attempt at hand, from 1."""
        return self._paper.attempt

    @property
    def items(self) -> tuple[PaperItem, ...]:
        """The questions of the attempt at hand."""
        return self._paper.items

    @property
    def given(self) -> dict[str, Answer]:
        """The answers of the attempt at hand, by concept."""
        return dict(self._answers)

    @property
    def result(self) -> QuestionResult | None:
        """The result of the attempt at hand; None before it is submitted."""
        return self._result

    @property
    def first(self) -> Attempt | None:
        """The first attempt that was submitted."""
        return self.attempts[0] if self.attempts else None

    @property
    def counted(self) -> list[Attempt]:
        """The attempts that count; what comes after is practice (see `quizzes.marking.regrade`)."""
        return [attempt for attempt in self.attempts if attempt.attempt <= self.bank.attempt_limit]

    @property
    def best(self) -> Attempt | None:
        """The attempt with the best score of those that count, the earliest of equal ones."""
        return max(self.counted, key=lambda a: (a.score, -a.attempt), default=None)

    @property
    def more(self) -> bool:
        """Whether there is another attempt after the one at hand."""
        return not self.bank.closed or self.attempt < self.bank.attempt_limit

    @property
    def open_questions(self) -> list[int]:
        """The numbers of the questions that have no complete answer yet."""
        return [
            item.number for item in self.items
            if not quiz_answers.is_complete(item, self._answers.get(item.concept.id, ""))
        ]  # fmt: skip

    def question(self, which: int | str) -> QuestionText:
        """Return a question to read, by its number or its concept.

        Raises:
            AnswerError: there is no such question.
        """
        return QuestionText(self.item(which))

    def points(self) -> float:
        """Return the points of the best attempt so far, one for each concept.

        Raises:
            QuizError: the instructor marks this quiz.
        """
        if self.bank.keyless:
            raise QuizError(
                "Your instructor marks this quiz: its points come with the feedback to what you "
                "hand in."
            )
        return self.best.score if self.best else 0.0

    # What a learner does

    @_with_lock
    def answer(self, which: int | str, given: Any) -> None:
        """Answer a question; a new answer replaces the one before.

        Args:
            which: the question's number, from 1, or its concept.
            given: a letter (``"b"``), several (``"ac"``), a number, or for orderings and matchings
                the letters in order; None takes the answer back.

        Raises:
            AnswerError: no such question, an answer that does not fit it, or one that comes after
                the quiz was submitted.
            AttemptsError: another window has submitted this attempt, or keeps the file busy.
        """
        item = self.item(which)
        if self._result is not None:
            raise AnswerError(
                f"Attempt {self.attempt} is submitted, so its answers stand: begin another quiz "
                "with quiz.retry()."
            )
        answer = quiz_answers.normalize_answer(item, given)
        if self._answers.get(item.concept.id, quiz_answers.NOTHING) != answer:
            self._save_draft({item.concept.id: answer})

    @_with_lock
    def submit(self) -> QuestionResult:
        """Submit the answers and return the marked quiz; a second call returns the same.

        Raises:
            AnswerError: a question has no answer yet.
            AttemptsError: another window has submitted this attempt, or keeps the file busy.
        """
        if self._result is not None:
            return self._result
        if self.open_questions:
            numbers = " and ".join(map(str, self.open_questions))
            raise AnswerError(f"Not submitted yet: question {numbers} has no complete answer.")
        result = scoring.mark_paper(self._paper, self._answers)
        attempt = self._make_record(result)
        try:
            self._file.append(attempt)
            self.notice = ""
        except UnwritableError as error:
            self.notice = str(error)
        self.attempts.append(attempt)
        self._result = result
        return result

    @_with_lock
    def retry(self) -> None:
        """Begin another quiz: other questions on the same concepts.

        Raises:
            QuizError: the attempt at hand has not been submitted, or was the last.
        """
        if self._result is None:
            raise QuizError(
                f"Attempt {self.attempt} is still open: submit it with quiz.submit() first."
            )
        if not self.more:
            attempts = (
                "one attempt"
                if self.bank.attempt_limit == 1
                else f"{self.bank.attempt_limit} attempts"
            )
            raise QuizError(f"This quiz has {attempts}, and you have handed in the last.")
        self._begin_attempt(self._next_number())
        self._save_draft({})

    def demo(self, which: int | str) -> None:
        """Put a cell below this one that shows on live nodes what a question was about.

        Raises:
            QuizError: the quiz has not been submitted, there is nothing to show, or this is no
                notebook.
        """
        item = self.item(which)
        if self._result is None:
            raise QuizError("There is something to run once you have submitted your answers.")
        demonstration.into_cell(self._result.marks[item.number - 1])

    def item(self, which: int | str) -> PaperItem:
        """Return a question by its number (from 1) or its concept.

        Raises:
            AnswerError: there is none; the message names the ones there are.
        """
        for item in self.items:
            if which == item.concept.id or (which == item.number and type(which) is int):
                return item
        concepts = ", ".join(item.concept.id for item in self.items)
        raise AnswerError(
            f"There is no question {which!r}: there are 1 to {len(self.items)} ({concepts})."
        )

    def __repr__(self) -> str:
        """Say where the learner stands."""
        state = self._result.headline if self._result else f"attempt {self.attempt} is open"
        return f"Quiz '{self.bank.quiz}' of {self.student}: {state}"

    # What is kept

    def _begin_attempt(self, number: int) -> None:
        self._paper = selection.draw(self.bank, self.student, number)
        self._answers, self._result = {}, None

    def _next_number(self) -> int:
        return max((a.attempt for a in self.attempts), default=0) + 1

    def _make_record(self, result: QuestionResult) -> Attempt:
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        given = {
            item.concept.id: Given(item.variant.id, self._answers[item.concept.id])
            for item in self.items
        }
        return Attempt(
            self.bank.quiz, self.student, self.attempt, self.bank.edition, now, given,
            result.score, result.right, result.passed,
        )  # fmt: skip

    def _save_draft(self, changed: Mapping[str, Answer]) -> None:
        """Keep changed answers, and take up what another window has answered meanwhile."""
        try:
            kept = self._file.save_draft(self.student, self.attempt, self.bank.edition, changed)
            self.notice = ""
        except UnwritableError as error:
            self.notice = str(error)
            kept = dict(changed)
        self._take_up(kept)

    def _take_up(self, given: Mapping[str, Any]) -> None:
        """Take up saved answers; one that does not fit any more is left out."""
        for item in self.items:
            if item.concept.id in given:
                with suppress(AnswerError):
                    answer = quiz_answers.normalize_answer(item, given[item.concept.id])
                    self._answers[item.concept.id] = answer

    def _restore_draft(self) -> bool:
        """Take up the attempt that was begun, if there is one."""
        draft = self._file.read_draft()
        mine = (draft.get("quiz"), draft.get("student"), draft.get("edition"))
        number, given = draft.get("attempt"), draft.get("answers")
        if mine != (self.bank.quiz, self.student, self.bank.edition):
            return False
        if number != self._next_number() or not isinstance(given, Mapping):
            return False
        self._begin_attempt(self._next_number())
        self._take_up({item.concept.id: given.get(item.concept.id) for item in self.items})
        return True
