"""What a bank holds: a quiz of concepts, each with variants that can stand in for one another.

The classes are the schema of ``banks/NAME.yaml`` (see `quizzes.loader`, which reads it). Texts are
Markdown: fenced code, ``$LaTeX$``, and images ``![alt](assets/NAME.svg)`` beside the bank.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PrivateAttr,
    StringConstraints,
    model_validator,
)

MIN_VARIANTS = 4
"""Variants a concept has at least: with fewer, a retry is too soon the same quiz again."""

COUNTED = 20
"""How many attempts of a quiz count unless its bank says it; later ones are practice."""

DEAL = 2
"""How `quizzes.model` deals letters: answers saved under another number mean nothing."""

Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Code = Annotated[str, StringConstraints(min_length=1)]
Id = Annotated[str, StringConstraints(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$", max_length=60)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


def _as_list(value: object) -> object:
    return [value] if isinstance(value, str) else value


Proofs = Annotated[list[Text], Field(min_length=1), BeforeValidator(_as_list)]
"""Names of tests; a single one may stand alone."""


class FieldError(ValueError):
    """What is wrong with one field of a part that does not hold together."""

    def __init__(self, field: str, problem: str) -> None:
        """Say ``problem`` of ``field``, whose parts are parted by spaces: "options 2 text"."""
        super().__init__(problem)
        self.field = field


class Part(BaseModel):
    """Base of all parts of a bank: nothing is converted, nothing unknown is passed over."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class Option(Part):
    """One option of a choice. A wrong one names the belief that makes it tempting.

    ``show`` is Python that demonstrates on live nodes what really happens.
    """

    text: Text
    correct: bool = False
    feedback: Text
    misconception: Id | None = None
    show: Code | None = None

    @model_validator(mode="after")
    def _wrong_ones_have_a_reason(self) -> Self:
        if not self.correct and self.misconception is None:
            raise FieldError("misconception", "a wrong option needs a misconception")
        if self.correct and self.misconception is not None:
            raise FieldError("misconception", "a right option has no misconception")
        return self


class _Variant(Part):
    id: Id
    stem: Text
    code: Code | None = None
    proof: Proofs
    """The names of the tests that prove the key on real endpoints."""


class _Choice(_Variant):
    options: list[Option] = Field(min_length=2, max_length=10)

    @property
    def texts(self) -> list[str]:
        """The texts that letters stand for, in the order of the bank."""
        return [option.text for option in self.options]

    @property
    def right(self) -> list[int]:
        """The positions of the right options, in the order of the bank."""
        return [index for index, option in enumerate(self.options) if option.correct]


class _OneRight(_Choice):
    @model_validator(mode="after")
    def _one_key(self) -> Self:
        if len(self.right) != 1:
            problem = f"exactly one option must be correct, not {len(self.right)}"
            raise FieldError("options", problem)
        return self


class Single(_OneRight):
    """Choose the one right option."""

    kind: Literal["single"]


class Predict(_OneRight):
    """Say what a cell will show, then run it: ``code`` is that cell."""

    kind: Literal["predict"]
    code: Code


class Multiple(_Choice):
    """Choose every right option."""

    kind: Literal["multiple"]

    @model_validator(mode="after")
    def _some_right_some_wrong(self) -> Self:
        if not 0 < len(self.right) < len(self.options):
            raise FieldError("options", "at least one option must be correct and one wrong")
        return self


class Trap(Part):
    """A wrong number that a known misconception leads to."""

    value: Finite
    tolerance: Finite = Field(default=0.0, ge=0)
    misconception: Id
    feedback: Text
    show: Code | None = None

    def holds(self, number: float) -> bool:
        """Whether ``number`` is the one this trap is about."""
        return near(number, self.value, self.tolerance)


class _Built(_Variant):
    """A question whose answer is made rather than chosen: one feedback for every wrong one."""

    feedback: Text
    wrong_feedback: Text
    misconception: Id
    show: Code | None = None


class Numeric(_Variant):
    """Give a number: right within ``tolerance`` of ``answer``, both in ``unit``."""

    kind: Literal["numeric"]
    answer: Finite
    tolerance: Finite = Field(default=0.0, ge=0)
    unit: str = ""
    traps: list[Trap] = Field(default_factory=list)
    feedback: Text
    wrong_feedback: Text | None = None
    misconception: Id | None = None
    show: Code | None = None

    @property
    def texts(self) -> list[str]:
        """No letters here."""
        return []

    def holds(self, number: float) -> bool:
        """Whether ``number`` is right."""
        return near(number, self.answer, self.tolerance)

    @model_validator(mode="after")
    def _traps_are_wrong(self) -> Self:
        for number, trap in enumerate(self.traps, start=1):
            if self.holds(trap.value):
                problem = f"the trap {trap.value:g} lies within the tolerance of the answer"
                raise FieldError(f"traps {number} value", problem)
        return self


class Ordering(_Built):
    """Put ``items`` (given in the right order) in order."""

    kind: Literal["ordering"]
    items: list[Text] = Field(min_length=3, max_length=8)

    @property
    def texts(self) -> list[str]:
        """The texts that letters stand for, in the right order."""
        return list(self.items)


class Pair(Part):
    """Two things that belong together."""

    left: Text
    right: Text


class Matching(_Built):
    """Find for each left side its right one; ``extras`` are right sides without a left."""

    kind: Literal["matching"]
    pairs: list[Pair] = Field(min_length=2, max_length=8)
    extras: list[Text] = Field(default_factory=list, max_length=6)

    @property
    def texts(self) -> list[str]:
        """The right sides that letters stand for, each once; those of the pairs come first."""
        return list(dict.fromkeys([*(pair.right for pair in self.pairs), *self.extras]))

    @model_validator(mode="after")
    def _something_to_choose(self) -> Self:
        lefts = [pair.left for pair in self.pairs]
        rights = {pair.right for pair in self.pairs}
        for number, left in enumerate(lefts, start=1):
            if left in lefts[: number - 1]:
                raise FieldError(f"pairs {number} left", f"the left side {left!r} is there twice")
        for number, extra in enumerate(self.extras, start=1):
            if extra in rights:
                problem = "an extra is the right side of a pair, too"
                raise FieldError(f"extras {number}", problem)
        if len(rights) < 2:
            raise FieldError("pairs", "all have the same right side, so there is nothing to match")
        return self


Variant = Annotated[
    Single | Predict | Multiple | Numeric | Ordering | Matching, Field(discriminator="kind")
]


class Concept(Part):
    """One thing to understand, with interchangeable questions about it."""

    id: Id
    objective: Text
    variants: list[Variant] = Field(min_length=MIN_VARIANTS)

    def variant(self, name: str) -> Variant | None:
        """Return the variant with the id ``name``, if there is one."""
        return next((variant for variant in self.variants if variant.id == name), None)


class Bank(Part):
    """A quiz: its concepts in order, and what learners may wrongly believe about them.

    ``pass_mark`` is how many concepts must be fully right, ``attempts`` how many attempts count
    (see ``counted``).

    A ``closed`` quiz is marked by the instructor alone: learners get it ``keyless``, without keys
    and feedback (see `quizzes.closing`), and hand their answers in.
    """

    quiz: Id
    title: Text
    chapter: Text
    pass_mark: int = Field(ge=1)
    attempts: int | None = Field(default=None, ge=1, le=100)
    closed: bool = False
    keyless: bool = False
    misconceptions: dict[Id, Text]
    concepts: list[Concept] = Field(min_length=1)
    _folder: Path = PrivateAttr(default=Path())

    @property
    def folder(self) -> Path:
        """The folder of the bank's file, where ``assets`` lies."""
        return self._folder

    @property
    def counted(self) -> int:
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
            [concept.id, [[variant.id, variant.kind, _texts(variant, by_name=self.closed)]
                          for variant in concept.variants]]
            for concept in self.concepts
        ]  # fmt: skip
        return hashlib.sha256(json.dumps([DEAL, content]).encode()).hexdigest()[:16]

    def concept(self, name: str) -> Concept | None:
        """Return the concept with the id ``name``, if there is one."""
        return next((concept for concept in self.concepts if concept.id == name), None)


def near(number: float, target: float, tolerance: float) -> bool:
    """Whether a number is within ``tolerance`` of ``target``; rounding in binary is forgiven."""
    return abs(number - target) <= tolerance + 1e-9 * max(1.0, abs(target))


def _texts(variant: Variant, *, by_name: bool) -> list[str]:
    """Return what letters refer to; ``by_name`` if the order of the bank is not for learners."""
    lefts = [pair.left for pair in variant.pairs] if isinstance(variant, Matching) else []
    return [*lefts, *(sorted(variant.texts) if by_name else variant.texts)]
