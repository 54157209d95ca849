"""Canvas: a bank as a QTI 1.2 package, made by text2qti (https://github.com/gpoore/text2qti).

text2qti reads a plain text of its own, checks it, and writes the zip file that Canvas imports. Each
concept becomes a question group that picks one of its variants, so a retry is a different quiz.
"""

from __future__ import annotations

import re

from text2qti.config import Config
from text2qti.err import Text2qtiError
from text2qti.qti import QTI
from text2qti.quiz import Quiz

from quizzes.bank import Bank, Matching, Multiple, Numeric, Ordering, Variant
from quizzes.exchange.questions import ExchangeError, code_block, unit_line

POINTS = 1
_PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)\s]+)\)")
_TEXT_BLOCK = re.compile(r"(```.*?```)", re.DOTALL)


def package(bank: Bank) -> tuple[bytes, list[str]]:
    """Return a bank as the bytes of a QTI package, and what it leaves out, a sentence each.

    Raises:
        ExchangeError: text2qti does not accept a question; the message names it.
    """
    for concept in bank.concepts:  # one by one first: text2qti knows lines, people know items
        for variant in concept.variants:
            try:
                _parsed("\n".join(_question(bank, variant)) + "\n")
            except Text2qtiError as error:
                reason = " ".join(str(error).split())
                raise ExchangeError(
                    f"{bank.quiz}.yaml, item '{variant.id}' cannot be written as QTI: {reason}."
                ) from None
    return bytes(QTI(_parsed(plain_text(bank))).zip_bytes()), _notes(bank)


def plain_text(bank: Bank) -> str:
    """Return a bank in text2qti's plain text."""
    lines = [
        f"Quiz title: {' '.join(bank.title.split())}",
        f"Quiz description: {' '.join(bank.chapter.split())}. {bank.pass_text} to pass.",
        "shuffle answers: true",
        "",
    ]
    for concept in bank.concepts:
        lines += ["GROUP", "pick: 1", f"points per question: {POINTS}", ""]
        for variant in concept.variants:
            lines += [*_question(bank, variant), ""]
        lines += ["END_GROUP", ""]
    return "\n".join(lines)


def _parsed(text: str) -> Quiz:
    # Not the user's own settings: what comes out depends on the bank alone.
    return Quiz(text, config=Config(), source_name="the bank")


def _question(bank: Bank, variant: Variant) -> list[str]:
    lines = [f"Title: {variant.id}", f"Points: {POINTS}"]
    stem = variant.stem + (code_block(variant.code) if variant.code else "")
    if isinstance(variant, Numeric):
        lines += _item(bank, "1.", stem + unit_line(variant.unit))
        lines += _item(bank, "+", variant.feedback)
        lines += _item(bank, "-", variant.wrong_feedback or variant.feedback)
        return [*lines, f"= {variant.answer!r} +- {variant.tolerance!r}"]
    if isinstance(variant, Ordering | Matching):
        options = _arrangements(variant)
        lines += _item(bank, "1.", stem + _to_arrange(variant))
        lines += _item(bank, "+", variant.feedback)
        lines += _item(bank, "-", variant.wrong_feedback)
        for letter, option in zip("abcdefgh", options, strict=False):
            lines += _item(bank, f"{'*' if option == options[0] else ''}{letter})", option)
        return lines
    lines += _item(bank, "1.", stem)
    for letter, choice in zip("abcdefghij", variant.options, strict=False):
        mark = "*" if choice.correct else ""
        if isinstance(variant, Multiple):
            lines += _item(bank, f"[{mark or ' '}]", choice.text)
        else:
            lines += _item(bank, f"{mark}{letter})", choice.text)
        lines += _item(bank, "...", choice.feedback)
    return lines


def _to_arrange(variant: Ordering | Matching) -> str:
    """Return what stands below the stem: the things to arrange, under numbers and letters."""
    if isinstance(variant, Ordering):
        return "\n\n" + _lettered(variant.items)
    lefts = "\n".join(f"- {number}: {pair.left}" for number, pair in enumerate(variant.pairs, 1))
    return f"\n\n{lefts}\n\nWhat there is to choose from:\n\n{_lettered(variant.texts)}"


def _lettered(texts: list[str]) -> str:
    return "\n".join(f"- {_letter(place)}: {text}" for place, text in enumerate(_shown(texts)))


def _arrangements(variant: Ordering | Matching) -> list[str]:
    """Return answers to choose from, the right one first: Canvas' QTI 1.2 has no ordering."""
    if isinstance(variant, Ordering):
        shown = _shown(variant.items)
        key = [_letter(shown.index(item)) for item in variant.items]
        return [", ".join(letters) for letters in _near(key)]
    shown = _shown(variant.texts)
    key = [_letter(shown.index(pair.right)) for pair in variant.pairs]
    return [
        ", ".join(f"{number}-{letter}" for number, letter in enumerate(letters, start=1))
        for letters in _near(key)
    ]


def _near(key: list[str]) -> list[list[str]]:
    """Return the key, and arrangements that differ from it by swapping neighbours or turning."""
    swapped = [[*key[:i], key[i + 1], key[i], *key[i + 2 :]] for i in range(len(key) - 1)]
    others = [*swapped, [*key[1:], key[0]], key[::-1]]
    distinct = [list(letters) for letters in dict.fromkeys(map(tuple, others))]
    return [key, *[letters for letters in distinct if letters != key][:3]]


def _shown(texts: list[str]) -> list[str]:
    return sorted(texts)


def _letter(number: int) -> str:
    return "ABCDEFGHIJKLMNOP"[number]


def _item(bank: Bank, mark: str, text: str) -> list[str]:
    """Return a text behind its mark, its further lines indented as text2qti wants it."""
    first, *rest = _pictures(bank, text.strip()).split("\n")
    indent = " " * (len(mark) + 1)
    return [f"{mark} {first}", *(f"{indent}{line}" if line.strip() else "" for line in rest)]


def _pictures(bank: Bank, text: str) -> str:
    """Point pictures to their files, wherever the command runs."""

    def located(found: re.Match[str]) -> str:
        return f"![{found[1]}](<{(bank.folder / found[2]).as_posix()}>)"

    parts = _TEXT_BLOCK.split(text)
    return "".join(p if n % 2 else _PICTURE.sub(located, p) for n, p in enumerate(parts))


def _notes(bank: Bank) -> list[str]:
    variants = [variant for concept in bank.concepts for variant in concept.variants]
    arranged = [v.id for v in variants if isinstance(v, Ordering | Matching)]
    trapped = [v.id for v in variants if isinstance(v, Numeric) and v.traps]
    notes = [
        "There is no place for misconceptions, for the cells that show what really happens, and "
        "for the names of the proofs: they stay in the bank.",
        f"The pass mark ({bank.pass_text}) is a setting of the quiz in Canvas.",
        "Canvas gives its own partial credit where several options are right.",
    ]
    if arranged:
        notes.append(
            f"text2qti has neither ordering nor matching: {', '.join(arranged)} became choices "
            "between whole arrangements, without partial credit."
        )
    if trapped:
        notes.append(
            f"A number has one feedback for all wrong answers: {', '.join(trapped)} lost the "
            "feedback for particular wrong numbers."
        )
    return notes
