"""What a bank holds: a quiz of concepts, each with variants that can stand in for one another.

The classes are the schema of ``banks/NAME.yaml`` (see `quizzes.bank.loader`, which reads it).
Texts are Markdown: fenced code, ``$LaTeX$``, and images ``![alt](assets/NAME.svg)`` beside the
bank.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator, model_validator

from quizzes.bank import bank_fields
from quizzes.bank.bank_fields import Code, Finite, Id, Proofs, QuestionPart, Text, ToTeach

MIN_VARIANTS = 4
"""Variants a concept of a teaching bank has at least: with fewer, a retry is too soon the same."""

COUNTED = 20
"""How many attempts of a quiz count unless its bank says it; later ones are practice."""

DEAL = 2
"""How `quizzes.bank.selection` deals letters: answers saved under another number mean nothing."""


class Option(QuestionPart):
    """One option of a choice. A wrong one names the belief that makes it tempting."""

    text: Text
    """What there is to choose."""
    correct: bool = False
    """Whether it is right to choose it."""
    feedback: ToTeach[Text]
    """Why it is right or wrong, for who chose it."""
    misconception: Id | None = Field(
        default=None, validate_default=True, json_schema_extra={bank_fields.TO_TEACH: True}
    )
    """The belief that a wrong option shows, from the bank's table. Teaching quizzes name one with
    each wrong option; a right one has none."""
    show: Code | None = None
    """Python that demonstrates on live nodes what really happens."""

    @field_validator("misconception")
    @classmethod
    def _wrong_ones_have_a_reason(cls, value: str | None, info: ValidationInfo) -> str | None:
        correct = info.data.get("correct")
        if correct is False and value is None and bank_fields.is_teaching():
            bank_fields.refuse_problems(
                [("", "a wrong option needs a misconception in a quiz that teaches")]
            )
        if correct is True and value is not None:
            bank_fields.refuse_problems([("", "a right option has no misconception")])
        return value


class _Variant(QuestionPart):
    id: Id
    """Its name, used once in the bank: lower-case words joined by hyphens."""
    stem: Text
    """The question."""
    code: Code | None = None
    """Python that the question is about, shown below it."""
    proof: ToTeach[Proofs]
    """The names of the tests that prove the key on real endpoints; one may stand alone."""


class _Choice(_Variant):
    options: list[Option] = Field(min_length=2, max_length=10)
    """What there is to choose from; each learner sees it in another order."""

    @property
    def lettered_texts(self) -> list[str]:
        """The texts that letters stand for, in the order of the bank."""
        return [option.text for option in self.options]

    @property
    def right_positions(self) -> list[int]:
        """The positions of the right options, in the order of the bank."""
        return [index for index, option in enumerate(self.options) if option.correct]


class _OneRight(_Choice):
    @field_validator("options")
    @classmethod
    def _one_key(cls, options: list[Option]) -> list[Option]:
        count = sum(option.correct for option in options)
        problem = f"exactly one option must be correct, not {count}"
        bank_fields.refuse_problems([("", problem)] if count != 1 else [])
        return options


class Single(_OneRight):
    """Choose the one right option."""

    kind: Literal["single"]
    """The kind of question."""


class Predict(_OneRight):
    """Say what a cell will show, then run it."""

    kind: Literal["predict"]
    """The kind of question."""
    code: Code
    """The cell."""


class Multiple(_Choice):
    """Choose every right option. Each one earns its share, and each wrong one loses as much."""

    kind: Literal["multiple"]
    """The kind of question."""

    @field_validator("options")
    @classmethod
    def _some_right_some_wrong(cls, options: list[Option]) -> list[Option]:
        problem = "at least one option must be correct and one wrong"
        some = 0 < sum(option.correct for option in options) < len(options)
        bank_fields.refuse_problems([] if some else [("", problem)])
        return options


class Trap(QuestionPart):
    """A wrong number that a known misconception leads to."""

    value: Finite
    """The number."""
    tolerance: Finite = Field(default=0.0, ge=0)
    """How far from it an answer still counts as it."""
    misconception: ToTeach[Id]
    """The belief that leads to it, from the bank's table."""
    feedback: ToTeach[Text]
    """Why it is wrong."""
    show: Code | None = None
    """Python that demonstrates on live nodes what really happens."""

    def is_hit(self, number: float) -> bool:
        """Whether ``number`` is the one this trap is about."""
        return is_near(number, self.value, self.tolerance)


class _Built(_Variant):
    """A question whose answer is made rather than chosen: one feedback for every wrong one."""

    feedback: ToTeach[Text]
    """Why the right answer is right."""
    wrong_feedback: ToTeach[Text]
    """What to say to any other answer."""
    misconception: ToTeach[Id]
    """The belief that a wrong answer shows, from the bank's table."""
    show: Code | None = None
    """Python that demonstrates on live nodes what really happens."""


class Numeric(_Variant):
    """Give a number: right within the tolerance of the answer, both in the unit."""

    kind: Literal["numeric"]
    """The kind of question."""
    answer: Finite
    """The right number."""
    tolerance: Finite = Field(default=0.0, ge=0)
    """How far from it an answer is still right."""
    unit: str = ""
    """The unit of the answer, such as s or Hz, which stands behind the box."""
    traps: list[Trap] = Field(default_factory=list)
    """Wrong numbers that are expected."""
    feedback: ToTeach[Text]
    """Why the right number is right."""
    wrong_feedback: Text | None = None
    """What to say to a wrong number that no trap expects."""
    misconception: Id | None = None
    """The belief that such a number shows, from the bank's table."""
    show: Code | None = None
    """Python that demonstrates on live nodes what really happens."""

    @property
    def lettered_texts(self) -> list[str]:
        """No letters here."""
        return []

    def is_right(self, number: float) -> bool:
        """Whether ``number`` is right."""
        return is_near(number, self.answer, self.tolerance)

    @field_validator("traps")
    @classmethod
    def _traps_are_wrong(cls, traps: list[Trap], info: ValidationInfo) -> list[Trap]:
        answer, tolerance = info.data.get("answer"), info.data.get("tolerance")
        if answer is not None and tolerance is not None:
            bank_fields.refuse_problems([
                (f"{number} value",
                 f"the trap {trap.value:g} lies within the tolerance of the answer")
                for number, trap in enumerate(traps, start=1)
                if is_near(trap.value, answer, tolerance)
            ])  # fmt: skip
        return traps


class Ordering(_Built):
    """Put items in order. Each one in its place earns its share."""

    kind: Literal["ordering"]
    """The kind of question."""
    items: list[Text] = Field(min_length=3, max_length=8)
    """The items in the right order."""

    @property
    def lettered_texts(self) -> list[str]:
        """The texts that letters stand for, in the right order."""
        return list(self.items)


class Pair(QuestionPart):
    """Two things that belong together."""

    left: Text
    """What is given."""
    right: Text
    """What is to be found for it; several pairs may have the same."""


class Matching(_Built):
    """Find for each left side its right one. Each pair earns its share."""

    kind: Literal["matching"]
    """The kind of question."""
    pairs: list[Pair] = Field(min_length=2, max_length=8)
    """What belongs together."""
    extras: list[Text] = Field(default_factory=list, max_length=6)
    """Right sides that belong to nothing."""

    @property
    def lettered_texts(self) -> list[str]:
        """The right sides that letters stand for, each once; those of the pairs come first."""
        return list(dict.fromkeys([*(pair.right for pair in self.pairs), *self.extras]))

    @field_validator("pairs")
    @classmethod
    def _something_to_choose(cls, pairs: list[Pair]) -> list[Pair]:
        lefts = [pair.left for pair in pairs]
        problems = [
            (f"{number} left", f"the left side {left!r} is there twice")
            for number, left in enumerate(lefts, start=1)
            if left in lefts[: number - 1]
        ]
        if len({pair.right for pair in pairs}) < 2:
            problems.append(("", "all have the same right side, so there is nothing to match"))
        bank_fields.refuse_problems(problems)
        return pairs

    @field_validator("extras")
    @classmethod
    def _extras_belong_to_nothing(cls, extras: list[str], info: ValidationInfo) -> list[str]:
        rights = {pair.right for pair in info.data.get("pairs", [])}
        bank_fields.refuse_problems([
            (f"{number}", "an extra is the right side of a pair, too")
            for number, extra in enumerate(extras, start=1)
            if extra in rights
        ])  # fmt: skip
        return extras


Variant = Annotated[
    Single | Predict | Multiple | Numeric | Ordering | Matching, Field(discriminator="kind")
]


class Concept(QuestionPart):
    """One thing to understand, with interchangeable questions about it."""

    id: Id
    """Its name, used once in the bank: lower-case words joined by hyphens."""
    objective: Text
    """What a learner can do who understands it; the class report calls it by this."""
    variants: list[Variant] = Field(min_length=1)
    """Questions that can stand in for one another: each attempt gets one of them. At least 4 in a
    quiz that teaches, so that a retry is another quiz; one is enough for a closed quiz."""

    def find_variant(self, name: str) -> Variant | None:
        """Return the variant with the id ``name``, if there is one."""
        return next((variant for variant in self.variants if variant.id == name), None)


class Bank(QuestionPart):
    """A quiz: its concepts in order, one question of each to every learner.

    A ``closed`` quiz is marked by the instructor alone: learners get it ``keyless``, without keys
    and feedback (see `quizzes.marking.closed_quizzes`), and hand their answers in.
    """

    quiz: Id
    """What it is called: the file's name without .yaml."""
    title: Text
    """The heading that learners see."""
    chapter: Text
    """What it is about; stands below the title."""
    pass_mark: int = Field(ge=1)
    """How many concepts must be fully right to pass; at most as many as there are."""
    attempts: int | None = Field(default=None, ge=1, le=100)
    """How many attempts count; if left out, 20, or 1 of a closed quiz."""
    closed: bool = False
    """true: the quiz examines. Keys and feedback stay with you, answers are handed in."""
    keyless: bool = False
    """Written by the program into the questions that students get; never write it yourself."""
    misconceptions: dict[Id, Text] = Field(
        default_factory=dict, json_schema_extra={bank_fields.TO_TEACH: True}
    )
    """What learners may wrongly believe: an id for each belief, and the belief in a sentence."""
    concepts: list[Concept] = Field(min_length=1)
    """What is to be understood, in the order of the questions; one point each."""
    _folder: Path = PrivateAttr(default=Path())

    @model_validator(mode="wrap")
    @classmethod
    def _needs_more_to_teach(cls, data: Any, handler: Callable[[Any], Bank]) -> Bank:
        with bank_fields.validating_bank(teaches=not bank_fields.is_closed(data)):
            return handler(data)

    @property
    def folder(self) -> Path:
        """The folder of the bank's file, where ``assets`` lies."""
        return self._folder

    @property
    def attempt_limit(self) -> int:
        """How many attempts count: `COUNTED`, or 1 of a closed quiz, unless the bank says it."""
        return self.attempts or (1 if self.closed else COUNTED)

    @property
    def pass_text(self) -> str:
        """What is needed to pass, as people say it: "4 of 5 needed"."""
        return f"{self.pass_mark} of {len(self.concepts)} needed"

    @property
    def edition(self) -> str:
        """A digest of all that saved answers refer to: the deal, the ids, the texts behind letters.

        Mending a key, a stem or a feedback keeps it, so saved answers can be marked anew.
        """
        content = [
            [concept.id, [[variant.id, variant.kind, _referred_texts(variant, by_name=self.closed)]
                          for variant in concept.variants]]
            for concept in self.concepts
        ]  # fmt: skip
        return hashlib.sha256(json.dumps([DEAL, content]).encode()).hexdigest()[:16]

    def find_concept(self, name: str) -> Concept | None:
        """Return the concept with the id ``name``, if there is one."""
        return next((concept for concept in self.concepts if concept.id == name), None)


def is_near(number: float, target: float, tolerance: float) -> bool:
    """Whether a number is within ``tolerance`` of ``target``; rounding in binary is forgiven."""
    return abs(number - target) <= tolerance + 1e-9 * max(1.0, abs(target))


def _referred_texts(variant: Variant, *, by_name: bool) -> list[str]:
    """Return what letters refer to; ``by_name`` if the order of the bank is not for learners."""
    lefts = [pair.left for pair in variant.pairs] if isinstance(variant, Matching) else []
    return [*lefts, *(sorted(variant.lettered_texts) if by_name else variant.lettered_texts)]
