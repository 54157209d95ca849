"""Brings questions from a learning platform back into a bank.

A question that a bank has under the same name is compared with what the bank would export. What is
equal stays as the bank has it, with its picture and its formulas; what is not takes the new text,
and keeps the misconceptions, cells and proofs of the answers that it can recognize. What a bank
that teaches needs, and a question comes without, is filled in for its author to find; a closed bank
goes without.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from quizzes.bank import loader
from quizzes.bank.contents import Bank, Concept
from quizzes.errors import BankError
from quizzes.exchange.platform_questions import (
    BOTH,
    POSITION,
    ChoiceQuestion,
    ExchangeError,
    MatchQuestion,
    NumberQuestion,
    Question,
    code_block,
    from_plain,
    of_variant,
    to_plain,
    unit_line,
)

UNNAMED = "not-named-yet"
"""The misconception of wrong answers that come without one."""
UNPROVEN = "not proven yet"
"""The proof of a question that comes without one; the bank's tests refuse it."""

NO_FEEDBACK = "This answer was imported without feedback."

_UNIT = re.compile(r"\n\n\*\(Answer in ([^)\n]+)\.\)\*$")
_ID = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_CODE_AT_END = re.compile(r"\n\n```python\n((?:(?!```).)*)\n```$", re.DOTALL)


@dataclass(frozen=True)
class Merged:
    """A bank as it is after an import, and what a person should know, a sentence each."""

    bank: Bank
    notes: list[str]
    changed: int

    def to_yaml(self) -> str:
        """Return the bank as YAML."""
        return dump_bank(self.bank)


def merge_questions(bank: Bank, questions: Sequence[Question], source: str) -> Merged:
    """Return ``bank`` with the questions of a file named ``source`` in it.

    Raises:
        ExchangeError: a question cannot be placed, or the bank would not hold together.
    """
    data = bank.model_dump(exclude_none=True)
    known = {variant.id: (concept, variant) for concept in bank.concepts
             for variant in concept.variants}  # fmt: skip
    notes: list[str] = []
    changed = 0
    for question in questions:
        concept, variant = known.get(question.name, (None, None))
        place = _find_variants(data, question, concept, source)
        if concept is None or variant is None:
            changed += 1
            place.append(_build_variant(question, None, {}, teaches=not bank.closed))
            lacks = "" if bank.closed else ": name its proofs, misconceptions and cells"
            notes.append(f"'{question.name}' is new{lacks}.")
            continue
        before = of_variant(bank.quiz, concept, variant)
        if _is_same(before, question):
            continue
        changed += 1
        index = next(i for i, old in enumerate(place) if old["id"] == variant.id)
        place[index] = _build_variant(question, before, place[index], teaches=not bank.closed)
        proven = ": see that its proofs still prove its key" if variant.proof else ""
        notes.append(f"'{question.name}' has changed{proven}.")
    missing = known.keys() - {question.name for question in questions}
    if missing:
        notes.append(f"{source} does not have {', '.join(sorted(missing))}: kept as they are.")
    if UNNAMED in str(data["concepts"]):
        data["misconceptions"][UNNAMED] = "Imported: name the belief behind this answer."
    try:
        merged = loader.validate_bank(data, source, bank.quiz, bank.folder, noun="question")
    except BankError as error:
        raise ExchangeError(str(error)) from None
    return Merged(merged, notes, changed)


def dump_bank(bank: Bank) -> str:
    """Return a bank as YAML that people can edit: texts of several lines as blocks."""
    usual = {name for name in ("closed", "keyless") if not getattr(bank, name)}
    data = bank.model_dump(exclude_none=True, exclude=usual)
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)


class _Dumper(yaml.SafeDumper):
    pass


def _represent_text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar(
        "tag:yaml.org,2002:str", text, style="|" if "\n" in text else None
    )


_Dumper.add_representer(str, _represent_text)


def _find_variants(
    data: dict[str, Any], question: Question, concept: Concept | None, source: str
) -> list[dict[str, Any]]:
    if concept is None and not _ID.fullmatch(question.name):
        raise ExchangeError(
            f"{source}, question '{question.name}': a new question's name becomes its id, which is "
            "lower-case words joined by hyphens; call it something like 'qos-purpose-6'."
        )
    name = concept.id if concept else question.category.rpartition("/")[2]
    for candidate in data["concepts"]:
        if candidate["id"] == name:
            variants: list[dict[str, Any]] = candidate["variants"]
            return variants
    names = ", ".join(candidate["id"] for candidate in data["concepts"])
    raise ExchangeError(
        f"{source}, question '{question.name}': its category '{question.category}' is no concept "
        f"of the bank '{data['quiz']}'; put it under one of {names}."
    )


def _is_same(before: Question, question: Question) -> bool:
    """Whether a question says what the bank would export; where it is filed does not matter."""
    return {**vars(before), "category": ""} == {**vars(question), "category": ""}


def _build_variant(
    question: Question, before: Question | None, old: dict[str, Any], *, teaches: bool
) -> dict[str, Any]:
    """Return a variant's fields from a question, with all that can be kept of the old ones."""
    data: dict[str, Any] = {"id": question.name}
    if isinstance(question, ChoiceQuestion):
        kind = "multiple" if not question.one else "single"
        data["kind"] = "predict" if kind == "single" and old.get("kind") == "predict" else kind
    elif isinstance(question, NumberQuestion):
        data["kind"] = "numeric"
    else:
        data["kind"] = "ordering" if _is_ordering(question) else "matching"
    data |= _text_fields(question, before, old)
    data["proof"] = old.get("proof", [UNPROVEN])
    if isinstance(question, ChoiceQuestion):
        data |= _option_fields(question, old)
    elif isinstance(question, NumberQuestion):
        data |= _number_fields(question, old)
    else:
        data |= _pair_fields(question, old)
    return data if teaches else _without_fillers(data)


def _without_fillers(data: dict[str, Any]) -> dict[str, Any]:
    """Return a variant without what only stands in for something that teaching needs."""
    fillers = (UNNAMED, NO_FEEDBACK, [UNPROVEN])
    kept = {name: value for name, value in data.items() if value not in fillers}
    for name in ("options", "traps"):
        if name in kept:
            kept[name] = [_without_fillers(part) for part in kept[name]]
    return kept


def _text_fields(
    question: Question, before: Question | None, old: dict[str, Any]
) -> dict[str, Any]:
    if before is not None and before.text == question.text:
        return {name: old[name] for name in ("stem", "code", "unit") if old.get(name)}
    text = question.text
    fields: dict[str, Any] = {}
    if found := _UNIT.search(text):
        assert unit_line(found[1]) == found[0]
        fields["unit"] = found[1]
        text = text[: found.start()]
    if old.get("code") and (found := _CODE_AT_END.search(text)):
        same = code_block(old["code"]) == found[0]
        fields["code"] = old["code"] if same else f"{found[1]}\n"
        text = text[: found.start()]
    return {"stem": _keep_form(text, old.get("stem")), **fields}


def _keep_form(text: str, *candidates: str | None) -> str:
    """Return the bank's own form of a text if one of them is exported as it, else the text."""
    return next((c for c in candidates if c is not None and to_plain(c) == text), from_plain(text))


def _option_fields(question: ChoiceQuestion, old: dict[str, Any]) -> dict[str, Any]:
    left = list(old.get("options", []))
    options = []
    for choice in question.choices:
        correct = choice.share > 0
        twin = _find_twin(left, choice.text, choice.feedback, correct=correct)
        if twin:
            left.remove(twin)
        option: dict[str, Any] = {
            "text": _keep_form(choice.text, twin.get("text")),
            "feedback": _keep_form(choice.feedback, twin.get("feedback")) or NO_FEEDBACK,
        }
        if correct:
            option["correct"] = True
        else:
            option["misconception"] = twin.get("misconception", UNNAMED)
        if twin.get("show"):
            option["show"] = twin["show"]
        options.append(option)
    return {"options": options}


def _find_twin(
    left: list[dict[str, Any]], text: str, feedback: str, *, correct: bool
) -> dict[str, Any]:
    """Return the old option that this one was: of the same text, or else of the same feedback."""
    mine = [option for option in left if bool(option.get("correct")) is correct]
    for field, wanted in (("text", text), ("feedback", feedback)):
        for option in mine:
            if to_plain(option.get(field)) == wanted:
                return option
    return {}


def _number_fields(question: NumberQuestion, old: dict[str, Any]) -> dict[str, Any]:
    [right] = [number for number in question.numbers if number.share == 100]
    traps = []
    known = {trap["value"]: trap for trap in old.get("traps", [])}
    for number in question.numbers:
        if number is right:
            continue
        twin = known.get(number.value, {})
        trap = {
            "value": number.value,
            "tolerance": number.tolerance,
            "misconception": twin.get("misconception", UNNAMED),
            "feedback": _keep_form(number.feedback, twin.get("feedback")) or NO_FEEDBACK,
        }
        traps.append(trap | ({"show": twin["show"]} if twin.get("show") else {}))
    fields: dict[str, Any] = {
        "answer": right.value,
        "tolerance": right.tolerance,
        "feedback": _keep_form(right.feedback or question.feedback, old.get("feedback"))
        or NO_FEEDBACK,
        "traps": traps,
    }
    if question.wrong_feedback:
        fields["wrong_feedback"] = _keep_form(question.wrong_feedback, old.get("wrong_feedback"))
    return fields | {name: old[name] for name in ("misconception", "show") if old.get(name)}


def _is_ordering(question: MatchQuestion) -> bool:
    positions = [POSITION.format(number=n) for n in range(1, len(question.pairs) + 1)]
    return not question.extras and [left for left, _ in question.pairs] == positions


def _pair_fields(question: MatchQuestion, old: dict[str, Any]) -> dict[str, Any]:
    right, _, wrong = question.feedback.partition(BOTH)
    fields: dict[str, Any] = {
        "feedback": _keep_form(right, old.get("feedback")) or NO_FEEDBACK,
        "wrong_feedback": _keep_form(wrong or right, old.get("wrong_feedback")) or NO_FEEDBACK,
        "misconception": old.get("misconception", UNNAMED),
    }
    if old.get("show"):
        fields["show"] = old["show"]
    if _is_ordering(question):
        items = old.get("items", [])
        return {"items": [_keep_form(item, *items) for _, item in question.pairs], **fields}
    lefts = [pair["left"] for pair in old.get("pairs", [])]
    rights = [*(pair["right"] for pair in old.get("pairs", [])), *old.get("extras", [])]
    pairs = [
        {"left": _keep_form(left, *lefts), "right": _keep_form(right, *rights)}
        for left, right in question.pairs
    ]
    return {"pairs": pairs, "extras": [_keep_form(e, *rights) for e in question.extras], **fields}
