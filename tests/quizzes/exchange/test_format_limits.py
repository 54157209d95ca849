"""What a platform's format cannot hold is said: each field of a bank is written, or named as lost.

A field is *written* if what is exported changes with it, and *lost* if it does not: then a sentence
must say so.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import pytest

from quizzes.bank import loader
from quizzes.bank.contents import Bank, Concept, Option, Pair, Trap
from quizzes.bank.faults import KINDS
from quizzes.exchange import bank_files
from tests.quizzes import sample

PARTS: dict[str, Any] = {
    "bank": Bank, "concept": Concept, "option": Option, "trap": Trap, "pair": Pair, **KINDS,
}  # fmt: skip
GIFT = {
    "bank title": "", "bank quiz": "", "bank chapter": "chapter", "bank pass_mark": "pass mark",
    "bank attempts": "Attempt rules", "bank closed": "closed", "bank misconceptions": "misconcept",
    "concept objective": "objectives", "proof": "names of the proofs", "show": "cells that show",
    "misconception": "misconceptions",
}  # fmt: skip
QTI = GIFT | {
    "bank chapter": "", "bank pass_mark": "pass mark", "bank attempts": "", "bank closed": "closed",
    "trap value": "particular wrong numbers", "trap tolerance": "particular wrong numbers",
    "trap feedback": "particular wrong numbers",
}  # fmt: skip
"""What says that a field is lost; empty, or not there, if it is written."""

STRUCTURE = ("kind", "variants", "concepts", "options", "traps", "pairs", "id", "keyless", "quiz")
"""What holds the other fields, or is another thing when it changes."""


def whole() -> dict[str, Any]:
    """A bank that uses every field, with one question of each kind."""
    data = sample.data(("single", *sample.KINDS))
    data["attempts"] = 7
    for concept in data["concepts"]:
        del concept["variants"][1:]
        for variant in concept["variants"]:
            variant["code"] = f"print({variant['id']!r})"
            if variant["kind"] == "numeric":
                variant |= {"misconception": sample.BELIEF, "show": "print('so')"}
    return data


def parts(data: dict[str, Any], part: str) -> list[dict[str, Any]]:
    """Every part of one sort in a bank's data."""
    if part == "bank":
        return [data]
    if part == "concept":
        return list(data["concepts"])
    variants = [v for concept in data["concepts"] for v in concept["variants"]]
    if part in KINDS:
        return [v for v in variants if v["kind"] == part]
    return [one for v in variants for one in v.get(f"{part}s", [])]


def other(name: str, value: Any) -> Any:
    """Return another value of a field that leaves the bank sound."""
    if name in ("correct", "closed"):
        return not value
    if name in ("misconception", "misconceptions"):
        return "another-belief" if name == "misconception" else {**value, "third": "A third."}
    if name == "pass_mark":
        return 1
    if isinstance(value, list):
        return [*value[:-1], f"{value[-1]} indeed"]
    if isinstance(value, str):
        return f"{value.rstrip()}  # indeed" if name in ("code", "show") else f"{value}x"
    return value + (1 if name == "attempts" else 0.25)


def changed(part: str, name: str) -> dict[str, Any]:
    data = whole()
    data["misconceptions"]["another-belief"] = "Another."
    for target in parts(data, part):
        if name == "correct":  # the key moves on by one
            continue
        if name in target:
            target[name] = other(name, target[name])
    if name == "correct":
        for variant in parts(data, "single"):
            right = next(o for o in variant["options"] if o.get("correct"))
            wrong = next(o for o in variant["options"] if not o.get("correct"))
            right["text"], wrong["text"] = wrong["text"], right["text"]
    if (part, name) == ("bank", "closed"):
        data["closed"] = True
    return data


def exported(data: dict[str, Any], format_name: str, folder: Path) -> tuple[list[Any], list[str]]:
    bank = Bank.model_validate(data)
    bank._folder = folder
    path, notes = bank_files.export_bank(bank, format_name, folder / "out")
    content = path.read_bytes()
    if format_name == "gift":
        return [content], notes
    archive = zipfile.ZipFile(io.BytesIO(content))
    return [archive.read(name) for name in sorted(archive.namelist())], notes


FIELDS = [
    (part, name)
    for part, model in PARTS.items()
    for name in model.model_fields
    if name not in STRUCTURE
]


@pytest.mark.parametrize("format_name", ["gift", "qti"])
def test_each_field_is_written_or_named_as_lost(format_name: str, tmp_path: Path) -> None:
    lost = GIFT if format_name == "gift" else QTI
    sample.write(folder := tmp_path / "bank")
    base = whole()
    base["misconceptions"]["another-belief"] = "Another."
    before, _ = exported(base, format_name, folder)
    wrong = []
    for part, name in FIELDS:
        says = lost.get(f"{part} {name}", lost.get(name, ""))
        after, notes = exported(changed(part, name), format_name, folder)
        if says and not any(says in note for note in notes):
            wrong.append(f"{part} {name}: nothing says '{says}'")
        if not says and after == before:
            wrong.append(f"{part} {name}: it changes nothing, and nothing says so")
    assert not wrong, wrong


@pytest.mark.parametrize("format_name", ["gift", "qti"])
def test_nothing_is_said_to_be_lost_that_is_not_there(format_name: str, tmp_path: Path) -> None:
    bank = loader.read_bank(loader.BANKS.parent / "examples" / "exam.yaml")
    _, notes = bank_files.export_bank(bank, format_name, tmp_path / "out")
    said = " ".join(notes)
    for name in ("misconceptions", "proofs", "cells", "pictures", "Formulas", "no ordering",
                 "Variants", "wrong numbers", "practice"):  # fmt: skip
        assert name not in said, said
    assert "The quiz is closed, but the " in said
    assert "the concepts' objectives" in said
