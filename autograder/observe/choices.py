"""Choices of the student's, in a dictionary of the notebook, compared with a hidden cell's key."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from autograder.examination.check_context import CheckContext, StudentError
from autograder.examination.exam import Exam, Failed

MAX_SHOWN_CHARS = 60


@dataclass(frozen=True)
class Question:
    """A question whose answer is one word.

    Attributes:
        title: of the check of its answer, a sentence.
        why: why it matters on a robot.
        hints: from a nudge to nearly the answer.
        meanings: {word: what its choice would mean}; each names no other word.
    """

    title: str
    why: str
    hints: tuple[str, ...]
    meanings: Mapping[str, str]


class HasContext(Protocol):
    """What the checks of an exam get."""

    @property
    def bench(self) -> CheckContext:
        """The context of the check."""


RigT = TypeVar("RigT", bound=HasContext)


@dataclass(frozen=True)
class Choices:
    """A variable of the notebook with one word for each question.

    The key is nowhere in an exam: it comes from ``check(..., key={...})`` in a hidden cell, see
    `autograder.examination.answer_keys`.

    Attributes:
        variable: its name.
        words: what there is to choose from.
        questions: by the keys of the dictionary.

    Example:
        >>> meanings = {"dog": "It brings the ball back.", "cat": "It watches the ball fly."}
        >>> fetches = Question("The pet fits.", "Balls are expensive.", (), meanings)
        >>> choices = Choices("choices", ("dog", "cat"), {"fetches": fetches})
        >>> choices.parse({"fetches": " Dog "})
        {'fetches': 'dog'}
        >>> choices.require_right("fetches", "dog", {"fetches": ["dog"]})
        'It brings the ball back.'
    """

    variable: str
    words: Sequence[str]
    questions: Mapping[str, Question]

    def add_checks(self, exam: Exam[RigT], *, needs: Sequence[str], read: str = "") -> None:
        """Give an exam a check for each question, called ``<question>_choice``.

        Args:
            exam: its checks get something with the check's context as ``bench``.
            needs: the check that reads the choices.
            read: where to read on.
        """
        for name, question in self.questions.items():
            exam.check(needs=needs, hints=question.hints, read=read)(self._make_check(name))

    def _make_check(self, name: str) -> Callable[[RigT], str]:
        def fits(rig: RigT) -> str:
            return self.require_right(name, rig.bench.memory[self.variable][name], rig.bench.key)

        question = self.questions[name]
        fits.__name__, fits.__doc__ = f"{name}_choice", f"{question.title}\n\n{question.why}"
        return fits

    def read(self, bench: CheckContext) -> None:
        """Read the variable, and keep the words for the checks of the choices.

        Raises:
            Failed: the variable is missing, or something in it is none of the words.
        """
        try:
            value = bench.subject.value(self.variable)
        except StudentError as error:
            reason = str(error).partition(": ")[2] or str(error)  # without the exception's name
            raise self._failed(
                error.feedback_text
                if error.missing
                else f"It could not be read: {reason.rstrip('.')}."
            ) from None
        bench.memory[self.variable] = self.parse(value)

    def parse(self, value: Any) -> dict[str, str]:
        """Return {question: word} of the variable's ``value``.

        Raises:
            Failed: something in it is none of the words.
        """
        if not isinstance(value, dict):
            raise self._failed(f"{self.variable} is not a dictionary but {_short_repr(value)}.")
        chosen, wrong = dict[str, str](), []
        for question in self.questions:
            word = value.get(question)
            said = word.strip().lower() if isinstance(word, str) else ""
            if said in self.words:
                chosen[question] = said
            elif question not in value:
                wrong.append(f"{question} is missing")
            else:
                wrong.append(f"{question} is {'still open' if word is None else _short_repr(word)}")
        if wrong:
            raise self._failed(f"In {self.variable}, {'; '.join(wrong)}.")
        return chosen

    def require_right(self, question: str, chosen: str, key: Mapping[str, Sequence[str]]) -> str:
        """Return a remark if the word ``chosen`` for a question is one of those in the ``key``.

        Raises:
            Failed: it is not; says what it would mean, and nothing of what is right.
            LookupError: no key came with this part.
        """
        if question not in key:
            raise LookupError("no answer key came along: it stands in the hidden cell")
        meaning = self.questions[question].meanings[chosen]
        if chosen not in key[question]:
            raise Failed(
                expected="The choice that fits best.", actual=f'You chose "{chosen}". {meaning}'
            )
        if len(key[question]) > 1:
            return f"More than one answer is right here. {meaning}"
        return meaning

    def _failed(self, actual: str) -> Failed:
        words = ", ".join(f'"{word}"' for word in self.words)
        return Failed(
            expected=f"{self.variable} has a word for each of {', '.join(self.questions)}: one of "
            f"{words}.",
            actual=actual,
        )


def _short_repr(value: object) -> str:
    text = repr(value)
    return text if len(text) <= MAX_SHOWN_CHARS else f"{text[:MAX_SHOWN_CHARS]}…"
