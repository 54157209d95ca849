"""Lint: each rule finds a bank that breaks it, and says nothing of one that does not."""

from __future__ import annotations

from typing import Any

import pytest

from quizzes.bank import lint, loader
from quizzes.bank.contents import Bank

BANK = loader.load_bank("ch05")


def changed(**changes: Any) -> Bank:
    """The bank of chapter 5, its first variant's fields replaced."""
    data = BANK.model_dump()
    data["concepts"][0]["variants"][0].update(changes)
    return Bank.model_validate(data)


def option(number: int, **changes: Any) -> list[dict[str, Any]]:
    """The first variant's options, one of them changed."""
    options = [o.model_dump() for o in BANK.concepts[0].variants[0].options]  # type: ignore[union-attr]
    options[number].update(changes)
    return options


def problems(bank: Bank) -> list[str]:
    return [str(finding) for finding in lint.list_findings(bank)]


def test_a_sound_bank_has_no_findings() -> None:
    assert problems(BANK) == []


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"stem": "What is it for? And who sets it?"}, "field stem: it asks 2 questions"),
        ({"stem": "A profile controls delivery."}, "field stem: it asks nothing"),
        ({"stem": BANK.concepts[1].variants[0].stem}, "the same text stands in pattern-camera-1"),
        ({"options": option(1, text="All of the above.")}, "refers to other options"),
        ({"options": option(1, text="Both A and B, for all the endpoints.")}, "refers to other"),
        *(({"options": option(1, text=text)}, "refers to other options") for text in (
            "All the above, for every endpoint.", "All above answers, for every endpoint.",
            "All answers are correct, for every endpoint.", "Both a & b, for every endpoint.",
            "Every one of the above, for every endpoint.", "None of the above, for any endpoint.",
            "None of these options is right for it.", "Options a and c, for every endpoint.",
            "Either B or C, but never both at once.", "a, b and c, whatever the endpoint.",
            "Answer (c), but with another depth in it.", "Some of the others, but not the first.",
        )),
        ({"options": option(0, text="x" * 200)}, "the longest option has 200 characters"),
        ({"options": option(1, feedback="No.")}, "option 2: its feedback is too short"),
        ({"options": option(1, feedback="?!." * 30)}, "option 2: its feedback is too short"),
        ({"options": option(2, feedback="--- " * 30)}, "option 3: its feedback is too short"),
        ({"options": option(1, show=None)}, "option 2: it has no cell"),
        (
            {"options": option(2, text="To store the messages of a topic until each of its "
                               "subscribers has read them!")},
            "the same text stands in",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else next(iter(value)),
)  # fmt: skip
def test_each_rule_names_item_and_field(changes: dict[str, Any], problem: str) -> None:
    found = [text for text in problems(changed(**changes)) if problem in text]
    assert found, problems(changed(**changes))
    assert found[0].startswith("item 'qos-purpose-1', field ")


def test_question_marks_in_code_are_no_questions() -> None:
    stem = "Here `a?` and\n```\nwhat? is? this?\n```\nare code. What is the main purpose of QoS?"
    assert problems(changed(stem=stem)) == []


def test_a_misconception_that_nothing_shows_is_found() -> None:
    data = BANK.model_dump()
    data["misconceptions"]["moon-is-cheese"] = "The moon is made of cheese."
    assert problems(Bank.model_validate(data)) == [
        "item 'ch05', field misconceptions: no wrong answer shows 'moon-is-cheese'."
    ]


def test_a_number_without_a_hint_is_found() -> None:
    data = BANK.model_dump()
    [numeric] = [v for v in data["concepts"][1]["variants"] if v["kind"] == "numeric"]
    numeric["wrong_feedback"] = None
    assert any("field wrong_feedback" in text for text in problems(Bank.model_validate(data)))


@pytest.mark.parametrize(("length", "name"), [(150, "longest"), (9, "shortest")])
def test_keys_that_can_be_guessed_by_length_are_found(length: int, name: str) -> None:
    data = BANK.model_dump()
    for concept in data["concepts"]:
        for variant in concept["variants"]:
            if variant["kind"] in ("single", "predict"):
                [key] = [o for o in variant["options"] if o["correct"]]
                key["text"] = "x" * length
    text = f"item 'ch05', field options: the key is the {name} option in 16 of 16 questions."
    assert text in problems(Bank.model_validate(data))


@pytest.mark.parametrize(
    "text",
    [
        "All the answers from the server, as they come.", "All topics above 5 Hz on the robot.",
        "`a and b`: both of the topics are heard.", "A service, a topic and an action together.",
        "Every one of the subscribers, in any order.", "Both sides must offer the same depth.",
    ],
)  # fmt: skip
def test_what_only_sounds_like_it_is_no_finding(text: str) -> None:
    assert not [one for one in problems(changed(options=option(1, text=text))) if "refers" in one]


def test_keys_that_are_dealt_to_one_place_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lint.selection, "_shuffled", lambda count, seed: list(range(count)))
    data = BANK.model_dump()
    keys_first(data)
    assert any("stand in place 1" in text for text in problems(Bank.model_validate(data)))


def keys_first(data: dict[str, Any]) -> None:
    for variant in [one for concept in data["concepts"] for one in concept["variants"]]:
        if variant["kind"] in ("single", "predict"):
            variant["options"].sort(key=lambda option: not option["correct"])


def test_keys_that_stand_first_in_the_bank_are_found_whatever_is_dealt() -> None:
    data = BANK.model_dump()
    keys_first(data)
    assert problems(Bank.model_validate(data)) == [
        "item 'ch05', field options: the key is option 1 of 4 in 16 of 16 questions, as they stand "
        "in the bank."
    ]
