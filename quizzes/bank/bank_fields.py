"""What the fields of a bank can be made of: texts, ids, numbers, and what only teaching needs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Annotated, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
)

Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Code = Annotated[str, StringConstraints(min_length=1)]
Id = Annotated[str, StringConstraints(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$", max_length=60)]
Finite = Annotated[float, Field(allow_inf_nan=False)]

TO_TEACH = "to-teach"
"""Marks in the JSON schema what a bank needs that teaches, and a closed one does not."""

_teaches: ContextVar[bool] = ContextVar("_teaches", default=True)
"""Whether the bank that is being validated teaches: a part cannot see the bank around it."""


class FieldError(ValueError):
    """What is wrong with a field's content, each problem with its place inside the field.

    Places are parts parted by spaces: "2 text". An empty one is the field itself.
    """

    def __init__(self, *problems: tuple[str, str]) -> None:
        """Say all ``problems``, each a place and a phrase."""
        super().__init__("; ".join(problem for _, problem in problems))
        self.problems = problems


class QuestionPart(BaseModel):
    """Base of all parts of a bank: nothing is converted, nothing unknown is passed over."""

    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, use_attribute_docstrings=True
    )


@contextmanager
def validating_bank(*, teaches: bool) -> Iterator[None]:
    """Say meanwhile whether the bank that is validated teaches."""
    token = _teaches.set(teaches)
    try:
        yield
    finally:
        _teaches.reset(token)


def is_closed(data: object) -> bool:
    """Whether the data of a bank says that it is closed.

    A ``closed`` that is neither true nor false means that it is; the schema asks which.
    """
    return isinstance(data, dict) and data.get("closed", False) is not False


def is_teaching() -> bool:
    """Whether the bank that is being validated teaches."""
    return _teaches.get()


def refuse_problems(problems: list[tuple[str, str]]) -> None:
    """Return if there are no problems.

    Raises:
        FieldError: there are.
    """
    if problems:
        raise FieldError(*problems)


Content = TypeVar("Content")


def _to_teach(value: Content | None) -> Content | None:
    if value is None and is_teaching():
        needed = "it is required in a quiz that teaches; one with 'closed: true' goes without"
        raise FieldError(("", needed))
    return value


ToTeach = Annotated[
    Content | None,
    AfterValidator(_to_teach),
    Field(default=None, validate_default=True, json_schema_extra={TO_TEACH: True}),
]
"""A field that a bank needs to teach, and that a closed one can do without."""


def _as_list(value: object) -> object:
    return [value] if isinstance(value, str) else value


Proofs = Annotated[
    list[Text],
    Field(min_length=1),
    BeforeValidator(
        _as_list, json_schema_input_type=Text | Annotated[list[Text], Field(min_length=1)]
    ),
]
"""Names of tests; a single one may stand alone."""
