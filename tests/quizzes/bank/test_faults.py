"""All that is wrong with a bank is said at once, each fault in a sentence that knows its line."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import pytest
import yaml

from quizzes.bank import loader
from quizzes.bank.contents import Bank, Numeric
from quizzes.bank.loader import read_bank
from quizzes.errors import BankError
from tests.quizzes import sample

EXAM = loader.BANKS.parent / "examples" / "exam.yaml"

BAD = """\
quiz: bad
titel: Hello
chapter: 20240101
pass_mark: "2"
misconceptions:
  5: x
concepts:
  - id: one
    objective: [12, 30]
    variants:
      - id: a-1
        kind: singel
        stem: true
        options:
          - text: true
            correct: "true"
          - text: first
            feedback: so
      - id: a-2
        kind: numeric
        stem: |
          What? ![x](assets/none.svg)
        answer: 1,5
        tolerance: -2
      - id: a-2
        kind: single
        stem: {a}
        code: "print("
        proof: test_x
        options:
          - text: x
            correct: true
            hint: y
          - text: x
            correct: true
            misconception: nobody
          - just this
  - id: Two
    objective:
    variants: []
  - nothing
"""
SAID = """\
line 1, field title: it is missing, and is required here.
line 2, field titel: there is no such field: did you mean 'title'?
line 3, field chapter: it must be text, but YAML reads 20240101 as a number: write '20240101', in quotes.
line 4, field pass_mark: it must be a whole number, not '2': write 2 without quotes.
line 5, field misconceptions: it must be text, but YAML reads 5 as a number: write '5', in quotes.
line 9, item 'one', field objective: it must be text, but it is a list; a text that begins with { or [ must stand in quotes.
line 10, item 'one', field variants: it must have at least 4 in a quiz that teaches, not 3.
line 11, item 'a-1', field proof: PROOF.
line 12, item 'a-1', field kind: it must be one of single, predict, multiple, numeric, ordering, matching: did you mean 'single'?
line 13, item 'a-1', field stem: it must be text, but YAML reads true as true or false: write 'true', in quotes.
line 15, item 'a-1', field options 1 text: it must be text, but YAML reads true as true or false: write 'true', in quotes.
line 15, item 'a-1', field options 1 feedback: PROOF.
line 16, item 'a-1', field options 1 correct: it must be true or false, not 'true' in quotes.
line 17, item 'a-1', field options 2 misconception: a wrong option needs a misconception in a quiz that teaches.
line 19, item 'a-2', field proof: PROOF.
line 19, item 'a-2', field feedback: PROOF.
line 21, item 'a-2', field stem: the image 'assets/none.svg' cannot be read (No such file or directory).
line 23, item 'a-2', field answer: it must be a number, not '1,5': write 1.5 without quotes.
line 24, item 'a-2', field tolerance: it must be at least 0, not -2.
line 25, item 'a-2', field id: this id is used twice.
line 27, item 'a-2', field stem: it must be text, but it is fields with values; a text that begins with { or [ must stand in quotes.
line 28, item 'a-2', field code: this is no Python ('(' was never closed (cell, line 1)).
line 31, item 'a-2', field options 1 feedback: PROOF.
line 33, item 'a-2', field options 1 hint: there is no such field here, only text, correct, feedback, misconception, show.
line 34, item 'a-2', field options 2 feedback: PROOF.
line 34, item 'a-2', field options 2 text: the text 'x' stands there twice.
line 36, item 'a-2', field options 2 misconception: a right option has no misconception.
line 36, item 'a-2', field options 2 misconception: there is no misconception 'nobody' in the bank's table.
line 37, item 'a-2', field options 3: it must be fields with their values, not 'just this'.
line 38, item 'Two', field id: 'Two' is no id: write lower-case words joined by hyphens, such as qos-purpose.
line 39, item 'Two', field objective: it must be text, but nothing stands there.
line 40, item 'Two', field variants: it must have at least 1, not 0.
line 41, field concepts 3: it must be fields with their values, not 'nothing'.
""".replace(  # noqa: E501 - one fault a line
    "PROOF", "it is required in a quiz that teaches; one with 'closed: true' goes without"
)


def faults(path: Path) -> list[str]:
    with pytest.raises(BankError) as caught:
        read_bank(path)
    return list(caught.value.faults)


def test_every_fault_is_said_at_once_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(BAD)
    said = faults(path)
    assert sorted(said) == sorted(f"bad.yaml, {line}" for line in SAID.splitlines())
    lines = [int(sentence.split()[2].rstrip(",")) for sentence in said]
    assert lines == sorted(lines), "in the order of the file"


def test_a_closed_quiz_is_not_asked_for_what_only_teaching_needs(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(BAD.replace("quiz: bad", "quiz: bad\nclosed: true"))
    said = faults(path)
    assert not [sentence for sentence in said if "teaches" in sentence]
    assert len(said) == len([line for line in SAID.splitlines() if "teaches" not in line])


def test_the_first_fault_stands_in_the_error_with_the_number_of_the_others(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(BAD)
    with pytest.raises(BankError, match=r"^bad.yaml, line 1, field title: .* \(and 32 more\)\.$"):
        read_bank(path)


@pytest.mark.parametrize(
    ("kind", "field", "value", "count"),
    [
        ("numeric", "traps", [{"value": 5.0}, {"value": 99.0}, {"value": 5.05}], 2),
        ("matching", "extras", ["right x", "new", "right y"], 2),
        ("matching", "pairs", [{"left": "a", "right": "b"}] * 3, 3),
    ],
)
def test_several_faults_of_one_field_are_all_said(
    tmp_path: Path, kind: str, field: str, value: Any, count: int
) -> None:
    data = sample.data() | {"closed": True}
    concept = next(c for c in data["concepts"] if c["id"] == kind)
    concept["variants"][1][field] = value
    assert len(faults(sample.write(tmp_path, data))) == count


def test_fields_given_twice_come_first_with_both_lines(tmp_path: Path) -> None:
    path = tmp_path / "twice.yaml"
    path.write_text("quiz: twice\ntitle: a\nconcepts:\n  - id: a\n    id: b\ntitle: b\n")
    assert faults(path)[:2] == [
        "twice.yaml, line 5: this gives the field 'id' a second time, after line 4.",
        "twice.yaml, line 6: this gives the field 'title' a second time, after line 2.",
    ]


def test_a_merged_mapping_gives_no_field_twice(tmp_path: Path) -> None:
    """YAML's `<<: *name` takes over fields, and fields of its own go before them."""
    text = EXAM.read_text()
    options = textwrap.indent('- &one {text: "One", correct: true}\n- {<<: *one, text: "Two"}\n',
                              " " * 10)  # fmt: skip
    start, end = text.index('          - text: "One'), text.index("  - id: timer-rate")
    path = tmp_path / "exam.yaml"
    path.write_text(text[:start] + options + text[end:])
    [fault] = faults(path)
    assert fault == (
        "exam.yaml, line 16, item 'matching-rule-1', field options: exactly one option must be "
        "correct, not 2."
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("quiz: a\n\ttitle: b", "line 2: a tab stands where YAML wants blanks"),
        ("quiz: a\nconcepts:\n  - id: b\n\t  c: d", "line 4: a tab stands where YAML wants blanks"),
        ("quiz: a\ntitle: What: this", "line 2: a text with ': ' in it must stand in quotes"),
        ("quiz: a\ntitle: `x` is", "line 2: a text that begins with ` must stand in quotes"),
        ("quiz: a\ntitle: @x", "line 2: a text that begins with @ must stand in quotes"),
        ("quiz: a\ntitle: %x", "line 2: a text that begins with % must stand in quotes"),
        ("quiz: a\ntitle: *x*", "line 2: a text that begins with * must stand in quotes"),
        ("quiz: a\ntitle: *bold text*", "line 2: a text that begins with * must stand in quotes"),
        ("quiz: a\ntitle: !x y", "line 2: a text that begins with ! must stand in quotes"),
        ("quiz: a\ntitle: 'it's'", "line 2: this does not fit what stands above it"),
        ("quiz: a\ntitle: 'it\nchapter: b", "line 3: a quote that opens before is never closed"),
        ("quiz: a\ntitle: [a, b\nchapter: c", "line 3: a bracket that opens before"),
        ("quiz: a\n---\nquiz: b", "line 2: '---' begins a second document here"),
        ("quiz: a\n title: b", "line 2: a text with ': ' in it must stand in quotes; without one"),
        ("quiz: a\ntitle\nchapter: c", "line 3: there is no ':' behind a field's name"),
        ("quiz: a\ntitle: \x00", "line 2: the character 0x0000 is not allowed; delete it."),
        ("quiz: a\n? [b]\n: c", "line 2: the name of a field must be a word"),
        ('quiz: "C:\\quiz"', "line 1: between double quotes a backslash begins something special"),
        ("- a\nquiz: b", "line 2: this does not fit what stands above it"),
        ("[" * 1500, "nested too deeply"),
    ],
)
def test_what_is_no_yaml_is_said_in_plain_words(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "sample.yaml"
    path.write_text(text)
    [fault] = faults(path)
    assert fault.startswith("sample.yaml is not valid YAML: ")
    assert said in fault
    assert "\n" not in fault


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("quiz: a\ntitle: Übung".encode("latin-1"), "sample.yaml, line 2: this is not UTF-8 text"),
        ("quiz: a\n".encode("utf-16"), "sample.yaml, line 1: this is not UTF-8 text"),
        (b"x" * (loader.MAX_SIZE_BYTES + 1), "sample.yaml is larger than 4 MB: split the quiz."),
    ],
)
def test_what_cannot_be_read_says_so(content: bytes, said: str, tmp_path: Path) -> None:
    path = tmp_path / "sample.yaml"
    path.write_bytes(content)
    [fault] = faults(path)
    assert said in fault


def test_a_byte_order_mark_and_dos_lines_do_no_harm(tmp_path: Path) -> None:
    path = sample.write(tmp_path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert read_bank(path).quiz == sample.NAME


def test_a_long_text_is_no_fault(tmp_path: Path) -> None:
    data = sample.data()
    data["concepts"][0]["variants"][0]["stem"] = "What? " + "x " * 60_000
    bank = read_bank(sample.write(tmp_path, data))
    assert len(bank.concepts[0].variants[0].stem) > 100_000


@pytest.mark.parametrize(
    ("written", "means"),
    [("yes", "yes"), ("No", "No"), ("on", "on"), ("12:30", "12:30"), ("2024-01-01", "2024-01-01"),
     ("1_000", "1_000"), ("0x", "0x"), ("=", "=")],
)  # fmt: skip
def test_a_text_is_what_it_looks_like(written: str, means: str, tmp_path: Path) -> None:
    path = tmp_path / "exam.yaml"
    text = EXAM.read_text().replace("right: service", f"right: {written}")
    path.write_text(text.replace('title: "Midterm"', f"title: {written}"))
    bank = read_bank(path)
    assert bank.title == means
    assert means in bank.concepts[2].variants[0].lettered_texts


@pytest.mark.parametrize(
    ("written", "means"),
    [("1e3", 1000.0), ("010", 10.0), ("-2", -2.0), ("+.5", 0.5), ("2.", 2.0), ("1.5E-3", 0.0015)],
)
def test_a_number_is_what_it_looks_like(written: str, means: float, tmp_path: Path) -> None:
    path = tmp_path / "exam.yaml"
    path.write_text(EXAM.read_text().replace("answer: 20", f"answer: {written}"))
    question = read_bank(path).concepts[1].variants[0]
    assert isinstance(question, Numeric)
    assert question.answer == means


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("answer: 20", "answer: 1:30", "answer: it must be a number, not '1:30': write a number"),
        ("answer: 20", "answer: 20 Hz", "answer: it must be a number, not '20 Hz': write a number"),
        ("answer: 20", "answer: '20'", "answer: it must be a number, not '20': write 20 without"),
        ("closed: true", "closed: yes", "closed: it must be true or false, not 'yes': write true."),
        ("closed: true", "closed: 'true'", "closed: it must be true or false, not 'true' in quo"),
        ("closed: true", "closed: 1", "closed: it must be true or false, not '1'."),
        ("Midterm", "\\ud800", "title: it holds half of a character, which is no text."),
        ("pass_mark: 2", "pass_mark: 2.5", "pass_mark: it must be a whole number, not '2.5'."),
        ("pass_mark: 2", "pass_mark: 2\n7: x", "line 2: it must be text, as every field's name"),
        ("kind: matching", "kind: [matching]", "kind: it must be one of single, predict, mult"),
    ],
)
def test_one_mistake_is_one_sentence(old: str, new: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "exam.yaml"
    path.write_text(EXAM.read_text().replace(old, new))
    [fault] = faults(path)
    assert said in fault


@pytest.mark.parametrize("value", [10**400, "1,5", "1_0", "ten", True, None, float("inf")])
def test_a_number_that_is_none_is_one_sentence(value: Any, tmp_path: Path) -> None:
    data = sample.data()
    concept = next(c for c in data["concepts"] if c["id"] == "numeric")
    concept["variants"][1]["answer"] = value
    [fault] = faults(sample.write(tmp_path, data))
    assert "item 'numeric-2', field answer: it " in fault
    assert len(fault) < 200
    if value == "1,5":
        assert fault.endswith("it must be a number, not '1,5': write 1.5 without quotes.")


def test_aliases_without_end_are_no_endless_work(tmp_path: Path) -> None:
    """A few lines of YAML can mean more values than there is memory for."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 12)]
    lines += ["concepts: [{id: one, variants: [{id: two, kind: single, stem: *a11}]}]"]
    path = tmp_path / "sample.yaml"
    path.write_text("\n".join(lines))
    assert any("field stem: it must be text, but it is a list" in fault for fault in faults(path))


def test_a_bank_that_lacks_only_the_right_suffix_is_named(tmp_path: Path) -> None:
    sample.write(tmp_path).rename(tmp_path / f"{sample.NAME}.yml")
    with pytest.raises(BankError, match=r"must be called sample.yaml, not sample.yml: rename it"):
        loader.load_bank(sample.NAME, tmp_path)


def test_a_closed_bank_validates_by_itself() -> None:
    assert Bank.model_validate(yaml.safe_load(EXAM.read_text())).closed
