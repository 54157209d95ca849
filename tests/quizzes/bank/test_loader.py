"""A bank is sound, or one sentence says what is wrong with it, and where."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

import quizzes
from quizzes.bank import loader
from quizzes.bank.loader import load_bank, read_bank
from quizzes.errors import BankError
from tests.quizzes import sample

Change = Callable[[dict[str, Any]], None]


def variant(data: dict[str, Any], kind: str) -> dict[str, Any]:
    concept = next(c for c in data["concepts"] if c["id"] == kind)
    found: dict[str, Any] = concept["variants"][1]
    return found


def change(kind: str, /, **fields: Any) -> Change:
    """Return a change of one variant; the value None removes a field."""

    def apply(data: dict[str, Any]) -> None:
        target = variant(data, kind)
        for name, value in fields.items():
            target[name] = value
            if value is None:
                del target[name]

    return apply


def option(kind: str, /, **fields: Any) -> Change:
    def apply(data: dict[str, Any]) -> None:
        change_ = {k: v for k, v in fields.items() if v is not None}
        options = variant(data, kind)["options"]
        options[1] = {k: v for k, v in options[1].items() if k not in fields} | change_

    return apply


def top(**fields: Any) -> Change:
    return lambda data: data.update(fields)


def fewer(data: dict[str, Any]) -> None:
    del data["concepts"][0]["variants"][3]


def twice(data: dict[str, Any]) -> None:
    data["concepts"][0]["variants"][0]["id"] = "numeric-3"


BROKEN: list[tuple[Change, list[str]]] = [
    (option("predict", feedback=None), ["'predict-2'", "options 2 feedback", "required"]),
    (option("predict", misconception=None), ["options 2 misconception: a wrong option needs"]),
    (option("predict", misconception="nobody"), ["'predict-2'", "no misconception 'nobody'"]),
    (option("predict", text=42),
     ["'predict-2'", "options 2 text", "YAML reads 42 as a number: write '42'"]),
    (option("predict", correct="yes"),
     ["'predict-2'", "options 2 correct", "true or false, not 'yes': write true"]),
    (option("predict", show="print("), ["'predict-2'", "options 2 show", "no Python"]),
    (option("predict", misconception=None, correct=True), ["'predict-2', field options: exactly"]),
    (change("multiple", options=[sample.option("a"), sample.option("b")]),
     ["'multiple-2'", "field options: at least one"]),
    (option("predict", text="**alpha** $x^2$ <b>predict</b>"),
     ["'predict-2'", "field options 2 text: the text"]),
    (change("predict", kind=None), ["'predict-2', field kind: it must be one of single"]),
    (change("predict", proof=[]), ["'predict-2', field proof: it must have at least 1, not 0"]),
    (change("predict", proof=[" "]), ["'predict-2', field proof 1: it is empty"]),
    (change("predict", code=None), ["'predict-2'", "code", "required"]),
    (change("predict", kind="guess"), ["'predict-2'", "field kind: it must be one of"]),
    (change("predict", kind="multipel"), ["field kind", "did you mean 'multiple'?"]),
    (change("predict", hint="x"), ["'predict-2'", "hint: there is no such field here, only id"]),
    (change("predict", optoins=[]), ["'predict-2'", "optoins", "did you mean 'options'?"]),
    (change("predict", stem="![](assets/dot.svg)"), ["'predict-2'", "stem", "description"]),
    (change("predict", stem="![x](assets/no.svg)"), ["'predict-2'", "stem", "cannot be read"]),
    (change("predict", stem="![x](../../x.svg)"), ["'predict-2'", "stem", "folder of the bank"]),
    (change("predict", stem="![x](https://h.org/x.svg)"), ["'predict-2'", "folder of the bank"]),
    (change("predict", stem="![x](sample.yaml)"), ["'predict-2'", "none of SVG"]),
    (change("predict", stem=" "), ["'predict-2'", "stem: it is empty"]),
    (change("numeric", answer=float("nan")), ["'numeric-2'", "answer", "finite"]),
    (change("numeric", answer=100.05), ["'numeric-2'", "traps 1 value: the trap 100 lies within"]),
    (change("numeric", tolerance=-1.0), ["'numeric-2'", "tolerance: it must be at least 0"]),
    (change("ordering", items=["a", "b"]), ["'ordering-2'", "items", "at least 3"]),
    (change("ordering", items=["a", "b", "a"]), ["'ordering-2', field items 3: the text 'a'"]),
    (change("matching", extras=["right x"]), ["'matching-2'", "extras 1: an extra is"]),
    (change("matching", pairs=[{"left": "a", "right": "x"}, {"left": "a", "right": "y"}]),
     ["'matching-2'", "field pairs 2 left: the left side 'a' is there twice"]),
    (change("matching", pairs=[{"left": "a", "right": "x"}, {"left": "b", "right": "x"}]),
     ["'matching-2'", "field pairs: all have the same right side"]),
    (change("multiple", proof=None), ["'multiple-2'", "field proof: ", "required"]),
    (top(quiz="other"), ["field quiz", "file's name says 'sample'"]),
    (top(pass_mark=6), ["field pass_mark", "6 of 5 concepts is impossible"]),
    (top(pass_mark=0), ["field pass_mark"]),
    (top(misconceptions={"Bad Id": "x"}),
     ["misconceptions Bad Id: 'Bad Id' is no id: write lower-case"]),
    (top(title=None), ["field title: it must be text, but nothing stands there"]),
    (fewer, ["item 'predict'", "field variants", "at least 4"]),
    (twice, ["'numeric-3'", "id is used twice"]),
]  # fmt: skip


@pytest.mark.parametrize(("broken", "says"), BROKEN)
def test_a_broken_bank_is_one_sentence(broken: Change, says: list[str], tmp_path: Path) -> None:
    data = copy.deepcopy(sample.data())
    broken(data)
    with pytest.raises(BankError) as caught:
        read_bank(sample.write(tmp_path, data))
    sentence = str(caught.value)
    assert sentence.startswith("sample.yaml, line ")
    assert sentence.endswith((".", "?"))
    assert "\n" not in sentence
    for part in says:
        assert part in sentence, sentence


@pytest.mark.parametrize("proof", [[], "", [""], None])
def test_no_variant_of_the_real_quiz_can_lose_its_proofs(proof: Any) -> None:
    data = yaml.safe_load((loader.BANKS / "ch05.yaml").read_text(encoding="utf-8"))
    for target in [one for concept in data["concepts"] for one in concept["variants"]]:
        before, target["proof"] = target["proof"], proof
        with pytest.raises(BankError, match=rf"^ch05\.yaml, item '{target['id']}', field proof"):
            loader.validate_bank(data, "ch05.yaml", "ch05", loader.BANKS)
        target["proof"] = before
    loader.validate_bank(data, "ch05.yaml", "ch05", loader.BANKS)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("quiz: [", "not valid YAML"),
        ("quiz: a\nquiz: b\n", "gives the field 'quiz' a second time"),
        ("- a\n- b\n", "must be fields with their values, but it is a list"),
        ("42", "must be fields with their values, not '42'"),
        ("", "sample.yaml is empty"),
        ("# nothing yet\n---\n", "sample.yaml is empty"),
        ("a: &a [*a]\n", "sample.yaml"),
        ("!!python/object/apply:os.system ['true']", "not valid YAML"),
    ],
)
def test_a_file_that_is_no_bank_says_so(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "sample.yaml"
    path.write_text(text)
    with pytest.raises(BankError, match=r"sample\.yaml") as caught:
        read_bank(path)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bytes_that_are_no_text_say_so(tmp_path: Path) -> None:
    path = tmp_path / "sample.yaml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BankError, match="UTF-8"):
        read_bank(path)


def test_an_unknown_quiz_names_the_ones_there_are(tmp_path: Path) -> None:
    with pytest.raises(BankError, match=r"no quiz 'ch5': there are .*ch05.* Did you mean 'ch05'\?"):
        quizzes.load("ch5", folder=tmp_path)
    with pytest.raises(BankError, match="there are none"):
        load_bank("x", tmp_path)
    for escape in ("../banks/ch05", "/etc/passwd", ""):
        with pytest.raises(BankError, match="There is no quiz"):
            load_bank(escape)


def test_the_banks_of_the_package_are_sound() -> None:
    assert "ch05" in quizzes.names()
    for name in quizzes.names():
        assert load_bank(name).quiz == name


def test_an_edition_changes_with_what_answers_refer_to_and_with_nothing_else(
    tmp_path: Path,
) -> None:
    before = read_bank(sample.write(tmp_path)).edition
    data = sample.data()
    for one in data["concepts"][0]["variants"]:
        one["stem"] += "A mended stem."
        one["options"][0] = sample.option(one["options"][0]["text"], correct=True)
        one["options"][2] = sample.option(one["options"][2]["text"])
    assert read_bank(sample.write(tmp_path, data)).edition == before, "keys can be mended"
    data["concepts"][0]["variants"][0]["options"].reverse()
    assert read_bank(sample.write(tmp_path, data)).edition != before
