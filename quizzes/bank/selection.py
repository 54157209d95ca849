"""Which questions a learner gets, and in which order: decided by (student, quiz, attempt) alone.

All is ordered by digests rather than by a random number generator, so that every Python, today's
and tomorrow's, deals the same quiz, and an instructor can deal it again when marking.
"""

from __future__ import annotations

import hashlib
import string
from collections.abc import Iterable
from dataclasses import dataclass

from quizzes.bank.contents import Bank, Concept, Matching, Numeric, Ordering, Variant

LETTERS = string.ascii_lowercase


@dataclass(frozen=True)
class PaperItem:
    """One question as a learner sees it.

    ``order`` says which of the variant's texts (see ``texts`` in `quizzes.bank.contents`) each
    letter stands for: the letter at position 0 is "a".
    """

    number: int
    concept: Concept
    variant: Variant
    order: tuple[int, ...]

    @property
    def letters(self) -> str:
        """The letters of this question, "abcd" for four texts; empty where a number is asked."""
        return LETTERS[: len(self.order)]

    def text_of(self, letter: str) -> str:
        """Return the Markdown that a letter stands for."""
        return self.variant.lettered_texts[self.place_of(letter)]

    def place_of(self, letter: str) -> int:
        """Return the position in the bank of what a letter stands for."""
        return self.order[LETTERS.index(letter)]

    def letters_of(self, places: Iterable[int]) -> str:
        """Return the letters of positions in the bank, in the order given."""
        return "".join(LETTERS[self.order.index(place)] for place in places)


@dataclass(frozen=True)
class Paper:
    """The questions of one attempt of one student."""

    bank: Bank
    student: str
    attempt: int
    items: tuple[PaperItem, ...]

    def find_item(self, concept: str) -> PaperItem | None:
        """Return the question about a concept, if it is in this quiz."""
        return next((item for item in self.items if item.concept.id == concept), None)


def draw(bank: Bank, student: str, attempt: int) -> Paper:
    """Deal the quiz of a student's attempt (counted from 1).

    Successive attempts go through all variants of a concept before one comes back, and no two
    successive ones have the same.
    """
    items = []
    for number, concept in enumerate(bank.concepts, start=1):
        variant = _choose_variant(bank, concept, student, attempt)
        seed = f"{student}\0{bank.quiz}\0{attempt}\0{variant.id}"
        items.append(
            PaperItem(number, concept, variant, _letter_order(variant, seed, closed=bank.closed))
        )
    return Paper(bank, student, attempt, tuple(items))


def _choose_variant(bank: Bank, concept: Concept, student: str, attempt: int) -> Variant:
    count = len(concept.variants)
    round_, step = divmod(attempt - 1, count)
    if count < 3:
        round_ = 0  # one always, or two by turns: another order would repeat one
    seed = f"{student}\0{bank.quiz}\0{concept.id}"
    places = _shuffled(count, f"{seed}\0{round_}")
    if round_ and places[0] == _shuffled(count, f"{seed}\0{round_ - 1}")[-1]:
        # The last of a round must not be the first of the next; its own last stays in place, for
        # the round after this one looks at it.
        places = [places[1], places[0], *places[2:]]
    return concept.variants[places[step]]


def _letter_order(variant: Variant, seed: str, *, closed: bool) -> tuple[int, ...]:
    if isinstance(variant, Numeric):
        return ()
    places = _shuffled(len(variant.lettered_texts), seed)
    if isinstance(variant, Ordering | Matching) or closed:
        # The bank has these in the right order: a student who knows the shuffle could undo it. So
        # the shuffle starts from alphabetical order. A closed quiz's bank must give no order away
        # either.
        base = sorted(range(len(places)), key=variant.lettered_texts.__getitem__)
        places = [base[place] for place in places]
    if isinstance(variant, Ordering) and places == sorted(places) and not closed:
        places = [*places[1:], places[0]]  # shown in the right order, it would need no answer
    return tuple(places)


def _shuffled(count: int, seed: str) -> list[int]:
    return sorted(
        range(count), key=lambda place: hashlib.sha256(f"{seed}\0{place}".encode()).digest()
    )


def right_answer(item: PaperItem) -> str | float:
    """Return the right answer to a question, in the form in which answers are saved."""
    variant = item.variant
    if isinstance(variant, Numeric):
        return variant.answer
    if isinstance(variant, Ordering):
        return item.letters_of(range(len(variant.items)))
    if isinstance(variant, Matching):
        return item.letters_of(variant.lettered_texts.index(pair.right) for pair in variant.pairs)
    return "".join(sorted(item.letters_of(variant.right_positions)))
