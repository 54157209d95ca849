"""Canvas: a bank as a QTI 1.2 package, made by text2qti (https://github.com/gpoore/text2qti).

text2qti reads a plain text of its own, checks it, and writes the zip file that Canvas imports. Each
concept becomes a question group that picks one of its variants, so a retry is a different quiz.
"""

from __future__ import annotations

import re

from text2qti.config import Config
from text2qti.err import Text2qtiError
from text2qti.qti import QTI
from text2qti.quiz import GroupStart, Quiz

from quizzes.bank.contents import Bank, Matching, Multiple, Numeric, Ordering, Variant
from quizzes.exchange import format_limits
from quizzes.exchange.platform_questions import ExchangeError, code_block, unit_line

POINTS = 1
_PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)\s]+)\)")
_TEXT_BLOCK = re.compile(r"(```.*?```)", re.DOTALL)


def make_package(bank: Bank) -> tuple[bytes, list[str]]:
    """Return a bank as the bytes of a QTI package, and what it leaves out, a sentence each.

    Raises:
        ExchangeError: text2qti does not accept a question; the message names it.
    """
    asked: dict[str, str] = {}
    for concept in bank.concepts:  # one by one first: text2qti knows lines, people know items
        for variant in concept.variants:
            text = " ".join(_format_stem(variant).split())
            if text in asked:
                raise ExchangeError(
                    f"{bank.quiz}.yaml, items '{asked[text]}' and '{variant.id}' ask the same "
                    "thing in the same words, which QTI cannot hold: change one of the stems."
                )
            asked[text] = variant.id
            try:
                _parse_quiz("\n".join(_format_question(bank, variant)) + "\n")
            except Text2qtiError as error:
                reason = " ".join(str(error).split())
                raise ExchangeError(
                    f"{bank.quiz}.yaml, item '{variant.id}' cannot be written as QTI: {reason}."
                ) from None
    return _zip_package(bank), format_limits.of_qti(bank)


def _zip_package(bank: Bank) -> bytes:
    quiz = _parse_quiz(plain_text(bank))
    groups = [part.group for part in quiz.questions_and_delims if isinstance(part, GroupStart)]
    for group, concept in zip(groups, bank.concepts, strict=True):
        group.title_xml = concept.id
    # text2qti 0.8 adds the points of every question in a group to what the group is worth, and
    # Canvas shows that sum (`Quiz.__init__`, where `points_possible` is counted).
    quiz.points_possible = sum(group.pick * group.points_per_question for group in groups)
    package = QTI(quiz)
    # text2qti has no word for the number of attempts, and writes 1.
    package.assessment_meta = _replace_once(
        package.assessment_meta, "<allowed_attempts>1<", f"<allowed_attempts>{bank.attempt_limit}<"
    )
    field = "<fieldlabel>cc_maxattempts</fieldlabel>\n        <fieldentry>{}<"
    package.assessment = _replace_once(
        package.assessment, field.format(1), field.format(bank.attempt_limit)
    )
    return bytes(package.zip_bytes())


def _replace_once(xml: str, old: str, new: str) -> str:
    if xml.count(old) != 1:
        raise ExchangeError(
            "This version of text2qti writes another package than the one that is known: install "
            "text2qti 0.8."
        )
    return xml.replace(old, new)


def plain_text(bank: Bank) -> str:
    """Return a bank in text2qti's plain text."""
    lines = [
        f"Quiz title: {' '.join(bank.title.split())}",
        f"Quiz description: {' '.join(bank.chapter.split())}. {bank.pass_text} to pass.",
        "shuffle answers: true",
        f"show correct answers: {'false' if bank.closed else 'true'}",
        "",
    ]
    for concept in bank.concepts:
        lines += ["GROUP", "pick: 1", f"points per question: {POINTS}", ""]
        for variant in concept.variants:
            lines += [*_format_question(bank, variant), ""]
        lines += ["END_GROUP", ""]
    return "\n".join(lines)


def _parse_quiz(text: str) -> Quiz:
    # Not the user's own settings: what comes out depends on the bank alone.
    return Quiz(text, config=Config(), source_name="the bank")


def _format_question(bank: Bank, variant: Variant) -> list[str]:
    lines = [f"Title: {variant.id}", f"Points: {POINTS}"]
    lines += _format_item(bank, "1.", _format_stem(variant))
    if isinstance(variant, Numeric):
        lines += _format_item(bank, "+", variant.feedback)
        lines += _format_item(bank, "-", variant.wrong_feedback or variant.feedback)
        return [*lines, f"= {variant.answer!r} +- {variant.tolerance!r}"]
    if isinstance(variant, Ordering | Matching):
        options = _list_arrangements(variant)
        lines += _format_item(bank, "+", variant.feedback)
        lines += _format_item(bank, "-", variant.wrong_feedback)
        for letter, option in zip("abcdefgh", options, strict=False):
            lines += _format_item(bank, f"{'*' if option == options[0] else ''}{letter})", option)
        return lines
    for letter, choice in zip("abcdefghij", variant.options, strict=False):
        mark = "*" if choice.correct else ""
        if isinstance(variant, Multiple):
            lines += _format_item(bank, f"[{mark or ' '}]", choice.text)
        else:
            lines += _format_item(bank, f"{mark}{letter})", choice.text)
        lines += _format_item(bank, "...", choice.feedback)
    return lines


def _format_stem(variant: Variant) -> str:
    """Return all that stands above the answers."""
    stem = variant.stem + (code_block(variant.code) if variant.code else "")
    if isinstance(variant, Numeric):
        return stem + unit_line(variant.unit)
    return stem + _to_arrange(variant) if isinstance(variant, Ordering | Matching) else stem


def _to_arrange(variant: Ordering | Matching) -> str:
    """Return what stands below the stem: the things to arrange, under numbers and letters."""
    if isinstance(variant, Ordering):
        return "\n\n" + _format_lettered(variant.items)
    lefts = "\n".join(f"- {number}: {pair.left}" for number, pair in enumerate(variant.pairs, 1))
    return (
        f"\n\n{lefts}\n\nWhat there is to choose from:\n\n"
        f"{_format_lettered(variant.lettered_texts)}"
    )


def _format_lettered(texts: list[str]) -> str:
    return "\n".join(
        f"- {_capital_letter(place)}: {text}" for place, text in enumerate(_shown_order(texts))
    )


def _list_arrangements(variant: Ordering | Matching) -> list[str]:
    """Return answers to choose from, the right one first: Canvas' QTI 1.2 has no ordering."""
    if isinstance(variant, Ordering):
        shown = _shown_order(variant.items)
        key = [_capital_letter(shown.index(item)) for item in variant.items]
        return [", ".join(letters) for letters in _near_arrangements(key)]
    shown = _shown_order(variant.lettered_texts)
    key = [_capital_letter(shown.index(pair.right)) for pair in variant.pairs]
    return [
        ", ".join(f"{number}-{letter}" for number, letter in enumerate(letters, start=1))
        for letters in _near_arrangements(key)
    ]


def _near_arrangements(key: list[str]) -> list[list[str]]:
    """Return the key, and arrangements that differ from it by swapping neighbours or turning."""
    swapped = [[*key[:i], key[i + 1], key[i], *key[i + 2 :]] for i in range(len(key) - 1)]
    others = [*swapped, [*key[1:], key[0]], key[::-1]]
    distinct = [list(letters) for letters in dict.fromkeys(map(tuple, others))]
    return [key, *[letters for letters in distinct if letters != key][:3]]


def _shown_order(texts: list[str]) -> list[str]:
    return sorted(texts)


def _capital_letter(number: int) -> str:
    return "ABCDEFGHIJKLMNOP"[number]


def _format_item(bank: Bank, mark: str, text: str | None) -> list[str]:
    """Return a text behind its mark, its further lines indented as text2qti wants it."""
    if text is None:
        return []
    first, *rest = _locate_pictures(bank, text.strip()).split("\n")
    indent = " " * (len(mark) + 1)
    return [f"{mark} {first}", *(f"{indent}{line}" if line.strip() else "" for line in rest)]


def _locate_pictures(bank: Bank, text: str) -> str:
    """Point pictures to their files, wherever the command runs."""

    def located(found: re.Match[str]) -> str:
        return f"![{found[1]}](<{(bank.folder / found[2]).as_posix()}>)"

    parts = _TEXT_BLOCK.split(text)
    return "".join(p if n % 2 else _PICTURE.sub(located, p) for n, p in enumerate(parts))
